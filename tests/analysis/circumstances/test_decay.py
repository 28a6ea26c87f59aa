"""A damping that takes velocities away within a step of every level: none sees how, and none may be blamed for it."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from whole import analysed, simulated

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.analysis import analyse_records

pytestmark = pytest.mark.usefixtures("without_series")

STRENGTHS = [1e4, 1e6, 1e8, 1e10, 1e12, 1e16]


def experiment(model: dict[str, Any], initial: dict[str, float], **more: Any) -> Experiment:
    content = {
        "title": "decay",
        "model": {"kind": "oscillator", "spring": "u", **model},
        "initial": initial,
        "time": {"end": 10.0},
        "levels": [6, 7, 8, 9],
        "schemes": ["crank_nicolson", "newmark", "gauss4"],
        "checks": [{"converges": name} for name in ("u", "v", "energy_deviation")],
    }
    return Experiment.from_dict({**content, **more})


def judged(made: Experiment) -> Any:
    return verdicts(made, analyse_records(made, simulated(made)))


def test_levels_that_do_not_see_a_decay_decide_nothing() -> None:
    """From v = 1, which is gone at once."""
    sweep = {"model.damping.linear": STRENGTHS}
    for found in judged(experiment({"damping": {"linear": 1.0}}, {"v": 1.0}, sweep=sweep)):
        assert {(one.status, one.reason) for one in found.results} <= {
            ("INCONCLUSIVE", reason) for reason in ("pre_asymptotic", "oscillating", "round_off")
        }


def test_a_decay_that_begins_later_is_none_of_the_scheme() -> None:
    """From rest, u'^2 = u/b soon holds, and the way there is gone within a step."""
    model = {"damping": {"quadratic": 1e4}}
    short = {"time": {"end": 2.5}, "levels": [4, 5, 6, 7]}
    made = experiment(model, {"u": 1.0}, schemes=["crank_nicolson", "newmark"], **short)
    assert judged(made)[0].reason == "pre_asymptotic"


@pytest.mark.parametrize("strength", [1e8, 1e10])
@pytest.mark.parametrize("scheme", ["crank_nicolson", "newmark"])
def test_the_decay_is_named(scheme: str, strength: float) -> None:
    made = experiment({"damping": {"linear": strength}}, {"v": 1.0}, schemes=[scheme])
    found = judged(made)[-1]
    assert (found.status, found.reason) == ("INCONCLUSIVE", "pre_asymptotic")
    assert f"The damping makes a velocity decay at a rate of up to {strength:.2g}" in found.text
    assert "will not help" not in found.advice


@pytest.mark.slow
def test_the_level_that_is_advised_sees_the_decay() -> None:
    made = experiment({"damping": {"linear": 500.0}}, {"v": 1.0}, schemes=["crank_nicolson"])
    coarse = judged(made)[0]
    assert coarse.reason == "pre_asymptotic"
    first = re.search(r"from level (\d+) on", coarse.advice)
    assert first is not None, coarse.advice
    levels = [int(first[1]) + i for i in range(4)]
    fine = experiment(
        {"damping": {"linear": 500.0}}, {"v": 1.0}, schemes=["crank_nicolson"], levels=levels
    )
    assert [found.status for found in judged(fine)] == ["PASS"] * 3


def test_a_velocity_that_never_begins_to_decay_passes() -> None:
    """From rest the motion creeps: long steps of Backward Euler see all there is."""
    made = experiment({"damping": {"linear": 1e3}}, {"u": 1.0}, schemes=["backward_euler"])
    assert judged(made)[0].status == "PASS"


def test_a_wrong_solution_with_a_decay_that_levels_see_stays_one() -> None:
    right = experiment({"damping": {"linear": 4.0}}, {"v": 1.0}, schemes=["crank_nicolson"])
    wrong = experiment({"damping": {"linear": 4.1}}, {"v": 1.0}, schemes=["crank_nicolson"])
    levels = []
    for level in right.levels:
        data = simulate(right, level)
        other = simulate(wrong, level)
        levels.append(data.assign(u=other["u"], v=other["v"]))
    found = verdicts(right, analyse(right, levels))[0]
    assert (found.status, found.reason) == ("FAIL", "wrong_limit")


def test_the_rate_is_that_along_the_motion() -> None:
    """Quadratic damping b abs(v) v takes a velocity away at the rate 2 b abs(v), most at the start."""
    made = experiment({"damping": {"quadratic": 3.0}}, {"v": 2.0})
    record = analysed(made)
    np.testing.assert_allclose(record["decay_rate"], 12.0, rtol=1e-12)
    made = experiment({}, {"v": 2.0})
    assert "decay_rate" not in analysed(made)
