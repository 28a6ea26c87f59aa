"""Every reason of a verdict, provoked once by a real ladder, and every kind of check, passed and failed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from vibsim import simulate

from .door import REASONS, Content, build, judged, outcome

PENDULUM: Content = {"model": {"kind": "pendulum"}, "initial": {"theta": 1.0}}
SPRING: Content = {"model": {"kind": "spring"}, "initial": {"u": 1.0}, "time": {"end": 10.0}}


def ladder(base: Content, levels: list[int], scheme: Any, **check: Any) -> Content:
    return {**base, "levels": levels, "schemes": [scheme], "checks": [check]}


LADDERS: dict[tuple[str, str], Content] = {
    ("PASS", "asymptotic"): ladder(
        {**PENDULUM, "time": {"end": 20.0}},
        [6, 7, 8, 9],
        "central",
        converges="theta",
        order=2,
    ),
    # the trapezoidal rule conserves every quadratic
    ("PASS", "exact"): ladder(
        SPRING, [6, 7, 8], "crank_nicolson", converges="energy_deviation", order="scheme"
    ),
    # cos(10)
    ("PASS", "match"): ladder(
        SPRING, [8, 9], "rk4", value="end", quantity="u", equals=math.cos(10.0), atol=1e-7
    ),
    ("FAIL", "order_low"): ladder(
        {**PENDULUM, "time": {"end": 20.0}},
        [8, 9, 10, 11],
        {"kind": "central", "start": "first_order"},
        converges="theta",
        order=2,
    ),
    ("FAIL", "order_high"): ladder(
        {**PENDULUM, "time": {"end": 20.0}}, [7, 8, 9, 10], "rk4", converges="theta", order=2
    ),
    ("FAIL", "mismatch"): ladder(
        SPRING, [8, 9], "rk4", value="end", quantity="u", equals=-math.cos(10.0), atol=1e-7
    ),
    # w dt = 200/8 at the coarsest level and 200/64 at the finest: all beyond 2
    ("FAIL", "unstable"): ladder(
        {**SPRING, "time": {"end": 200.0}}, [3, 4, 5, 6], "central", converges="u", order=2
    ),
    # u'' = u + u^3 from rest at 1 escapes before t = 2
    ("FAIL", "non_finite"): ladder(
        {**SPRING, "model": {"kind": "duffing", "alpha": -1.0, "beta": -1.0}},
        [5, 6, 7],
        "rk4",
        converges="u",
        order=4,
    ),
    ("INCONCLUSIVE", "pre_asymptotic"): ladder(
        {**PENDULUM, "time": {"end": 20.0}}, [4, 5, 6], "rk4", converges="theta", order=4
    ),
    ("INCONCLUSIVE", "round_off"): ladder(
        {**SPRING, "time": {"end": 10.0, "base_steps": 7}},
        [9, 10, 11, 12],
        "pefrl",
        converges="u",
        order=2,
    ),
    ("INCONCLUSIVE", "non_smooth"): ladder(
        {
            "model": {"kind": "oscillator", "damping": {"coulomb": 0.06}},
            "initial": {"u": 1.0, "v": 0.25},
            "time": {"end": 16.0},
        },
        [6, 7, 8, 9],
        {"kind": "rk4", "events": "mesh"},
        converges="u",
        order=4,
    ),
    ("INCONCLUSIVE", "too_few_levels"): ladder(
        SPRING, [6, 7], "central", converges="u", order="scheme"
    ),
    # a pendulum at rest hangs still
    ("INCONCLUSIVE", "not_applicable"): ladder(
        {**PENDULUM, "initial": {"theta": 0.0}, "time": {"end": 10.0}},
        [5, 6, 7],
        "central",
        converges="theta",
        order=2,
    ),
}
MADE_IN_MEMORY = {("FAIL", "wrong_limit"), ("INCONCLUSIVE", "oscillating")}


def test_every_reason_is_provoked_here() -> None:
    assert set(LADDERS) | MADE_IN_MEMORY == {
        (status, reason) for status, reasons in REASONS.items() for reason in reasons
    }


@pytest.mark.parametrize("wanted", LADDERS, ids=lambda wanted: wanted[1])
def test_a_real_ladder_has_its_reason(wanted: tuple[str, str]) -> None:
    found = outcome(LADDERS[wanted])
    assert found.reasons() == [wanted]
    (verdict,) = found.verdicts
    assert verdict.id == "check_1"
    assert verdict.text
    assert bool(verdict.advice) == (wanted[0] != "PASS")


def test_levels_of_another_problem_go_to_a_wrong_limit() -> None:
    """The states are those of a spring that is six parts in a thousand too stiff."""
    content = {**SPRING, "levels": [6, 7, 8, 9], "schemes": ["central"]}
    content["checks"] = [{"converges": "u", "order": 2}]
    right, wrong = (build({**content, "model": {"kind": "spring", "w": w}}) for w in (1.7, 1.71))
    levels = {}
    for level in right.levels:
        levels[level], other = simulate(right, level).copy(deep=True), simulate(wrong, level)
        for name in ("u", "v"):
            levels[level][name].values[:] = other[name].values
    assert judged(right, levels).reasons() == [("FAIL", "wrong_limit")]


def test_errors_that_change_their_sign_from_level_to_level_oscillate() -> None:
    content = {**SPRING, "levels": [6, 7, 8, 9], "schemes": ["central"]}
    right = build({**content, "checks": [{"converges": "u", "order": 2}]})
    levels = {}
    for level in right.levels:
        levels[level] = simulate(right, level).copy(deep=True)
        t = levels[level]["t"].values
        error = (-1) ** level * 40.0 * 4.0**-level * np.sin(t)
        levels[level]["u"].values[:] = np.cos(t) + error
    assert judged(right, levels).reasons() == [("INCONCLUSIVE", "oscillating")]


# -- kinds of check --------------------------------------------------------------------------------------------------

CHECKS: list[tuple[Content, str, str]] = [
    ({"converges": "u", "order": "scheme", "schemes": ["central"]}, "PASS", "asymptotic"),
    ({"converges": "u", "order": 2, "norm": "l1", "schemes": ["central"]}, "PASS", "asymptotic"),
    ({"converges": "u", "order": 2, "norm": "linf", "schemes": ["central"]}, "PASS", "asymptotic"),
    (
        {"converges": "u", "order": 2, "norm": "linf_interior", "schemes": ["central"]},
        "PASS",
        "asymptotic",
    ),
    ({"converges": "u", "order": 3, "schemes": ["central"]}, "FAIL", "order_low"),
    (
        {"converges": "u", "order": 2.05, "tolerance": 0.2, "schemes": ["central"]},
        "PASS",
        "asymptotic",
    ),
    (
        {"value": "end", "quantity": "u", "at": {"level": 9}, "above": -2, "id": "n"},
        "PASS",
        "match",
    ),
    ({"value": "end", "quantity": "u", "below": -2}, "FAIL", "mismatch"),
    (
        {
            "value": "at",
            "quantity": "u",
            "at": {"t": 25.0, "level": 9, "scheme": "rk4"},
            "equals": math.cos(25.0),
            "rtol": 1e-5,
        },
        "PASS",
        "match",
    ),
    (
        {"value": "at", "quantity": "u", "at": {"step": 0, "scheme": "rk4"}, "equals": 1},
        "PASS",
        "match",
    ),
    (
        {
            "value": "end",
            "quantity": "u",
            "at": {"level": "best", "scheme": "rk4"},
            "equals": math.cos(50.0),
            "atol": 1e-5,
        },
        "PASS",
        "match",
    ),
    ({"accurate": "u", "relative": 0.1, "schemes": ["central", "rk4"]}, "PASS", "match"),
    ({"accurate": "v", "absolute": 1.0, "schemes": ["rk4"]}, "PASS", "match"),
    ({"accurate": "u", "relative": 1e-9, "schemes": ["rk4"]}, "FAIL", "mismatch"),
    (
        {
            "accurate": "u",
            "relative": 1e-9,
            "schemes": ["rk4"],
            "expect": {"status": "FAIL", "reason": "mismatch"},
        },
        "PASS",
        "match",
    ),
    ({"stable": True, "schemes": ["central", "rk4"]}, "PASS", "match"),
    ({"stable": False, "schemes": ["central"]}, "FAIL", "mismatch"),
    ({"stable": True, "schemes": ["forward_euler"]}, "PASS", "match"),
    ({"conserves": "energy", "drift": "bounded", "schemes": ["central"]}, "PASS", "match"),
    ({"conserves": "energy", "drift": "linear", "schemes": ["rk4"]}, "PASS", "match"),
    ({"conserves": "energy", "drift": "none", "schemes": ["crank_nicolson"]}, "PASS", "match"),
    ({"conserves": "energy", "schemes": ["central"]}, "FAIL", "mismatch"),
    ({"conserves": "energy", "drift": "quadratic", "schemes": ["rk4"]}, "FAIL", "mismatch"),
    ({"equal": ["central", "exact"], "quantity": "u", "atol": 0.1}, "PASS", "match"),
    ({"equal": ["central", "discrete"], "quantity": "u"}, "PASS", "match"),
    ({"equal": ["central", "rk4"], "quantity": "u", "atol": 1e-6}, "FAIL", "mismatch"),
    (
        {"claim": "c", "source": "s", "that": {"value": "max", "quantity": "u", "below": 5}},
        "PASS",
        "match",
    ),
    (
        {"claim": "c", "that": {"value": "max", "quantity": "u", "below": 5}, "holds": False},
        "FAIL",
        "mismatch",
    ),
    (
        {
            "claim": "c",
            "note": "n",
            "that": {"converges": "u", "order": 3, "schemes": ["central"]},
            "holds": False,
        },
        "PASS",
        "match",
    ),
    (
        {
            "converges": "u",
            "order": 3,
            "schemes": ["central"],
            "expect": {"status": "FAIL", "reason": "order_low"},
        },
        "PASS",
        "match",
    ),
    (
        {
            "converges": "u",
            "order": 2,
            "schemes": ["central"],
            "expect": {"status": "FAIL", "reason": "order_low"},
        },
        "FAIL",
        "mismatch",
    ),
]


def test_every_kind_of_check_passes_and_fails() -> None:
    """In one experiment; verdicts come in the order of the file, and are named by `id` or by their number."""
    content: Content = {
        "model": {"kind": "spring"},
        "initial": {"u": 1.0},
        "time": {"end": 50.0},
        "levels": [8, 9, 10],
        "schemes": ["central", "rk4", "crank_nicolson", "forward_euler"],
        "checks": [check for check, _, _ in CHECKS],
    }
    found = outcome(content)
    names = [check.get("id", f"check_{i}") for i, (check, _, _) in enumerate(CHECKS, start=1)]
    assert [verdict.id for verdict in found.verdicts] == names
    told = [
        (check, verdict.status, verdict.reason)
        for (check, _, _), verdict in zip(CHECKS, found.verdicts, strict=True)
    ]
    assert told == CHECKS


def test_a_claim_that_cannot_be_decided_is_inconclusive_whatever_it_holds() -> None:
    that = {"converges": "u", "order": 2}
    content = {**SPRING, "levels": [6, 7], "schemes": ["central"]}
    content["checks"] = [{"claim": "c", "that": that, "holds": holds} for holds in (True, False)]
    assert outcome(content).reasons() == [("INCONCLUSIVE", "too_few_levels")] * 2


def test_without_checks_the_position_must_converge_as_promised() -> None:
    found = outcome({**SPRING, "levels": [6, 7, 8], "schemes": ["central"]})
    assert [verdict.kind for verdict in found.verdicts] == ["converges"]
    assert found.verdicts[0].quantity == "u"
    assert found.reasons() == [("PASS", "asymptotic")]


def test_a_check_of_no_schemes_leaves_adaptive_ones_out() -> None:
    content = {**SPRING, "levels": [6, 7, 8], "schemes": ["central", "dop853"]}
    content["checks"] = [
        {"converges": "u", "order": 2},
        {"converges": "u", "order": 2, "schemes": ["dop853"]},
    ]
    found = outcome(content)
    assert [result.scheme for result in found.verdicts[0].results] == ["central"]
    assert found.reasons()[1] == ("INCONCLUSIVE", "not_applicable")


def test_fail_comes_before_inconclusive_before_pass_among_the_results_of_a_check() -> None:
    """Schemes of order 1, 2 and 4 at levels that cannot tell the last one."""
    content = {
        **PENDULUM,
        "time": {"end": 20.0},
        "levels": [6, 7, 8],
        "schemes": ["central", "rk4", {"kind": "central", "label": "low", "start": "first_order"}],
    }
    single = {"converges": "theta", "order": 2, "tolerance": 0.3}
    content["checks"] = [
        {**single, "schemes": names}
        for names in (["central"], ["rk4"], ["low"], ["central", "rk4"], ["central", "rk4", "low"])
    ]
    found = outcome(content)
    (good, _), (open_, _), (bad, _), *joined = found.reasons()
    rank = {"PASS": 0, "INCONCLUSIVE": 1, "FAIL": 2}
    assert good == "PASS"
    assert len({good, open_, bad}) > 1
    worst = [max(one, key=rank.__getitem__) for one in ([good, open_], [good, open_, bad])]
    assert [status for status, _ in joined] == worst


PUBLISHED = {
    "model": {"kind": "spring", "w": 2 * math.pi},
    "initial": {"u": 1},
    "time": {"end": 10, "base_dt": 0.1},
    "levels": [1, 2],
    "schemes": ["forward_euler", "crank_nicolson"],
    "published": [
        {
            "title": "relative error of the energy",
            "source": "vibration text, section 6.2",
            "value": "relative_energy_error_d2t",
            "beside": ["relative_energy_error"],
            "rows": [
                {"scheme": "forward_euler", "level": 1, "printed": "1.120e8"},
                {"scheme": "crank_nicolson", "level": 2, "printed": "1.221e-2", "holds": False},
            ],
        }
    ],
}


def test_rows_of_published_tables_are_claims() -> None:
    found = outcome(PUBLISHED)
    assert [verdict.id for verdict in found.verdicts] == ["published_1_1", "published_1_2"]
    assert found.reasons() == [("PASS", "match")] * 2
