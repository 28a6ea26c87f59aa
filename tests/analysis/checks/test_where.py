"""Where in a sweep results lie, the worst of them, and the results that are made on request."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from sweeps import SWEEPS, of
from whole import simulated

from vibsim.analysis import analyse_records, summarise, verdicts
from vibsim.checks.outcome import Outcome, Results
from vibsim.checks.sweep_regions import sweep_regions
from vibsim.core.record import Record, Variable


def outcome(compared: np.ndarray, away: np.ndarray | None = None) -> Outcome:
    schemes, cases = compared.shape
    return Outcome(
        schemes=[f"s{i}" for i in range(schemes)],
        scheme_index=list(range(schemes)),
        cases=np.arange(cases),
        case_index=np.arange(cases),
        status=compared,
        reason=np.zeros_like(compared),
        compared=compared,
        away=np.zeros(compared.shape) if away is None else away,
        facts={},
    )


def sweep_record(**columns: np.ndarray) -> Record:
    coords = {
        name: Variable(("case",), values, {"sweep_key": name.replace("_", ".")})
        for name, values in columns.items()
    }
    return Record(coords, {})


def test_the_range_box_and_bins_of_a_corner() -> None:
    a, b = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 41), np.arange(5.0), indexing="ij"))
    bad = (a > 0.9) & (b >= 3)
    found = sweep_regions(sweep_record(x_a=a, x_b=b), outcome(bad.astype(np.int8)[None]))
    assert set(found) == {"FAIL"}
    row = found["FAIL"]
    assert row["count"] == 8
    assert row["text"] == (
        "FAIL in 8 of 205 results, all with x.a of 0.925 or more and x.b of 3 or more"
    )
    of_a, of_b = row["keys"]["x.a"], row["keys"]["x.b"]
    assert of_a["range"] == [0.925, 1.0]
    assert of_b["range"] == [3.0, 4.0]
    # a bin for each value of b, eight of about the same size for a
    assert [part["share"] for part in of_b["bins"]] == [0, 0, 0, 4 / 41, 4 / 41]
    assert len(of_a["bins"]) == 8
    assert [part["share"] > 0 for part in of_a["bins"]] == [False] * 7 + [True]
    assert of_a["bins"][0]["from"] == 0.0
    assert of_a["bins"][-1]["to"] == 1.0


def test_the_boxes_hold_what_they_say_together() -> None:
    rng = np.random.default_rng(0)
    x, y = rng.normal(size=(2, 4000))
    hits = rng.random(4000) < 0.5
    found = sweep_regions(sweep_record(x_a=x, x_b=y), outcome(hits.astype(np.int8)[None]))["FAIL"]
    inside = hits.copy()
    for key, values in (("x.a", x), ("x.b", y)):
        low, high = found["keys"][key]["box"]
        inside &= (values >= low) & (values <= high)
    assert inside.sum() >= 0.95 * hits.sum()
    # and are no larger than they need to be: of a normal distribution 97.5 % lie within 2.24
    low, high = found["keys"]["x.a"]["box"]
    assert high - low < 2 * 2.24 * 1.1
    assert found["text"].endswith("spread over the sweep")


def test_a_few_results_elsewhere_do_not_hide_where_most_are() -> None:
    x = np.linspace(0.0, 1.0, 1001)
    hits = x <= 0.1
    hits[900] = True
    text = sweep_regions(sweep_record(x_a=x), outcome(hits.astype(np.int8)[None]))["FAIL"]["text"]
    assert text.startswith("FAIL in 102 of 1001 results, at least 95% of them with x.a")


def test_two_ranges_tell_together_what_neither_tells_alone() -> None:
    a, b = (x.ravel() for x in np.meshgrid(np.arange(10.0), np.arange(10.0)))
    hits = (a + b == 13) & (a >= 4)
    text = sweep_regions(sweep_record(x_a=a, x_b=b), outcome(hits.astype(np.int8)[None]))["FAIL"][
        "text"
    ]
    assert text == "FAIL in 6 of 100 results, all with x.a of 4 or more and x.b of 4 or more"
    one = (a == 4) & (b == 7)
    text = sweep_regions(sweep_record(x_a=a, x_b=b), outcome(one.astype(np.int8)[None]))["FAIL"][
        "text"
    ]
    assert text == "FAIL in 1 of 100 results, with x.a equal to 4 and x.b equal to 7"


def test_words_and_schemes_are_told_apart() -> None:
    words = np.array(["kick", "backward"] * 6)
    compared = np.zeros((2, 12), dtype=np.int8)
    compared[1, 1::2] = 2
    found = sweep_regions(sweep_record(x_end=words), outcome(compared))["INCONCLUSIVE"]
    assert found["schemes"] == {"s0": 0, "s1": 6}
    assert found["keys"]["x.end"]["shares"] == {"backward": 0.5, "kick": 0.0}
    assert found["text"] == "INCONCLUSIVE in 6 of 24 results, all with x.end backward"


@pytest.mark.parametrize("value", [1.23456789, -1.23456789, 1.23456712, -1e-7 / 3, 12345678.9])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_is_said_of_a_border_is_true(value: float, side: float) -> None:
    x = value + side * np.linspace(-5.0, 1.0, 61)
    x[50] = value
    compared = (side * x >= side * value).astype(np.int8)[None]
    text = sweep_regions(sweep_record(x_a=x), outcome(compared))["FAIL"]["text"]
    start = "FAIL in 11 of 61 results, all with x.a of "
    assert text.startswith(start)
    border, words = text.removeprefix(start).split(" ", 1)
    assert words == ("or more" if side > 0 else "or less")
    assert side * float(border) <= side * value
    assert float(border) == pytest.approx(value, rel=1e-5, abs=1e-12)


@pytest.mark.parametrize("count", [6, 60, 95])
def test_a_range_that_separates_is_told_however_large_it_is(count: int) -> None:
    x = np.linspace(0.0, 1.0, 101)
    y = np.tile([0.0, 1.0], 51)[:101]
    hits = np.arange(101) >= 101 - count
    text = sweep_regions(sweep_record(x_a=x, x_b=y), outcome(hits.astype(np.int8)[None]))["FAIL"][
        "text"
    ]
    assert text == f"FAIL in {count} of 101 results, all with x.a of {x[101 - count]:g} or more"
    # but for one within it that passed, a large range says nothing
    hits[98] = False
    text = sweep_regions(sweep_record(x_a=x, x_b=y), outcome(hits.astype(np.int8)[None]))["FAIL"][
        "text"
    ]
    assert ("spread over the sweep" in text) == (count > 6)


def test_words_that_separate_are_told_however_many() -> None:
    words = np.array(["a", "b", "c", "d"] * 4)
    compared = (words != "b").astype(np.int8)[None]
    text = sweep_regions(sweep_record(x_a=words), outcome(compared))["FAIL"]["text"]
    assert text == "FAIL in 12 of 16 results, all with x.a a or c or d"


@pytest.mark.parametrize("border", [1.9, 0.1 + 0.2, 0.7, 3.1])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_short_border_keeps_its_digits(border: float, side: float) -> None:
    x = border + side * np.arange(-10.0, 5.0)
    x[10] = border
    compared = (side * x >= side * border).astype(np.int8)[None]
    text = sweep_regions(sweep_record(x_a=x), outcome(compared))["FAIL"]["text"]
    assert f"all with x.a of {border:.15g} or" in text


def test_without_a_sweep_nothing_is_anywhere() -> None:
    assert sweep_regions(Record({}, {}), outcome(np.ones((3, 1), dtype=np.int8))) == {}


@pytest.mark.parametrize("seed", range(20))
def test_the_worst_are_the_beginning_of_the_ranking(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = int(rng.integers(1, 4)), int(rng.integers(1, 40))
    # many equal distances, some unknown
    away = rng.integers(0, 4, shape).astype(float)
    away[rng.random(shape) < 0.1] = np.nan
    found = outcome(rng.integers(0, 3, shape).astype(np.int8), away)
    for most in (1, 3, 10, 200):
        assert found.worst(most).tolist() == found.ranking[:most].tolist()
        assert tuple(Results(found).worst(most)) == Results(found)[:most]
    assert len(Results(found)) == len(list(Results(found))) == found.total


@pytest.mark.slow
def test_the_summary_of_a_sweep_tells_where_and_how_to_run_a_member_alone() -> None:
    experiment = SWEEPS["ends"]
    record = analyse_records(experiment, simulated(experiment))
    summary = summarise(experiment, verdicts(experiment, record), record)
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    first: dict[str, Any] = summary["checks"][0]
    assert first["where"]["FAIL"]["text"] in first["text"]
    assert first["where"]["FAIL"]["count"] == first["counts"]["FAIL"]
    row = first["results"][0]
    assert row["command"] == f"vibsim run experiment.yaml@{row['case']}"
    expected = {"time.end": [1.6, 16.0, 40.0, 2000.0], "model.L": [0.5, 1.0]}
    case = row["case"]
    assert row["values"] == {
        "time.end": expected["time.end"][case // 2],
        "model.L": expected["model.L"][case % 2],
    }


def test_where_is_empty_for_what_passes() -> None:
    experiment = of({"initial.theta": [0.1, 0.2]}, checks=[{"value": "period", "below": 7}])
    record = analyse_records(experiment, simulated(experiment))
    (found,) = verdicts(experiment, record)
    assert found.where == {}
    assert found.text.startswith("All 4 results passed. The hardest is ")
