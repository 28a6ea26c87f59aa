from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vibsim import plan
from vibsim.analysis import analyse_records, verdicts
from vibsim.simulation import simulate_record
from vibsim.spec import Experiment
from vibsim.spec.sampling import SMALL


def experiment(**changes: Any) -> Experiment:
    content = {
        "title": "A pendulum",
        "model": {"kind": "pendulum"},
        "initial": {"theta": 1.0},
        "time": {"end": 20.0, "base_steps": changes.pop("base", 1)},
        "levels": [6, 7, 9],
        "schemes": ["central"],
    }
    return Experiment.from_dict({**content, **changes})


def test_without_a_sweep_there_is_one_member_and_no_column() -> None:
    assert plan.count(experiment()) == 1
    assert plan.columns(experiment(), 0, 1) == {}


def test_a_grid_runs_through_its_last_key_first() -> None:
    grid = experiment(sweep={"initial.theta": [0.1, 0.2], "model.g": [1.0, 2.0, 3.0]})
    found = plan.columns(grid, 0, 6)
    assert plan.count(grid) == 6
    np.testing.assert_array_equal(found["initial.theta"], [0.1, 0.1, 0.1, 0.2, 0.2, 0.2])
    np.testing.assert_array_equal(found["model.g"], [1, 2, 3, 1, 2, 3])


def test_members_do_not_depend_on_the_range_that_is_asked() -> None:
    sweep = {
        "model.L": {"linspace": [1, 5, 5]},
        "initial.theta": {"linspace": [0.1, 3.0, 7]},
    }
    grid = experiment(sweep=sweep)
    whole = plan.columns(grid, 0, 35)
    for start, stop in ((0, 1), (3, 11), (34, 35), (12, 12)):
        part = plan.columns(grid, start, stop)
        for key, values in part.items():
            np.testing.assert_array_equal(values, whole[key][start:stop])


@pytest.mark.parametrize("samples", ["auto", "common", "all"])
@pytest.mark.parametrize("base", [1, 3, 7])
def test_the_common_grid_and_the_end_are_always_kept(samples: str, base: int) -> None:
    e = experiment(samples=samples, base=base)
    for level in e.levels:
        every = plan.sampling(e, level)
        kept = set(range(0, e.steps(level) + 1, every))
        common = e.steps(level) // e.steps(e.levels[0])
        assert set(range(0, e.steps(level) + 1, common)) <= kept
        assert e.steps(level) in kept
        if samples == "all":
            assert every == 1
        if samples == "common":
            assert every == common


@pytest.mark.parametrize(("base", "n"), [(1, 1), (1, 16), (3, 3), (3, 24), (7, 7 * 64)])
def test_every_nth_step_is_every_nth_step_of_each_level(base: int, n: int) -> None:
    e = experiment(samples={"every": n}, base=base)
    assert [plan.sampling(e, level) for level in e.levels] == [n] * 3


@pytest.mark.parametrize(("base", "n"), [(3, 3), (1, 8), (5, 10)])
def test_levels_with_every_nth_step_are_compared_where_they_meet(base: int, n: int) -> None:
    """The comparison is that of a run which stores every step, at every n-th of its times."""
    check = {"converges": "theta", "order": 2, "tolerance": 0.2}
    at = {"value": "at", "quantity": "theta", "at": {"step": 2 * n, "level": 9}, "below": 10}
    best = {"value": "end", "quantity": "theta", "at": {"best": True}, "below": 10}
    found, verdict = {}, {}
    for samples in ("all", {"every": n}):
        e = experiment(samples=samples, base=base, levels=[6, 7, 8, 9], checks=[check, at, best])
        records = {level: simulate_record(e, level) for level in e.levels}
        found[str(samples)] = analyse_records(e, records)
        verdict[str(samples)] = verdicts(e, found[str(samples)])
    whole, part = found.values()
    assert len(part["t"]) == base * 64 // n + 1
    np.testing.assert_array_equal(part["t"], whole["t"][::n])
    for name in ("theta_difference", "theta_error", "theta_richardson"):
        np.testing.assert_array_equal(part[name], whole[name][..., ::n])
    np.testing.assert_array_equal(part["check_value"][1:], whole["check_value"][1:])
    assert [[v.status for v in one] for one in verdict.values()] == [["PASS"] * 3] * 2


def test_auto_keeps_everything_while_it_is_small() -> None:
    members = 10
    steps = SMALL // members - 1
    sweep = {"model.L": {"linspace": [1, 2, members]}}
    small = experiment(levels=[0, 1], base=steps // 2, sweep=sweep)
    assert members * (small.steps(1) + 1) <= SMALL
    assert plan.sampling(small, 1) == 1
    large = experiment(levels=[0, 1], base=steps, sweep=sweep)
    assert plan.sampling(large, 1) == 2
    assert plan.sampling(large, 0) == 1
