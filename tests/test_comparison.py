"""The script that compares two checkouts sees what differs, and nothing else."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from netCDF4 import Dataset

sys.path.insert(0, str(Path(__file__).parent / "comparison"))

import checkouts

SUMMARY = {
    "status": "PASS",
    "checks": [
        {
            "id": "order",
            "status": "PASS",
            "reason": "asymptotic",
            "results": [{"scheme": "rk4", "case": 0, "status": "PASS", "reason": "asymptotic"}],
        }
    ],
}


def results(folder: Path, values: list[float], summary: dict[str, object]) -> Path:
    experiment = folder / "adhoc/one"
    experiment.mkdir(parents=True)
    (experiment / "summary.json").write_text(json.dumps(summary))
    with Dataset(experiment / "level_06.nc", "w") as dataset:
        dataset.createDimension("t", len(values))
        for group in (dataset, dataset.createGroup("checks")):
            group.createVariable("u", "f8", ("t",))[:] = values
    return folder


def judged(reason: str) -> dict[str, object]:
    return json.loads(json.dumps(SUMMARY).replace("asymptotic", reason))


def test_the_same_results_do_not_differ_and_nan_equals_nan(tmp_path):
    sides = [results(tmp_path / side, [1.0, np.nan], SUMMARY) for side in checkouts.SIDES]
    found = checkouts.compare(*sides)
    assert (found.verdicts, found.values, found.differences, found.alone) == (3, 2, [], [])


@pytest.mark.parametrize("values", [[1.0, 2.0], [np.nan, np.nan], [1.0 + 2e-16, np.nan], [1.0]])
def test_another_value_differs_in_every_group(tmp_path, values):
    old = results(tmp_path / "old", [1.0, np.nan], SUMMARY)
    found = checkouts.compare(old, results(tmp_path / "new", values, SUMMARY))
    places = [line.split(": ")[1] for line in found.differences]
    assert places == ["checks/u", "u"]


def test_another_reason_differs(tmp_path):
    old = results(tmp_path / "old", [1.0], SUMMARY)
    found = checkouts.compare(old, results(tmp_path / "new", [1.0], judged("match")))
    places = [line.split(": ")[1] for line in found.differences]
    assert places == ["check order", "check order, rk4, case 0"]


def test_a_file_of_one_side_is_named_and_is_no_difference(tmp_path):
    sides = [results(tmp_path / side, [1.0], SUMMARY) for side in checkouts.SIDES]
    (sides[0] / "adhoc/one/level_06.nc").rename(sides[0] / "adhoc/one/level_07.nc")
    found = checkouts.compare(*sides)
    assert found.differences == []
    assert found.alone == [
        "adhoc/one/level_07.nc: only in old",
        "adhoc/one/level_06.nc: only in new",
    ]
