"""Results as one tree of xarray (`vibsim.open`)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import vibsim
from vibsim import Experiment, VibsimError, analyse, simulate
from vibsim.core.errors import DamagedFileError
from vibsim.core.record import Record
from vibsim.store import write, write_json

SPEC = {
    "title": "Four pendulums",
    "model": {"kind": "pendulum"},
    "time": {"end": 6.0},
    "levels": [5, 6, 7],
    "schemes": ["central", "rk4"],
    "sweep": {"initial.theta": [0.5, 1.0, 1.5, 2.0]},
}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A results folder with an experiment whose coarsest level has two files."""
    results = tmp_path_factory.mktemp("results")
    folder = results / "adhoc" / "four"
    experiment = Experiment.from_dict(SPEC)
    levels = [simulate(experiment, level) for level in experiment.levels]
    halves = [levels[0].isel(case=slice(0, 3)), levels[0].isel(case=slice(3, 4))]
    files = {f"level_05/shard_{i:04d}.nc": half for i, half in enumerate(halves)}
    files |= {f"level_{k:02d}.nc": data for k, data in zip((6, 7), levels[1:], strict=True)}
    files["convergence.nc"] = analyse(experiment, levels)
    for name, dataset in files.items():
        titled = dataset.assign_attrs(title=name)
        write(folder / name, Record.from_xarray(titled), digest="job", provenance={})
    content = {"collection": "adhoc", "experiment": "four", "title": SPEC["title"]}
    write_json(folder / "summary.json", {**content, "status": "PASS"}, digest="job")
    (folder / "figures").mkdir()
    return results


def test_every_file_is_a_node_with_what_was_computed(made: Path) -> None:
    experiment = Experiment.from_dict(SPEC)
    with vibsim.open(made / "adhoc" / "four") as tree:
        assert list(tree.children) == ["convergence", "level_05", "level_06", "level_07"]
        assert tree.attrs == {
            "title": "Four pendulums",
            "collection": "adhoc",
            "experiment": "four",
            "status": "PASS",
        }
        for level in experiment.levels:
            found, wanted = tree[f"level_{level:02d}"], simulate(experiment, level)
            assert int(found["level"]) == level
            assert found.case.values.tolist() == [0, 1, 2, 3]
            assert set(found.data_vars) == set(wanted.data_vars)
            for name, variable in wanted.data_vars.items():
                np.testing.assert_array_equal(found[name].values, variable.values)
                assert found[name].dims == variable.dims
            assert found.initial_theta.values.tolist() == [0.5, 1.0, 1.5, 2.0]
        assert tree["convergence"].sizes["pair"] == 2


def test_of_a_folder_above_all_experiments_are_in_the_tree(made: Path) -> None:
    # the documentation lies there as well, with copies of experiment files
    other = made / "docs" / "_downloads" / "level_30.yaml"
    other.parent.mkdir(parents=True)
    other.write_text("title: no data")
    with vibsim.open(made) as tree:
        assert tree["adhoc/four/level_06"].sizes["t"] == 65
        assert list(tree.children) == ["adhoc"]


def test_xarray_puts_levels_side_by_side(made: Path) -> None:
    with vibsim.open(made / "adhoc" / "four") as tree:
        levels = [tree[f"level_{level:02d}"].to_dataset() for level in (5, 6, 7)]
        both = xr.concat(levels, "level", join="outer", combine_attrs="drop_conflicts")
        assert both.level.values.tolist() == [5, 6, 7]
        assert both.sizes["t"] == 129
        for data in levels:
            one = both.sel(level=int(data.level))
            for name in ("theta", "peak_time", "peak_count"):
                kept = one[name].sel({dim: data[dim] for dim in data[name].dims})
                np.testing.assert_array_equal(kept.values, data[name].values)
            assert one.peak.count() == data.peak.count()


def test_a_folder_without_results_is_refused(made: Path) -> None:
    with pytest.raises(VibsimError, match="no such folder"):
        vibsim.open(made / "adhoc" / "five")
    with pytest.raises(VibsimError, match="no results"):
        vibsim.open(made / "adhoc" / "four" / "figures")


def test_a_file_that_has_changed_is_refused(made: Path) -> None:
    path = made / "adhoc" / "four" / "level_05" / "shard_0001.nc"
    whole = path.read_bytes()
    path.write_bytes(whole[:3000] + bytes([whole[3000] ^ 1]) + whole[3001:])
    try:
        with pytest.raises(DamagedFileError, match=r"shard_0001\.nc"):
            vibsim.open(made)
    finally:
        path.write_bytes(whole)


@pytest.mark.slow
def test_with_chunks_nothing_is_read_before_it_is_needed(made: Path) -> None:
    folder = made / "adhoc" / "four"
    with vibsim.open(folder) as read, vibsim.open(folder, chunks={}) as tree:
        theta = tree["level_05/theta"]
        assert theta.chunks is not None
        assert theta.chunks[1] == (3, 1)  # a chunk for each of its two files
        assert type(theta.data).__module__.startswith("dask")
        error = abs(theta - tree["level_05/theta_exact"]).max("t")
        wanted = abs(read["level_05/theta"] - read["level_05/theta_exact"]).max("t")
        assert type(error.data).__module__.startswith("dask")
        xr.testing.assert_equal(error.compute(), wanted)


def test_level_files_are_put_side_by_side(made: Path) -> None:
    files = sorted((made / "adhoc" / "four").glob("level_*.nc"))
    options = {"join": "outer", "combine_attrs": "drop_conflicts"}
    found = xr.open_mfdataset(files, combine="nested", concat_dim="level", **options)
    with found, xr.open_dataset(files[1]) as finest:
        assert found.level.values.tolist() == [6, 7]
        assert found.period.chunks is not None
        xr.testing.assert_equal(
            found.period.sel(level=7).compute().drop_vars("level"), finest.period.drop_vars("level")
        )


def test_members_of_a_solver_are_joined_though_their_times_differ(tmp_path: Path) -> None:
    for case, gain in enumerate((1.0, 3.0)):
        times = np.linspace(0.0, 1.0, 3 + 2 * case)
        member = xr.Dataset(
            {"T": ("t", gain * times), "last": gain},
            {"t": times, "level": 0, "h": 0.5, "gain": gain},
        )
        for name in member.variables:
            member[name].attrs = {"long_name": str(name), "units": "1"}
        file = tmp_path / "level_00" / f"shard_{case:04d}.nc"
        write(file, Record.from_xarray(member.assign_attrs(title="T")), digest="job", provenance={})
    with vibsim.open(tmp_path) as tree:
        level = tree["level_00"]
        assert level["T"].dims == ("case", "t")
        assert level["gain"].values.tolist() == level["last"].values.tolist() == [1.0, 3.0]
        assert level["h"].dims == ()
        assert level["T"].sel(case=1, t=0.25) == 0.75
        assert np.isnan(level["T"].sel(case=0, t=0.25))
