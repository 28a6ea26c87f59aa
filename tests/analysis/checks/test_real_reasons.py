"""Real ladders, each with the one reason that is right for it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import pytest
from whole import simulated

from vibsim import Experiment, Verdict, verdicts
from vibsim.analysis import analyse_records

PENDULUM: dict[str, Any] = {"model": {"kind": "pendulum"}, "initial": {"theta": 1.0}}
SPRING: dict[str, Any] = {"model": {"kind": "oscillator"}, "initial": {"u": 1.0}}
DOUBLE_PENDULUM: dict[str, Any] = {
    "model": {
        "kind": "system",
        "coordinates": ["a", "b"],
        "mass": {"a": {"a": 2, "b": "cos(a - b)"}, "b": 1},
        "force": {"a": "-2*sin(a)", "b": "-sin(b)"},
    },
    "initial": {"a": 2.5, "b": 2.0},
}
BOX: dict[str, Any] = {
    "model": {"kind": "oscillator", "damping": {"coulomb": 0.06}},
    "initial": {"u": 1.0, "v": 0.25},
    "time": {"end": 16.0},
}


@dataclass(frozen=True)
class Ladder:
    """An experiment with one check, and what its verdict has to be."""

    content: dict[str, Any]
    scheme: Any
    levels: tuple[int, ...]
    check: dict[str, Any]
    verdict: tuple[str, str]
    says: tuple[str, ...]
    """Words that its sentence must have."""


LADDERS = {
    "three_term, before round-off": Ladder(
        {**PENDULUM, "time": {"end": 20.0}, "samples": {"every": 64}},
        {"kind": "central", "arithmetic": "three_term"},
        (10, 11, 12, 13),
        {"converges": "theta", "order": 2},
        ("PASS", "asymptotic"),
        ("order 2.00",),
    ),
    "three_term, from the window before round-off": Ladder(
        {**PENDULUM, "time": {"end": 20.0}, "samples": {"every": 1024}},
        {"kind": "central", "arithmetic": "three_term"},
        tuple(range(10, 17)),
        {"converges": "theta", "order": 2},
        ("PASS", "asymptotic"),
        ("order 2.00", "on levels 10 to 14"),
    ),
    "three_term, nothing but round-off": Ladder(
        {**PENDULUM, "time": {"end": 20.0}, "samples": {"every": 4096}},
        {"kind": "central", "arithmetic": "three_term"},
        (18, 19, 20, 21, 22),
        {"converges": "theta", "order": 2},
        ("INCONCLUSIVE", "round_off"),
        ("round-off",),
    ),
    "round-off of a motion within one well, whose largest change is below its size": Ladder(
        {
            "model": {"kind": "duffing", "alpha": -1, "beta": 1},
            "initial": {"u": 0.3},
            "time": {"end": 40.0, "base_steps": 80},
        },
        "rk4",
        (6, 7, 8),
        {"converges": "u", "order": "scheme"},
        ("INCONCLUSIVE", "round_off"),
        ("round-off",),
    ),
    "damping beyond what a level within the limit bears": Ladder(
        {
            "model": {
                **{"kind": "oscillator", "spring": "1e4*u", "damping": {"linear": 300}},
                "force": "cos(t)",
            },
            "initial": {"u": 1.0},
            "time": {"end": 10.0, "base_steps": 100},
        },
        "rk4",
        (1, 2, 3),
        {"converges": "u", "order": "scheme"},
        ("FAIL", "unstable"),
        ("Level 2 is the first within it.", "Start `levels:` at 4 or finer"),
    ),
    "Euler-Cromer": Ladder(
        {**PENDULUM, "time": {"end": 20.0}},
        "euler_cromer",
        (8, 9, 10, 11, 12),
        {"converges": "theta", "order": 2},
        ("FAIL", "order_low"),
        ("order 1.0",),
    ),
    "first-order start": Ladder(
        {**PENDULUM, "time": {"end": 20.0}},
        {"kind": "central", "start": "first_order"},
        (8, 9, 10, 11, 12),
        {"converges": "theta", "order": 2},
        ("FAIL", "order_low"),
        ("first step", "start: first_order", "The phase is of first order"),
    ),
    "start by a backward difference": Ladder(
        {**PENDULUM, "time": {"end": 20.0}},
        {"kind": "central", "start": "backward"},
        (8, 9, 10, 11, 12),
        {"converges": "theta", "order": 2},
        ("FAIL", "order_low"),
        ("first step", "`start: backward` has twice its dt^2 term"),
    ),
    "one-sided end": Ladder(
        {**PENDULUM, "time": {"end": 20.0}},
        {"kind": "central", "end_velocity": "backward"},
        (8, 9, 10, 11, 12),
        {"converges": "omega", "order": 2, "norm": "linf"},
        ("FAIL", "order_low"),
        ("last point", "end_velocity"),
    ),
    "unstable": Ladder(
        {**SPRING, "time": {"end": 200.0}},
        "central",
        (3, 4, 5, 6),
        {"converges": "u", "order": 2},
        ("FAIL", "unstable"),
        (
            "w dt = 25 is beyond the limit 2",
            "growth factor per period is 5.03885 (predicted) and 5.03885 (measured)",
        ),
    ),
    "friction on the mesh": Ladder(
        BOX,
        {"kind": "rk4", "events": "mesh"},
        (6, 7, 8, 9, 10, 11),
        {"converges": "u", "order": 4},
        ("INCONCLUSIVE", "non_smooth"),
        ("mesh",),
    ),
    "friction with located events": Ladder(
        BOX,
        "rk4",
        (6, 7, 8, 9, 10, 11),
        {"converges": "u", "order": 4},
        ("PASS", "asymptotic"),
        ("order 3.99", "on levels 6 to 11"),
    ),
    "a lower order asked for than the scheme has, in round-off": Ladder(
        {**SPRING, "time": {"end": 10.0, "base_steps": 7}},
        "pefrl",
        (9, 10, 11, 12),
        {"converges": "u", "order": 2},
        ("INCONCLUSIVE", "round_off"),
        ("have reached round-off",),
    ),
    "a swing up to the top, which every error ends on another side": Ladder(
        {
            "model": {"kind": "pendulum"},
            "initial": {"theta": 0.0, "omega": 2.0},
            "time": {"end": 40.0},
        },
        "central",
        (9, 10, 11, 12, 13),
        {"converges": "theta", "order": 2},
        ("INCONCLUSIVE", "round_off"),
        ("theta have parted", "more than 1 % of its size"),
    ),
    "a chaotic motion, longer than double precision reaches": Ladder(
        {**DOUBLE_PENDULUM, "time": {"end": 60.0}},
        "rk4",
        (9, 10, 11, 12),
        {"converges": "a", "order": 4},
        ("INCONCLUSIVE", "pre_asymptotic"),
        ("up to t = 20.7 only, of 60", "none reaches the end, because rounding errors grow alike"),
    ),
    "a chaotic motion, whose end finer levels reach": Ladder(
        {**DOUBLE_PENDULUM, "time": {"end": 30.0}},
        "rk4",
        (9, 10, 11, 12),
        {"converges": "a", "order": 4},
        ("INCONCLUSIVE", "pre_asymptotic"),
        ("up to t = 24.4 only, of 30", "add levels 13 to 15"),
    ),
    "a fall into a centre of attraction, which the motion reaches at pi/sqrt(8)": Ladder(
        {
            "model": {"kind": "oscillator", "spring": "1/u**2", "potential": "-1/u"},
            "initial": {"u": 1.0},
            "time": {"end": 1.2},
        },
        "rk4",
        (5, 6, 7, 8, 9),
        {"converges": "u", "order": 4},
        ("INCONCLUSIVE", "pre_asymptotic"),
        ("up to t = 1.12 only, of 1.2", "as where a force becomes infinite", "check the formulas"),
    ),
    "levels that are too coarse, and errors that grow like a power of the time": Ladder(
        {**PENDULUM, "time": {"end": 200.0}},
        "rk4",
        (7, 8, 9),
        {"converges": "theta", "order": 4},
        ("INCONCLUSIVE", "pre_asymptotic"),
        ("The step is still too coarse",),
    ),
    "a coordinate that stays at 0 but for round-off": Ladder(
        {
            "model": {
                "kind": "system",
                "coordinates": ["x", "y"],
                "acceleration": {"x": "-sin(x)", "y": "-sin(y)"},
            },
            "initial": {"x": 1.0, "y": "cos(pi/2)"},
            "time": {"end": 20.0},
        },
        "rk4",
        (6, 7, 8, 9),
        {"converges": "y", "order": 4},
        ("INCONCLUSIVE", "round_off"),
        ("y is 0 up to round-off",),
    ),
    "three levels whose true errors leave no room for another power": Ladder(
        {"model": {"kind": "spring", "w": 2.0}, "initial": {"u": 1.0}, "time": {"end": 20.0}},
        "rk4",
        (7, 8, 9),
        {"converges": "u", "order": 4},
        ("PASS", "asymptotic"),
        ("order 3.998", "on levels 7 to 9"),
    ),
    "a long run of which the last true errors have the order": Ladder(
        {"model": {"kind": "spring"}, "initial": {"u": 1.0}, "time": {"end": 1000.0}},
        "rk4",
        (10, 11, 12, 13, 14),
        {"converges": "u", "order": 4},
        ("PASS", "asymptotic"),
        ("order 3.99",),
    ),
    "Dt = pi/w": Ladder(
        {**SPRING, "time": {"end": 16 * math.pi}, "samples": {"every": 16}},
        "central",
        (8, 9, 10, 11, 12),
        {"converges": "u", "order": 2},
        ("FAIL", "order_high"),
        ("All common times are turning points of u", "The order is not really higher"),
    ),
}


def judged(ladder: Ladder) -> Verdict:
    made = Experiment.from_dict(
        {
            "title": "t",
            **ladder.content,
            "levels": list(ladder.levels),
            "schemes": [ladder.scheme],
            "checks": [ladder.check],
        }
    )
    (verdict,) = verdicts(made, analyse_records(made, simulated(made)))
    return verdict


FALL = "a fall into a centre of attraction, which the motion reaches at pi/sqrt(8)"
SHOWN = ("first-order start", "unstable", FALL)
"""Of these a sentence tells what only series say."""


@pytest.mark.parametrize("name", LADDERS)
def test_the_reason_is_the_right_one(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if name not in SHOWN:
        monkeypatch.setattr("vibsim.experiment.storage.LEAN", 0)
    verdict = judged(LADDERS[name])
    assert (verdict.status, verdict.reason) == LADDERS[name].verdict, verdict.text
    for words in LADDERS[name].says:
        assert words in f"{verdict.text} {verdict.advice}"
    assert bool(verdict.advice) == (verdict.status != "PASS")
