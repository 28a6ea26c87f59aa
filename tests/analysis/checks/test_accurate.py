"""The check ``accurate``: the error of the finest level, its bound, and what is decided by them."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
import xarray
from thinned import thinned

from vibsim import Experiment, Verdict, analyse, simulate, verdicts
from vibsim.analysis.blockwise import keep_for_verdicts
from vibsim.core.record import Record

Content = dict[str, Any]

SPRING: Content = {
    "title": "test",
    "model": {"kind": "spring"},
    "initial": {"u": 1.0},
    "time": {"end": 10.0},
    "levels": [6, 7, 8, 9],
    "schemes": ["central"],
}
PENDULUM: Content = {
    **SPRING,
    "model": {"kind": "pendulum"},
    "initial": {"theta": 1.0},
    "time": {"end": 20.0},
}


def levels_of(content: Content, *, with_exact: bool = True) -> dict[int, xarray.Dataset]:
    """Return the levels, perhaps without the exact solution."""
    experiment = Experiment.from_dict(content)
    found = {level: simulate(experiment, level) for level in experiment.levels}
    return found if with_exact else without_exact(found)


def without_exact(levels: dict[int, xarray.Dataset]) -> dict[int, xarray.Dataset]:
    """Drop the exact solution; without series there is none to drop, and the analysis computes it."""
    assert all(data.attrs["storage"] == "series" for data in levels.values())
    return {
        level: data.drop_vars([str(name) for name in data if "_exact" in str(name)])
        for level, data in levels.items()
    }


def judged(content: Content, levels: dict[int, xarray.Dataset] | None = None) -> list[Verdict]:
    experiment = Experiment.from_dict(content)
    levels = levels_of(content) if levels is None else levels
    return verdicts(experiment, analyse(experiment, list(levels.values())))


def asked(content: Content, *checks: Content, with_exact: bool = True) -> list[Verdict]:
    content = {**content, "checks": list(checks)}
    return judged(content, levels_of(content, with_exact=with_exact))


def facts(verdict: Verdict) -> Any:
    return verdict.results[0].facts


def l2(values: Any, spacing: float) -> float:
    return float(np.sqrt(spacing * np.sum(np.square(values))))


# -- the error ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_known_error_is_the_true_one() -> None:
    """The closed solution of centred differences is cos(w~ t), w~ dt/2 = asin(w dt/2), at common times 10/64 apart."""
    (found,) = asked(SPRING, {"accurate": "u", "relative": 1e-3})
    dt, t = 10.0 / 2**9, np.linspace(0.0, 10.0, 65)
    error = l2(np.cos(2.0 / dt * math.asin(dt / 2.0) * t) - np.cos(t), 10.0 / 64)
    size = l2(np.cos(t), 10.0 / 64)
    assert facts(found)["error"] == pytest.approx(error, rel=1e-9)
    assert facts(found)["relative_error"] == pytest.approx(error / size, rel=1e-9)
    assert error < facts(found)["error_bound"] < error * (1.0 + 1e-6)
    assert (facts(found)["basis"], facts(found)["level"]) == ("exact", 9)
    assert found.results[0].value == facts(found)["error"]
    assert (found.status, found.reason, found.advice) == ("PASS", "match", "")
    assert found.text.startswith(f"u is accurate to {error / size:.2g} of its size at level 9")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "levels"),
    [(SPRING, [8, 9, 10]), (PENDULUM, [7, 8, 9, 10])],
    ids=["spring", "pendulum"],
)
def test_an_estimated_error_is_the_true_one_within_its_bound(
    content: Content, levels: list[int]
) -> None:
    """The pendulum is compared with its exact solution, which is known to twelve digits and then left out."""
    quantity = next(iter(content["initial"]))
    schemes = ["central", "rk4", "forward_euler", "euler_cromer"]
    check = {"accurate": quantity, "relative": 10.0}
    content = {**content, "schemes": schemes, "levels": levels, "checks": [check]}
    known = levels_of(content)
    true, estimated = (
        {row.scheme: row.facts for row in judged(content, data)[0].results}
        for data in (known, without_exact(known))
    )
    assert sorted(estimated) == sorted(schemes)
    for scheme, told in estimated.items():
        error = true[scheme]["error"]
        assert told["basis"] == "extrapolated", scheme
        away = told["error_bound"] - told["error"]
        assert abs(error - told["error"]) <= away, scheme
        assert told["error"] == pytest.approx(error, rel=0.3), scheme


@pytest.mark.slow
def test_a_jump_of_the_force_beside_a_point_of_all_levels_is_part_of_the_bound() -> None:
    """Levels that meet it too early by the same agree on another motion; the true error is that from the reference."""
    content = {
        **SPRING,
        "model": {"kind": "oscillator", "force": "2*heaviside(t - 1.2501)"},
        "levels": [5, 6, 7, 8],
        "schemes": ["gauss4", "rk4", "euler_cromer"],
        "checks": [{"accurate": "u", "relative": 1e-5}],
    }
    known = levels_of(content)
    true, estimated = (
        {row.scheme: row for row in judged(content, data)[0].results}
        for data in (known, without_exact(known))
    )
    for scheme, told in estimated.items():
        assert true[scheme].facts["error"] <= told.facts["error_bound"], scheme
        assert told.status == "INCONCLUSIVE" or told.status == true[scheme].status, scheme
    assert estimated["gauss4"].facts["error"] < 0.1 * true["gauss4"].facts["error"]


def test_an_absolute_accuracy_is_told_as_a_root_mean_square_beside() -> None:
    (found,) = asked(PENDULUM, {"accurate": "theta", "absolute": 1.0})
    assert found.status == "PASS"
    error = facts(found)["error"]
    assert f"theta is accurate to {error:.2g} at level 9" in found.text
    mean = error / math.sqrt(20.0)
    told = f"These are L2 norms over time. The root-mean-square error is {mean:.2g} rad."
    assert told in found.text


@pytest.mark.parametrize("kind", thinned(["relative", "absolute"], 2))
@pytest.mark.parametrize("factor", [0.9999, 1.0001])
def test_numbers_beside_what_is_asked_have_the_digits_that_tell_them_apart(
    kind: str, factor: float
) -> None:
    (plain,) = asked(PENDULUM, {"accurate": "theta", kind: 1.0})
    error = facts(plain)["relative_error" if kind == "relative" else "error"]
    limit = float(f"{factor * error:.6g}")
    tenth = {"accurate": "theta", kind: 0.1 * limit}
    found, far = asked(PENDULUM, {"accurate": "theta", kind: limit}, tenth)
    # a factor of 10 is two levels of second order
    assert facts(far)["level_needed"] == 11
    assert found.status == ("PASS" if factor > 1.0 else "FAIL")
    before = "accurate to|at most" if factor > 1.0 else r"level 9 is|at least"
    told = [float(number) for number in re.findall(rf"(?:{before}) ([0-9.e-]+[0-9])", found.text)]
    assert told
    assert all(number < limit if factor > 1.0 else number > limit for number in told)


# -- every verdict -----------------------------------------------------------------------------------------------------

SMALL, TINY = {"accurate": "theta", "relative": 0.1}, {"accurate": "theta", "relative": 1e-9}


@pytest.mark.slow
@pytest.mark.parametrize("with_exact", thinned([True, False], 2))
def test_a_small_error_passes_and_a_large_one_fails_with_the_level_that_reaches_it(
    with_exact: bool,
) -> None:
    error = facts(asked(PENDULUM, SMALL)[0])["relative_error"]
    a_little = {"accurate": "theta", "relative": error / 10.0}
    passed, a_little_less, failed = asked(PENDULUM, SMALL, a_little, TINY, with_exact=with_exact)
    assert (passed.status, passed.reason) == ("PASS", "match")
    assert [(v.status, v.reason) for v in (a_little_less, failed)] == [("FAIL", "mismatch")] * 2
    # a factor of 10 is two levels of second order
    assert facts(a_little_less)["level_needed"] == 11
    assert "Add levels 10 and 11" in a_little_less.advice
    assert "which is probably enough by the measured order, or change `rel" in a_little_less.advice
    more = {**PENDULUM, "levels": [6, 7, 8, 9, 10, 11]}
    assert [v.status for v in asked(more, a_little, with_exact=with_exact)] == ["PASS"]


@pytest.mark.slow
def test_what_lies_between_the_bounds_is_open() -> None:
    (found,) = asked(PENDULUM, SMALL, with_exact=False)
    told = facts(found)
    between = {"accurate": "theta", "relative": told["relative_error"]}
    (found,) = asked(PENDULUM, between, with_exact=False)
    assert (found.status, found.reason) == ("INCONCLUSIVE", "pre_asymptotic")
    assert "between" in found.text
    assert "Add level 10" in found.advice


@pytest.mark.slow
def test_an_error_that_may_be_round_off_is_open_where_it_is_known() -> None:
    """Of a solution that is exact but for round-off no accuracy far below round-off is known."""
    content = {**SPRING, "schemes": ["crank_nicolson"]}
    check = {"accurate": "energy_deviation", "absolute": 1e-18}
    (found,) = asked(content, check)
    assert (found.status, found.reason) == ("INCONCLUSIVE", "round_off")
    assert "compensated" in found.advice


@pytest.mark.parametrize(
    ("reason", "content", "quantity"),
    thinned(
        [
            ("too_few_levels", {**PENDULUM, "levels": [8, 9]}, "theta"),
            ("pre_asymptotic", {**PENDULUM, "levels": [4, 5, 6], "schemes": ["rk4"]}, "theta"),
            (
                "round_off",
                {
                    **SPRING,
                    "time": {"end": 10.0, "base_steps": 7},
                    "levels": [9, 10, 11, 12],
                    "schemes": ["pefrl"],
                },
                "u",
            ),
            (
                "non_smooth",
                {
                    **SPRING,
                    "model": {"kind": "oscillator", "damping": {"coulomb": 0.06}},
                    "initial": {"u": 1.0, "v": 0.25},
                    "time": {"end": 16.0},
                    "schemes": [{"kind": "rk4", "events": "mesh"}],
                },
                "u",
            ),
        ],
        2,
    ),
)
def test_an_estimate_without_an_order_decides_nothing(
    reason: str, content: Content, quantity: str
) -> None:
    """However much or little is asked. The true error, where it is known, does not need the order."""
    checks = [{"accurate": quantity, "relative": asked} for asked in (10.0, 1e-14)]
    content = {**content, "checks": checks}
    levels = levels_of(content)
    for found in judged(content, without_exact(levels)):
        assert (found.status, found.reason) == ("INCONCLUSIVE", reason)
        assert "cannot be trusted" in found.text
        assert f"converges: {quantity}" in found.advice
    if reason != "non_smooth":
        much, little = judged(content, levels)
        assert (much.status, little.status == "PASS") == ("PASS", False)


def test_levels_that_oscillate_decide_nothing() -> None:
    content = {**SPRING, "checks": [{"accurate": "u", "relative": 10.0}]}
    levels = levels_of(content, with_exact=False)
    for level, data in levels.items():
        t = data["t"].values
        data["u"].values[:] = np.cos(t) + (-1) ** level * 40.0 * 4.0**-level * np.sin(t)
    (found,) = judged(content, levels)
    assert (found.status, found.reason) == ("INCONCLUSIVE", "oscillating")


def test_what_is_unstable_or_not_finite_fails() -> None:
    far = {**SPRING, "time": {"end": 200.0}, "levels": [3, 4, 5, 6]}
    (found,) = asked(far, {"accurate": "u", "relative": 10.0})
    assert (found.status, found.reason) == ("FAIL", "unstable")
    escaping = {**SPRING, "model": {"kind": "duffing", "alpha": -1.0, "beta": -1.0}}
    escaping |= {"levels": [5, 6, 7], "schemes": ["rk4"]}
    (found,) = asked(escaping, {"accurate": "u", "relative": 10.0})
    assert (found.status, found.reason) == ("FAIL", "non_finite")


@pytest.mark.slow
def test_where_there_is_no_error_nothing_is_judged() -> None:
    still = {**PENDULUM, "initial": {"theta": 0.0}}
    (found,) = asked(still, {"accurate": "theta", "absolute": 1.0})
    assert (found.status, found.reason) == ("INCONCLUSIVE", "not_applicable")
    (found,) = asked(SPRING, {"accurate": "energy_deviation", "relative": 0.1})
    assert (found.status, found.reason) == ("INCONCLUSIVE", "not_applicable")
    assert "absolute:" in found.advice
    (found,) = asked(SPRING, {"accurate": "energy_deviation", "absolute": 0.1})
    assert found.status == "PASS"


def test_a_scheme_that_chooses_its_own_steps_has_a_true_error_and_no_estimate() -> None:
    content = {**PENDULUM, "schemes": ["central", {"kind": "dop853", "label": "own"}]}
    check = {"accurate": "theta", "relative": 1e-3, "schemes": ["own"]}
    (found,) = asked(content, check)
    assert (found.status, found.reason) == ("PASS", "match")
    (found,) = asked(content, check, with_exact=False)
    assert (found.status, found.reason) == ("INCONCLUSIVE", "not_applicable")


def test_a_step_that_is_broken_on_purpose_is_not_accurate() -> None:
    """The states are those of a spring that is six parts in a thousand too stiff: its levels converge all the same."""
    content = {**SPRING, "checks": [{"accurate": "u", "relative": 1e-3}, {"converges": "u"}]}
    stiffer = levels_of({**content, "model": {"kind": "spring", "w": 1.006}})
    levels = levels_of(content)
    for level, data in levels.items():
        for name in ("u", "v"):
            data[name].values[:] = stiffer[level][name].values
    accurate, converges = judged(content, levels)
    assert (accurate.status, accurate.reason) == ("FAIL", "mismatch")
    assert converges.reason == "wrong_limit"
    assert "Finer levels will not help" in accurate.advice
    assert "check the code of scheme central" in accurate.advice


@pytest.mark.slow
def test_a_start_of_first_order_is_less_accurate_than_the_estimate_of_a_right_one() -> None:
    trap = {
        **PENDULUM,
        "schemes": ["central", {"kind": "central", "label": "trap", "start": "first_order"}],
    }
    trap |= {"levels": [8, 9, 10, 11]}
    true = asked(trap, {"accurate": "theta", "relative": 1e-3, "schemes": ["trap"]})[0]
    right, low = (
        asked(trap, {"accurate": "theta", "relative": 1e-3, "schemes": [name]}, with_exact=False)[0]
        for name in ("central", "trap")
    )
    assert (right.status, low.status) == ("PASS", "FAIL")
    assert facts(low)["order_reason"] == "order_low"
    assert facts(low)["error"] == pytest.approx(facts(true)["error"], rel=0.05)
    assert facts(true)["error"] < facts(low)["error_bound"]


# -- beside the verdict on an order ------------------------------------------------------------------------------------


@pytest.mark.parametrize("with_exact", [True, False])
def test_a_verdict_on_an_order_states_the_same_error(with_exact: bool) -> None:
    checks = ({"converges": "theta"}, {"converges": "theta", "norm": "linf", "order": 3}, SMALL)
    passed, failed, accurate = asked(PENDULUM, *checks, with_exact=with_exact)
    names = ("error", "error_bound", "relative_error")
    for found in (passed, failed):
        assert [facts(found)[name] for name in names] == [facts(accurate)[name] for name in names]
        assert (facts(found)["best"], facts(found)["best_bound"]) == (None, None)
        assert found.results[0].value is None
    told = facts(accurate)
    mean = told["error"] / math.sqrt(20.0)
    size = f"{mean:.2g} rad ({told['relative_error']:.2g} of its size)"
    for found in (passed, failed):
        assert f"The root-mean-square error of the finest level is {size}." in found.text


@pytest.mark.slow
def test_a_bound_with_other_digits_is_stated() -> None:
    content = {**PENDULUM, "schemes": ["forward_euler"], "levels": [12, 13, 14]}
    (found,) = asked(content, {"converges": "theta"}, with_exact=False)
    told = facts(found)
    assert found.status == "PASS"
    assert f"of its size), at most {told['error_bound'] / math.sqrt(20.0):.2g}." in found.text


def test_an_error_is_stated_where_it_is_believed_alone() -> None:
    coarse = {**PENDULUM, "levels": [4, 5, 6], "schemes": ["rk4"]}
    for with_exact in (True, False):
        (found,) = asked(coarse, {"converges": "theta"}, with_exact=with_exact)
        assert found.reason == "pre_asymptotic"
        assert "error of the finest level" not in found.text
        assert (facts(found)["error"] is not None) == with_exact
    far = {**SPRING, "time": {"end": 200.0}, "levels": [3, 4, 5, 6]}
    (found,) = asked(far, {"converges": "u"})
    assert (found.reason, facts(found)["error"]) == ("unstable", None)


def test_an_error_has_variables_of_its_own() -> None:
    experiment = Experiment.from_dict({**SPRING, "checks": [{"id": "own", "converges": "u"}]})
    levels = [simulate(experiment, level) for level in experiment.levels]
    data = analyse(experiment, levels)
    (found,) = verdicts(experiment, data)
    for name in ("error", "error_bound", "relative_error"):
        variable = data[f"check_own_{name}"]
        assert variable.dims == ("scheme", "case")
        assert float(variable[0, 0]) == facts(found)[name]


# -- beside other checks -----------------------------------------------------------------------------------------------


def test_expectations_and_claims() -> None:
    trap = TINY | {"expect": {"status": "FAIL"}}
    wrong = SMALL | {"expect": {"status": "FAIL", "reason": "mismatch"}}
    refuted = {"claim": "nine digits are right", "that": TINY, "holds": False}
    detected, undetected, claim = asked(PENDULUM, trap, wrong, refuted)
    assert (detected.status, detected.reason) == ("PASS", "match")
    assert "The check detected FAIL, as intended." in detected.text
    assert (undetected.status, undetected.reason) == ("FAIL", "mismatch")
    assert (claim.status, claim.reason) == ("PASS", "match")
    assert asked(PENDULUM, SMALL)[0].expected == "accurate to 0.1 of its size"


@pytest.mark.parametrize("samples", thinned(["auto", {"every": 2}], 2))
def test_the_worst_member_of_a_sweep_decides(samples: Any) -> None:
    """It is the fastest spring, whose error is the largest."""
    content = {
        **SPRING,
        "samples": samples,
        "sweep": {"model.w": {"linspace": [0.5, 2.0, 7]}},
        "schemes": ["central", "rk4"],
    }
    (found,) = asked(content, {"accurate": "u", "relative": 1e-4})
    assert (found.status, len(found.results)) == ("FAIL", 14)
    assert (found.results[0].scheme, found.results[0].case) == ("central", 6)
    errors = [r.facts["relative_error"] for r in found.results if r.scheme == "central"]
    assert errors == sorted(errors, reverse=True)


@pytest.mark.slow
def test_a_member_alone_and_in_a_sweep_has_the_same_error() -> None:
    check = {"accurate": "u", "relative": 2e-3}
    sweep = {**SPRING, "sweep": {"model.w": [0.5, 1.0, 2.0]}}
    for with_exact in (True, False):
        (alone,) = asked(SPRING, check, with_exact=with_exact)
        (among,) = asked(sweep, check, with_exact=with_exact)
        assert facts(alone) == next(r.facts for r in among.results if r.case == 1)


FRICTION: Content = {
    **SPRING,
    "model": {"kind": "sliding_box", "alpha": 0.5, "mu": 0.1},
    "initial": {"u": 2.0},
    "sweep": {"model.mu": [0.05, 0.1, 0.15]},
    "levels": [7, 8, 9, 10],
}


@pytest.mark.slow
@pytest.mark.parametrize("content", [FRICTION, {**SPRING, "sweep": {"model.w": [0.5, 1.0, 2.0]}}])
def test_a_large_sweep_says_the_same_as_a_small_one(
    monkeypatch: pytest.MonkeyPatch, content: Content
) -> None:
    """Where no series are kept, and of what is kept of a range of members alone. Of friction nothing is known."""
    checks = [
        {"accurate": "u", "relative": 1e-3},
        {"accurate": "v", "absolute": 1e-6},
        {"converges": "u"},
    ]
    content = {**content, "samples": "common", "schemes": ["central", "rk2"], "checks": checks}
    whole = judged(content)
    basis = "extrapolated" if content["model"]["kind"] == "sliding_box" else "exact"
    assert {row.facts["basis"] for row in whole[0].results} == {basis}
    monkeypatch.setattr("vibsim.experiment.storage.LEAN", 0)
    experiment = Experiment.from_dict(content)
    lean = analyse(experiment, list(levels_of(content).values()))
    assert lean.attrs["storage"] == "lean"
    thin: list[Record] = []
    list(keep_for_verdicts(experiment, [Record.from_xarray(lean)], thin))
    for found in (verdicts(experiment, lean), verdicts(experiment, thin[0])):
        assert [one.text for one in found[:2]] == [one.text for one in whole[:2]]
        for one, other in zip(whole, found, strict=True):
            assert one.status == other.status
            assert list(one.results) == list(other.results)


# -- many ladders ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "levels"),
    [
        (SPRING, [6, 7, 8]),
        (PENDULUM, [6, 7, 8]),
        (PENDULUM, [6, 7, 8, 9]),
        (SPRING, [7, 8, 9, 10, 11]),
    ],
    ids=["spring 3", "pendulum 3", "pendulum 4", "spring 5"],
)
def test_bounds_of_errors_hold(content: Content, levels: list[int]) -> None:
    """In 95 % of real ladders whose order is known, from above and from below; from above in 99 %."""
    (name,) = content["initial"]
    swept = "model.w" if name == "u" else "initial.theta"
    content = {
        **content,
        "levels": levels,
        "sweep": {swept: {"linspace": [0.3, 2.0, 12]}},
        "schemes": [
            *("central", "rk4", "forward_euler", "euler_cromer", "rk2"),
            {"kind": "central", "label": "start", "start": "first_order"},
            {"kind": "central", "label": "end", "end_velocity": "backward"},
        ],
    }
    velocity = "v" if name == "u" else "omega"
    checks = [{"accurate": quantity, "relative": 1.0} for quantity in (name, velocity)]
    true, estimated = (asked(content, *checks, with_exact=known) for known in (True, False))
    above, both = [], []
    for known, found in zip(true, estimated, strict=True):
        errors = {(row.scheme, row.case): row.facts["error"] for row in known.results}
        for row in found.results:
            if row.facts["order_reason"] in ("asymptotic", "exact", "order_low", "order_high"):
                error, bound = row.facts["error"], row.facts["error_bound"]
                above.append(errors[row.scheme, row.case] <= bound)
                both.append(abs(errors[row.scheme, row.case] - error) <= bound - error)
    assert len(above) > 50
    assert np.mean(above) >= 0.99
    assert np.mean(both) >= 0.95


@pytest.mark.parametrize(("relative", "reason"), [(0.01, "match"), (1e-4, "mismatch")])
def test_a_coarse_level_that_is_unstable_does_not_hide_a_finest_one_that_is_accurate(
    relative: float, reason: str
) -> None:
    """A spring of w = 5 with 8 steps of w dt = 2.5, and 512 of 0.04."""
    content = {**SPRING, "model": {"kind": "spring", "w": 5.0}, "time": {"end": 4.0}}
    content["levels"] = [3, 6, 7, 8, 9]
    (found,) = asked(content, {"accurate": "u", "relative": relative})
    assert found.reason == reason
