"""What a sweep is once it is read: rules of values, kept as rules."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tracemalloc
from typing import Any

import pytest
from experiment_files import build, calls_at_most, faults_of

from vibsim.experiment import Experiment, canonical, restore
from vibsim.experiment.rules.size_limits import MAX_MEMBERS
from vibsim.experiment.schema.sweep import Draw, Linspace, Logspace, Range

SAMPLE = {
    "method": "sobol",
    "n": 5,
    "seed": 7,
    "over": {"model.L": ["pi/4", 2], "time.end": [1, 2]},
}


def axes(**sweep: Any) -> Any:
    found = build(sweep=sweep).sweep
    assert found is not None
    return found.axes


def test_every_rule_stays_a_rule() -> None:
    found = axes(
        **{
            "model.g": {"linspace": [1, "2*pi", 10**3]},
            "model.L": {"logspace": ["1/2", 2, 5]},
            "initial.theta": {"range": [0, "pi", "pi/4"]},
            "initial.omega": ["pi", 1],
        }
    )
    assert [axis.values for axis in found] == [
        (Linspace(linspace=(1.0, 2 * math.pi, 1000)),),
        (Logspace(logspace=(0.5, 2.0, 5)),),
        (Range(range=(0.0, math.pi, math.pi / 4)),),
        ((math.pi, 1.0),),
    ]
    assert [axis.count for axis in found] == [1000, 5, 5, 2]


def test_zip_is_one_axis_and_sample_is_one_axis() -> None:
    pair = {"model.g": [1, 2, 3], "initial.theta": {"linspace": ["pi/4", "pi/2", 3]}}
    experiment = build(sweep={"initial.omega": [0, 1], "sample": SAMPLE, "zip": pair})
    assert experiment.sweep is not None
    assert experiment.sweep.keys == (
        "initial.omega",
        "model.L",
        "time.end",
        "model.g",
        "initial.theta",
    )
    single, sample, together = experiment.sweep.axes
    assert (single.count, sample.count, together.count) == (2, 5, 3)
    assert experiment.members == experiment.sweep.count == 30
    over = ((math.pi / 4, 2.0), (1.0, 2.0))
    assert sample.values == Draw(method="sobol", n=5, seed=7, over=over)
    assert together.values == (
        (1.0, 2.0, 3.0),
        Linspace(linspace=(math.pi / 4, math.pi / 2, 3)),
    )


def test_order_is_that_of_the_file() -> None:
    keys = ["model.m", "zip", "model.g", "sample", "initial.theta"]
    parts: dict[str, Any] = {key: [1.0] for key in keys}
    parts |= {"zip": {"initial.omega": [1.0]}, "sample": SAMPLE}
    for order in (keys, keys[::-1]):
        first = [axis.keys[0] for axis in axes(**{key: parts[key] for key in order})]
        names = {"zip": "initial.omega", "sample": "model.L"}
        assert first == [names.get(key, key) for key in order]


@pytest.mark.parametrize(
    ("rule", "count"),
    [
        ([0, 1, 0.1], 11),
        ([0, 0.3, 0.1], 4),  # 0.3/0.1 is 2.9999999999999996
        ([0, 0.99, 0.1], 10),
        ([0, 1 - 5e-11, 0.1], 11),  # hit to 5e-10 of a step
        ([0, 1 - 5e-10, 0.1], 10),
        ([3, 1, -0.5], 5),
        ([2, 2, 1], 1),
        ([2, 2, -1], 1),
    ],
)
def test_a_range_has_its_end_where_it_is_hit(rule: list[float], count: int) -> None:
    (axis,) = axes(**{"initial.theta": {"range": rule}})
    assert axis.count == count


def test_bounds_are_those_of_the_values_that_are_reached() -> None:
    """1 - 3*0.3 is above 0, although the end is not."""
    (axis,) = axes(**{"model.g": {"range": [1, 0, -0.3]}})
    assert axis.count == 4
    assert axis.spans[0][0] > 0


def test_options_are_words() -> None:
    label = "v1.0 beta"
    schemes = ["central", {"kind": "central", "label": label}]
    words = ("first_order", "centred")
    key = f"schemes.{label}.start"
    experiment = build(
        schemes=schemes,
        sweep={key: list(words), "zip": {"schemes.central.start": words, "model.g": [1, 2]}},
    )
    assert experiment.sweep is not None
    assert experiment.sweep.axes[0].values == (words,)
    assert experiment.members == 4
    assert not experiment.end_varies


@pytest.mark.parametrize(
    ("values", "varies"),
    [
        ({"linspace": [1, 2, 10**6]}, True),
        ({"linspace": [2, 2, 10**6]}, False),
        ({"logspace": [1, 2, 10**4]}, True),
        ({"logspace": [3, 3, 2]}, False),
        ({"range": [1, 2, 1e-6]}, True),
        ({"range": [1, 2, 3]}, False),
        ({"range": [1, 1, 3]}, False),
        ([2, 2, 2], False),
        ([2, 2, 3], True),
    ],
)
@pytest.mark.parametrize("together", [False, True])
def test_the_end_varies_where_its_values_differ(values: Any, varies: bool, together: bool) -> None:
    sweep = {"zip": {"time.end": values}} if together else {"time.end": values}
    assert build(levels=[1], sweep=sweep).end_varies is varies
    by_periods = {"periods": 2, "steps_per_period": 4}
    sweep = {"zip": {"model.g": values}} if together else {"model.g": values}
    assert build(levels=[1], sweep=sweep, time=by_periods).end_varies is varies
    assert not build(levels=[1], sweep=sweep).end_varies


def test_drawn_ends_count_as_different() -> None:
    for method in ("latin_hypercube", "sobol", "random"):
        assert build(sweep={"sample": SAMPLE | {"method": method, "n": 1}}).end_varies


EVERYTHING: list[dict[str, Any]] = [
    {"model.g": [1, 2.5, "pi"]},
    {"model.g": {"linspace": [1, 2, 5]}},
    {"model.g": {"logspace": [1, 2, 5]}},
    {"model.g": {"range": [1, 2, 0.25]}},
    {"schemes.central.start": ["first_order", "centred", "centred"]},
    {"zip": {"model.g": [1, 2], "schemes.central.start": ["centred", "first_order"]}},
    {"sample": SAMPLE, "initial.theta": [1], "zip": {"model.g": {"logspace": [1, 2, 3]}}},
    {"sample": SAMPLE | {"method": "random"}},
    {"sample": SAMPLE | {"method": "latin_hypercube"}},
]


@pytest.mark.parametrize("sweep", EVERYTHING)
def test_restored_from_canonical(sweep: dict[str, Any]) -> None:
    experiment = build(sweep=sweep, output="best")
    again = restore(json.loads(json.dumps(canonical(experiment), sort_keys=True, allow_nan=False)))
    assert again == experiment
    assert hash(again) == hash(experiment)
    assert canonical(again) == canonical(experiment)


def test_a_million_values_are_three_numbers() -> None:
    """In the plan, in its digests and in the provenance: all are made of the normal form."""
    rules: list[dict[str, Any]] = [
        {"model.g": {"linspace": [1, 2, 10**6]}},
        {"model.g": {"logspace": [1, 2, 10**6]}},
        {"model.g": {"range": [1, 2, 1e-6]}},
        {"sample": SAMPLE | {"n": 10**6}},
    ]
    for sweep in rules:
        experiment = build(levels=[1], sweep=sweep)
        assert experiment.members in (10**6, 10**6 + 1)
        assert len(json.dumps(canonical(experiment)["sweep"])) < 200


HUGE = 10**12


@pytest.mark.parametrize(
    "sweep",
    [
        {"model.g": {"logspace": [1, 2, HUGE]}},
        {"initial.theta": {"range": [0, HUGE - 1, 1]}},
        {"zip": {"model.g": {"linspace": [1, 2, HUGE]}, "model.L": {"logspace": [1, 2, HUGE]}}},
        {"sample": SAMPLE | {"n": HUGE}},
        {"sample": SAMPLE | {"n": HUGE, "method": "random"}},
        {"sample": SAMPLE | {"n": 10**6}, "zip": {"model.g": {"range": [1, 10**6, 1]}}},
    ],
)
def test_what_is_too_large_is_counted_and_not_written_out(sweep: dict[str, Any]) -> None:
    build(sweep={"model.m": [1]})
    tracemalloc.start()
    with calls_at_most(5_000):
        faults = faults_of(levels=[1], sweep=sweep)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    (fault,) = [fault for fault in faults if fault.key == "sweep"]
    assert fault.rule == f"must not have more than {MAX_MEMBERS} members, has {HUGE}"
    assert peak < 10_000_000


@pytest.mark.slow
def test_scattered_points_are_imported_only_where_they_are_drawn() -> None:
    program = (
        "import sys\n"
        "from vibsim.experiment import sweep_columns\n"
        "from vibsim.experiment import Experiment\n"
        "for method in ('random', 'sobol'):\n"
        "  e = Experiment.from_dict({'title': 'x', 'model': {'kind': 'pendulum'}, 'levels': [6],\n"
        "    'time': {'end': 1}, 'schemes': ['central'], 'sweep': {'sample': {'method': method,\n"
        "    'n': 4, 'seed': 1, 'over': {'model.g': [1, 2]}}}})\n"
        "  assert 'scipy' not in sys.modules\n"
        "  sweep_columns.columns(e, 0, 4)\n"
        "  print('scipy' in sys.modules)"
    )
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["False", "True"]


def test_equal_sweeps_are_equal() -> None:
    one, two = (build(sweep={"model.g": {"linspace": [1, 2, 5]}}) for _ in range(2))
    assert one == two
    assert hash(one) == hash(two)
    assert one != build(sweep={"model.g": {"linspace": [1, 2, 6]}})
    assert isinstance(one, Experiment)
