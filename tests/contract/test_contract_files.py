"""The files of an experiment: their names, what is in them, and that they are the same bytes every time."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
import yaml

from vibsim import Experiment, simulate

from .conftest import FILES, Runs
from .door import FORMAT, REASONS, fact, interval, judged, of_a_check, strict_json, vibsim

GOLDEN = json.loads((Path(__file__).parent / "golden.json").read_text())

EXPERIMENTS = {
    "tiny": ["level_06.nc", "level_07.nc", "level_08.nc", "best.nc"],
    "swept": [f"level_0{level}/shard_0000.nc" for level in (6, 7, 8)],
    "failing": [f"level_0{level}/shard_0000.nc" for level in (4, 5)],
}


def opened(path: Path) -> xarray.Dataset:
    with xarray.open_dataset(path, engine="netcdf4") as data:
        return data.load()


def summary(runs: Runs, name: str) -> Any:
    return strict_json((runs.of(name) / "summary.json").read_text())


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_an_experiment_has_its_files(runs: Runs, name: str) -> None:
    folder = runs.of(name)
    for file in [*EXPERIMENTS[name], "convergence.nc", "summary.json", "report.html"]:
        assert (folder / file).is_file(), file
    levels = [file[:8] for file in EXPERIMENTS[name] if file.startswith("level")]
    batch = f"{levels[0]}_to_{levels[-1][-2:]}"
    assert (folder / f"logs/{batch}.log").is_file()
    assert (folder / f"benchmarks/{batch}.tsv").is_file()
    assert list(folder.glob("tables/*.csv"))
    assert {path.stem for path in folder.glob("tables/*.csv")} == {
        path.stem for path in folder.glob("tables/*.tex")
    }
    assert list(folder.glob("figures/*.svg"))
    for file in ("index.html", "summary.csv"):
        assert (folder.parents[1] / file).is_file()
    found = {path.relative_to(folder).as_posix() for path in folder.rglob("*.nc")}
    assert found == {*EXPERIMENTS[name], "convergence.nc"}


def test_the_same_bytes_on_one_core_and_on_two(runs: Runs) -> None:
    """In two results folders, beside other experiments."""
    compared = 0
    for path in sorted((runs.passing / "adhoc/tiny").rglob("*")):
        if path.suffix in {".nc", ".json", ".csv", ".svg", ".html"} and path.is_file():
            other = runs.mixed / path.relative_to(runs.passing)
            if "logs" in path.parts or "benchmarks" in path.parts:
                continue
            assert path.read_bytes() == other.read_bytes(), path
            compared += 1
    assert compared > 20


def test_a_shard_made_by_hand_is_that_of_the_workflow(runs: Runs, tmp_path: Path) -> None:
    out, job = tmp_path / "hand.nc", ["--level", 7, "--shard", 0]
    ended = vibsim("simulate", runs.file("swept"), *job, "--out", out, "--results", tmp_path)
    assert ended.returncode == 0, ended.stderr
    assert out.read_bytes() == (runs.of("swept") / "level_07/shard_0000.nc").read_bytes()


# -- netCDF ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_variable_says_what_it_is(runs: Runs, name: str) -> None:
    for file in [*EXPERIMENTS[name], "convergence.nc"]:
        data = opened(runs.of(name) / file)
        assert data.attrs["Conventions"].startswith("CF-")
        assert int(data.attrs["vibsim_format"]) == FORMAT
        assert data.attrs["integrity"]
        assert data.attrs["provenance"]
        assert "vibsim" in data.attrs["history"]
        assert not re.search(r"20\d\d-\d\d-\d\d|\d\d:\d\d:\d\d", data.attrs["history"])
        assert {"scheme", "case", "t"} <= set(data.dims)
        for variable in data.variables:
            assert data[variable].attrs["long_name"], variable
        for variable in data.data_vars:
            assert "units" in data[variable].attrs, variable


@pytest.mark.parametrize("name", sorted(GOLDEN["variables"]))
def test_no_variable_is_lost(runs: Runs, name: str) -> None:
    """Every variable that there was is there, with the same dims. More of them are welcome."""
    experiment, _, file = name.partition("/")
    data = opened(runs.of(experiment) / file)
    found = {
        str(one): " ".join(map(str, data[one].dims))
        for one in data.variables
        if not of_a_check(str(one), data[one].dims)
    }
    wanted = GOLDEN["variables"][name]
    assert {one: found.get(one) for one in wanted} == wanted


def test_energies_of_a_level_belong_together(runs: Runs) -> None:
    data = opened(runs.mixed / "adhoc/tiny/level_07.nc")
    parts = data["kinetic_energy"] + data["potential_energy"]
    np.testing.assert_allclose(data["energy"], parts, rtol=1e-13)
    np.testing.assert_allclose(
        data["energy_deviation"], data["energy"] - data["energy"].isel(t=0), atol=1e-15
    )
    # crank_nicolson has a velocity of its own, so the centred difference is another one
    t, theta = data["t"].values, data["theta"].values
    centred = (theta[..., 2:] - theta[..., :-2]) / (2 * (t[1] - t[0]))
    np.testing.assert_allclose(data["omega_d2t"].values[..., 1:-1], centred, atol=1e-13)
    assert np.all(np.isnan(data["omega_d2t"].values[..., [0, -1]]))
    for name in ("energy_d2t", "energy_deviation_d2t"):
        assert data[name].dims == ("scheme", "case", "t")
    np.testing.assert_allclose(data["theta_exact"][0], np.cos(t), atol=1e-14)
    np.testing.assert_allclose(data["omega_exact"][0], -np.sin(t), atol=1e-14)


def test_a_shard_has_the_swept_values_beside_its_cases(runs: Runs) -> None:
    data = opened(runs.mixed / "adhoc/swept/level_06/shard_0000.nc")
    np.testing.assert_array_equal(data["case"], [0, 1, 2])
    assert data["initial_theta"].dims == ("case",)
    np.testing.assert_array_equal(data["initial_theta"], [0.5, 1.0, 1.5])
    np.testing.assert_array_equal(data["theta"].isel(scheme=0, t=0), [0.5, 1.0, 1.5])


def test_differences_have_the_sign_and_the_scale_of_the_contract(runs: Runs) -> None:
    """u_l - u_(l+1); 4^k times it; -4/3 of it and the true error, both exact - computed at the coarser level."""
    folder = runs.mixed / "adhoc/tiny"
    levels = {level: opened(folder / f"level_0{level}.nc") for level in (6, 7, 8)}
    found = opened(folder / "convergence.nc")
    np.testing.assert_array_equal(found["level"], [6, 7, 8])
    np.testing.assert_array_equal(found["pair"], [6, 7])
    np.testing.assert_array_equal(found["triple"], [6])
    assert [str(name) for name in found["norm"].values] == ["l1", "l2", "linf", "linf_interior"]
    np.testing.assert_array_equal(found["t"], levels[6]["t"])
    common = {
        level: data["theta"].values[..., :: 2 ** (level - 6)] for level, data in levels.items()
    }
    exact = levels[6]["theta_exact"].values
    for k, pair in enumerate((6, 7)):
        one = found.sel(pair=pair)
        difference = common[pair] - common[pair + 1]
        np.testing.assert_allclose(one["theta_difference"], difference, rtol=0, atol=1e-15)
        np.testing.assert_allclose(one["theta_rescaled"], 4**k * difference, rtol=0, atol=1e-14)
        np.testing.assert_allclose(
            one["theta_error_estimate"], -4 / 3 * difference, rtol=1e-12, atol=1e-15
        )
        np.testing.assert_allclose(one["theta_error"], exact - common[pair], rtol=0, atol=1e-14)
    size = [np.sqrt(np.mean((common[level] - common[level + 1]) ** 2, axis=-1)) for level in (6, 7)]
    order = found["theta_observed_order"].sel(triple=6, norm="l2").values
    # a mean over the points, or an integral over time: both are the same to a few parts in a thousand
    np.testing.assert_allclose(order, np.log2(size[0] / size[1]), atol=5e-3)
    assert float(order[0, 0]) == pytest.approx(2, abs=0.05)
    error = np.abs(found["theta_richardson"].values - exact)
    assert error.max() < 1e-2 * np.abs(common[8] - exact).max()
    assert found["theta_richardson_error"].dims == ("scheme", "case", "t")
    assert found["theta_ratio"].dims == ("scheme", "case", "triple", "t")


def test_the_best_solution_is_better_than_its_finest_level(runs: Runs) -> None:
    data = opened(runs.mixed / "adhoc/tiny/best.nc")
    t = data["t"].values
    for state, exact in (("theta", np.cos(t)), ("omega", -np.sin(t))):
        error = np.abs(data[state].values[0, 0] - exact)
        assert np.all(error <= data[f"{state}_error"].values[0, 0])
        assert error.max() < 1e-6


def test_a_failure_is_in_the_files_and_spares_the_other_member(runs: Runs) -> None:
    data = opened(runs.mixed / "adhoc/failing/level_05/shard_0000.nc")
    u = data["u"].isel(scheme=0).values
    assert np.all(np.isfinite(u[0]))
    assert not np.all(np.isfinite(u[1]))
    assert int(data["status"][0, 0]) == 0
    assert int(data["status"][0, 1]) != 0
    assert np.isnan(float(data["failure_time"][0, 0]))
    assert 0.0 < float(data["failure_time"][0, 1]) <= 10.0


@pytest.mark.parametrize("name", ["tiny", "swept"])
def test_python_in_memory_has_the_numbers_of_the_files(runs: Runs, name: str) -> None:
    """Every variable of every level and of the comparison, bit for bit; and the same verdicts."""
    folder = runs.of(name)
    experiment = Experiment.from_yaml(runs.file(name))
    assert experiment.levels == (6, 7, 8)
    levels = {level: simulate(experiment, level) for level in experiment.levels}
    found = judged(experiment, levels)
    pairs = [
        (levels[level], opened(folder / file))
        for level, file in zip((6, 7, 8), EXPERIMENTS[name], strict=False)
    ]
    pairs.append((found.convergence, opened(folder / "convergence.nc")))
    for memory, file in pairs:
        names = {str(one) for one in file.variables if not of_a_check(str(one), file[one].dims)}
        assert names <= {str(one) for one in memory.variables}
        for one in sorted(names):
            np.testing.assert_array_equal(memory[one].values, file[one].values, err_msg=one)
    told = [(c["id"], c["status"], c["reason"], c["text"]) for c in summary(runs, name)["checks"]]
    assert told == [(v.id, v.status, v.reason, v.text) for v in found.verdicts]


# -- summaries -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_summary_json_has_its_keys(runs: Runs, name: str) -> None:
    found = summary(runs, name)
    assert found["vibsim_format"] == FORMAT
    assert (found["collection"], found["experiment"]) == ("adhoc", name)
    assert found["title"] == yaml.safe_load(FILES[name])["title"]
    for check in found["checks"]:
        assert {
            "id",
            "kind",
            "text",
            "quantity",
            "expected",
            "status",
            "reason",
            "advice",
            "results",
            "counts",
        } <= set(check)
        assert check["reason"] in REASONS[check["status"]]
        assert set(check["counts"]) == set(REASONS)
        assert sum(check["counts"].values()) >= len(check["results"]) > 0
        for result in check["results"]:
            assert {"scheme", "case", "status", "reason", "facts", "sentence"} <= set(result)
            assert result["reason"] in REASONS[result["status"]]


def test_summary_json_has_the_checks_in_the_order_of_the_file(runs: Runs) -> None:
    found = summary(runs, "tiny")
    assert found["status"] == "PASS"
    assert found["failures"] == []
    told = [(c["id"], c["kind"], c["status"], c["reason"]) for c in found["checks"]]
    assert told == [
        ("order", "converges", "PASS", "asymptotic"),
        ("energy", "converges", "PASS", "exact"),
        ("check_3", "value", "PASS", "match"),
        ("trap", "converges", "PASS", "match"),
        ("said", "claim", "PASS", "match"),
    ]
    assert [c["quantity"] for c in found["checks"][:3]] == ["theta", "energy_deviation", "theta"]
    (result,) = found["checks"][0]["results"]
    assert (result["scheme"], result["case"]) == ("crank_nicolson", 0)
    assert fact(result, "order") == pytest.approx(2, abs=0.05)
    assert fact(result, "promised") == 2
    assert list(fact(result, "levels")) == [6, 8]
    low, high = interval(result) or (0.0, 0.0)
    assert 1.9 < low <= fact(result, "order") <= high < 2.1
    assert low < high


def test_summary_json_counts_the_members_of_a_sweep(runs: Runs) -> None:
    (check,) = summary(runs, "swept")["checks"]
    assert check["counts"] == {"PASS": 3, "FAIL": 0, "INCONCLUSIVE": 0}
    assert sorted(result["case"] for result in check["results"]) == [0, 1, 2]


def test_summary_json_has_every_failure_with_its_place(runs: Runs) -> None:
    found = summary(runs, "failing")
    assert found["status"] == "FAIL"
    assert [check["reason"] for check in found["checks"]] == ["non_finite", "non_finite"]
    assert found["checks"][0]["counts"] == {"PASS": 1, "FAIL": 1, "INCONCLUSIVE": 0}
    assert found["checks"][1]["counts"] == {"PASS": 0, "FAIL": 1, "INCONCLUSIVE": 1}
    places = [(one["scheme"], one["level"], one["case"]) for one in found["failures"]]
    assert sorted(places) == [("rk4", 4, 1), ("rk4", 5, 1)]
    for one in found["failures"]:
        assert {"t", "step", "error"} <= set(one)
        assert 0.0 < one["t"] <= 10.0
        assert one["t"] == pytest.approx(one["step"] * 10.0 / 2 ** one["level"])
        assert one["error"]


def test_summary_csv_has_a_line_for_every_check(runs: Runs) -> None:
    rows = list(csv.DictReader(io.StringIO((runs.mixed / "summary.csv").read_text())))
    told = [
        (r["collection"], r["experiment"], r["check"], r["kind"], r["status"], r["reason"])
        for r in rows
    ]
    wanted = [
        ("adhoc", name, check["id"], check["kind"], check["status"], check["reason"])
        for name in FILES
        for check in summary(runs, name)["checks"]
    ]
    assert sorted(told) == sorted(wanted)
    for row in rows:
        assert row["experiment status"] == summary(runs, row["experiment"])["status"]
        assert row["title"] == yaml.safe_load(FILES[row["experiment"]])["title"]
    (order,) = (r for r in rows if (r["experiment"], r["check"]) == ("tiny", "order"))
    assert float(order["order"]) == pytest.approx(2, abs=0.05)
    assert float(order["order_low"]) <= 2 <= float(order["order_high"])
    assert 0 < float(order["error"]) <= float(order["error_bound"])
    assert 0 < float(order["relative_error"]) < 1


def test_tables_are_rectangular(runs: Runs) -> None:
    for path in runs.folder.glob("*/adhoc/*/tables/*.csv"):
        first, *rows = csv.reader(io.StringIO(path.read_text()))
        assert all(len(row) == len(first) for row in rows), path


def test_pages_open_offline_and_lead_to_each_other(runs: Runs) -> None:
    index = (runs.mixed / "index.html").read_text()
    for name in FILES:
        assert f'href="adhoc/{name}/report.html' in index
        page = (runs.of(name) / "report.html").read_text()
        assert yaml.safe_load(FILES[name])["title"] in page
        for check in summary(runs, name)["checks"]:
            assert check["id"] in page
            assert check["status"] in page
            assert check["reason"] in page
        for text in (index, page):
            loaded = re.findall(r"<(?:script|img|link|iframe)\b[^>]*?(?:src|href)=\"([^\"]*)", text)
            assert not [one for one in loaded if re.match(r"(https?:)?//", one)]
        assert not re.findall(r"<(?:script|img|link|iframe)\b[^>]*?src=\"(?!data:)", page)
