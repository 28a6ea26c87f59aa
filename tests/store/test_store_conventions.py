"""The files that jobs write, with all that they may hold, keep to the CF conventions."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import xarray as xr

from vibsim import store
from vibsim.cli import main
from vibsim.core.record import Record, Variable

TEXT = """\
title: A spring
source: nowhere
model: {kind: spring, w: 2*pi}
initial: {u: 1.0}
time: {end: 5.0, base_steps: 10}
levels: [3, 4, 5]
schemes: [central, rk4, {kind: dop853, tolerance: [1e-4, 1e-8]}]
samples: SAMPLES
sweep: {model.w: [6.0, 6.5]}
checks:
  - {converges: u, order: scheme, schemes: [central, rk4]}
  - {stable: true, schemes: [rk4]}
  - {conserves: energy, drift: bounded, schemes: [central]}
  - {equal: [central, discrete], quantity: u}
published:
  - title: A table
    source: nowhere
    value: relative_energy_error_d2t
    beside: [relative_energy_error, growth_per_period]
    rows:
      - {scheme: rk4, level: 4, printed: "1.0e-3", holds: false, note: another one}
      - {scheme: dop853_1e-08, level: 4, printed: "2e-9", holds: false}
"""
EXTREMA = {
    f"{kind}{end}"
    for kind in ("peak", "trough")
    for end in ("", "_time", "_time_grid", "_grid", "_count")
}
LEVEL = EXTREMA | {"v_d2t", "energy_d2t", "energy_deviation_d2t_running_max", "accepted_steps"}
CONVERGENCE = {
    "theory_growth",
    "measured_growth",
    "stability_limit",
    "energy_drift_kind",
    "force_evaluations_total",
}
PART = 30
"""Variables that the checker is given at a time."""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Write the files of a run, with series and without them."""
    found = {}
    for storage, samples in (("series", "all"), ("lean", "auto")):
        folder = tmp_path_factory.mktemp(storage)
        file = folder / "spring.yaml"
        file.write_text(TEXT.replace("SAMPLES", samples))
        with pytest.MonkeyPatch.context() as patch:
            if storage == "lean":
                patch.setattr("vibsim.experiment.storage.LEAN", 0)
            common = [str(file), "--results", str(folder)]
            assert main(["simulate", *common, "--level", "3", "4", "5"]) == 0
            assert main(["analyse", *common]) == 0
        found[storage] = folder
    return found


@pytest.mark.slow
def test_cf_checker_finds_nothing_in_what_jobs_write(
    results: dict[str, Path], tmp_path: Path
) -> None:
    """Of `convergence.nc` tables and theory alone; a slow test has its hundreds of other variables."""
    (level,) = results["series"].rglob("level_05/*.nc")
    found = store.read(level).variables
    assert set(found) >= LEVEL
    assert any("extremum" in variable.dims for variable in found.values())
    whole = store.read(convergence(results))
    kept = {
        name: variable
        for name, variable in whole.variables.items()
        if name in CONVERGENCE or {"beside", "check"} & set(variable.dims)
    }
    assert any("beside" in variable.dims for variable in kept.values())
    part = written(tmp_path / "part.nc", whole, kept)
    (lean_level,) = results["lean"].rglob("level_05/*.nc")
    check(level, lean_level, part)


@pytest.mark.parametrize("name", ["level_05/*.nc", "convergence.nc"])
def test_every_variable_has_a_unit_and_a_name_that_can_be_read_alone(
    results: dict[str, Path], name: str
) -> None:
    (file,) = results["series"].rglob(name)
    record = store.read(file)
    for key, variable in {**record.coords, **record.variables}.items():
        assert variable.attrs["units"], key
        told = variable.attrs["long_name"]
        assert len(told) > 3, key
        words = told.rpartition(": ")[2]
        assert not words.startswith(("its ", "that error", "the same")), key


def test_an_l1_norm_has_the_unit_of_an_integral_over_time(results: dict[str, Path]) -> None:
    (file,) = results["series"].rglob("level_05/*.nc")
    variables = store.read(file).variables
    assert [variables[f"{q}_l1"].attrs["units"] for q in ("u", "v")] == ["m s", "m"]
    assert "square root of s" in variables["u_l2"].attrs["long_name"]


def test_a_coordinate_says_which_power_of_s_a_norm_adds_to_a_unit(results: dict[str, Path]) -> None:
    with xr.open_dataset(convergence(results), decode_timedelta=False) as data:
        norms = data["u_difference_norm"]
        assert norms.attrs["units"] == "m"
        powers = norms.sel(norm=["l1", "l2", "linf", "linf_interior"])["norm_seconds"].values
    assert powers.tolist() == [1, 0.5, 0, 0]


@pytest.mark.slow
def test_cf_checker_finds_nothing_in_a_whole_convergence(
    results: dict[str, Path], tmp_path: Path
) -> None:
    file = convergence(results)
    variables = store.read(file).variables
    assert set(variables) >= CONVERGENCE
    assert any("beside" in variable.dims for variable in variables.values())
    (lean,) = results["lean"].rglob("convergence.nc")
    other = tmp_path / "lean"
    other.mkdir()
    check(*parts(file, tmp_path), *parts(lean, other))


def convergence(results: dict[str, Path]) -> Path:
    """Return the file of the analysis that keeps series."""
    return next(results["series"].rglob("convergence.nc"))


def parts(file: Path, folder: Path) -> list[Path]:
    """Write a file in parts, each with all coordinates: the checker's time grows with the square of the variables."""
    whole = store.read(file)
    names = list(whole.variables)
    found = []
    for start in range(0, len(names), PART):
        some = {name: whole.variables[name] for name in names[start : start + PART]}
        found.append(written(folder / f"part_{start}.nc", whole, some))
    assert {name for part in found for name in store.read(part).variables} == set(names)
    return found


def written(file: Path, whole: Record, variables: dict[str, Variable]) -> Path:
    kept = replace(whole, variables=variables)
    store.write(file, kept, digest="d" * 64, provenance={})
    return file


def check(*files: Path) -> None:
    checker = Path(sys.executable).with_name("compliance-checker")
    ended = subprocess.run(
        [checker, "--test", "cf:1.11", "--criteria", "strict", *map(str, files)],
        capture_output=True,
        text=True,
        check=False,
    )
    text = ended.stdout + ended.stderr
    assert ended.stdout.count("All tests passed!") == len(files), text
    assert "exceptions occurred" not in text
    assert ended.returncode == 0
