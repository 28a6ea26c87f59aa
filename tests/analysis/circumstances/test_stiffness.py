"""Unstable is what grows beyond the exact motion: not a formula that is singular elsewhere, an escape, or few times."""

from __future__ import annotations

import math
from typing import Any

import pytest
from whole import decided

from vibsim import Experiment, Verdict

pytestmark = pytest.mark.usefixtures("without_series")


def judged(
    model: dict[str, Any], initial: dict[str, float], end: float, levels: range, *schemes: str
) -> list[Verdict]:
    """Return the verdicts on the order of u, and on stability, expected and not expected."""
    checks: list[dict[str, Any]] = [{"converges": "u"}, {"stable": True}, {"stable": False}]
    experiment = Experiment.from_dict(
        {
            "title": "t",
            "model": model,
            "initial": initial,
            "time": {"end": end},
            "levels": list(levels),
            "schemes": list(schemes),
            "checks": checks,
        }
    )
    return decided(experiment)


def oscillator(spring: str, potential: str | None = None) -> dict[str, Any]:
    own = {} if potential is None else {"potential": potential}
    return {"kind": "oscillator", "spring": spring, **own}


LOG = oscillator("log(u)", "u*log(u) - u")
ELSEWHERE = [
    (LOG, 1.1),
    (oscillator("sqrt(u) - 1", "2/3*u**1.5 - u"), 1.1),
    (oscillator("u - 1/u", "0.5*u**2 - log(u)"), 1.5),
    (oscillator("u**3 - u"), 1.2),
    # stiff at 0, where the motion about 3 never comes
    (oscillator("u - 3 + 5000*u*exp(-5*u**2)", "0.5*u**2 - 3*u - 500*exp(-5*u**2)"), 3.5),
    # infinitely stiff at 0, which the motion passes in no time
    (oscillator("sign(u)*abs(u)**0.8", "abs(u)**1.8/1.8"), 1.0),
]


@pytest.mark.parametrize(("model", "start"), ELSEWHERE)
def test_stiffness_is_that_of_where_the_motion_is(model: dict[str, Any], start: float) -> None:
    order, stable, unstable = judged(model, {"u": start}, 10.0, range(6, 10), "rk4", "central")
    assert order.reason not in {"unstable", "non_finite"}
    assert (stable.status, unstable.status) == ("PASS", "FAIL")
    assert math.isfinite(float(stable.text.split("w dt = ")[1].split(". ")[0]))


def test_a_smooth_motion_beside_a_singular_point_has_its_order() -> None:
    (order, _, _) = judged(LOG, {"u": 1.1}, 10.0, range(6, 10), "rk4", "heun", "velocity_verlet")
    assert (order.status, order.reason) == ("PASS", "asymptotic")


def test_a_body_at_rest_beside_a_singular_point_is_stable() -> None:
    order, stable, _ = judged(LOG, {"u": 1.0}, 10.0, range(6, 10), "rk4")
    assert order.status != "FAIL"
    assert stable.status == "PASS"


@pytest.mark.parametrize(
    ("spring", "start", "end"), [("-u**3", 1.0, 3.0), ("-exp(u)", 0.0, 4.0), ("-u**2", 1.0, 5.0)]
)
def test_an_escape_in_finite_time_is_no_instability(spring: str, start: float, end: float) -> None:
    schemes = ("rk4", "central", "forward_euler")
    told = judged(oscillator(spring), {"u": start}, end, range(9, 13), *schemes)
    order, stable, unstable = told
    for found in (order, stable):
        assert {(one.scheme, one.reason) for one in found.results} == {
            (scheme, "non_finite") for scheme in schemes
        }
    assert "Finer levels do not avoid it" in order.text
    assert "escapes" in stable.text
    # nothing is known of stability either way
    assert {one.status for found in told for one in found.results} == {"FAIL"}
    assert "time: end" in unstable.advice


def test_a_growth_that_is_the_motion_s_own_is_no_instability() -> None:
    """Shortly before an escape, where finer levels see more and more of it."""
    told = judged(oscillator("-u**3"), {"u": 1.0}, 1.853, range(2, 8), "heun")
    assert "unstable" not in {one.reason for one in told[:2]}


@pytest.mark.parametrize("scheme", ["crank_nicolson", "gauss4", "backward_euler"])
def test_times_at_which_the_motion_passes_zero_do_not_make_it_grow(scheme: str) -> None:
    """The common times are whole periods after a start at 0: sin(2 pi n), which is rounding."""
    told = judged(
        {"kind": "spring", "w": 2 * math.pi}, {"u": 0.0, "v": 6.28}, 8.0, range(3, 9), scheme
    )
    assert "unstable" not in {one.reason for one in told[:2]}
    assert told[1].status == "PASS"


@pytest.mark.parametrize(
    ("model", "initial", "end", "levels"),
    [
        ({"kind": "spring", "w": 10.0}, {"u": 1.0}, 100.0, range(5, 9)),
        # in one of two wells, away from 0, where nothing pulls back
        (oscillator("50*(u**3 - u)"), {"u": 1.05}, 40.0, range(4, 8)),
        ({"kind": "pendulum"}, {"theta": 0.5}, 400.0, range(5, 8)),
    ],
)
def test_a_step_beyond_the_limit_is_unstable(
    model: dict[str, Any], initial: dict[str, float], end: float, levels: range
) -> None:
    checks = [{"converges": "theta" if "theta" in initial else "u"}, {"stable": True}]
    experiment = Experiment.from_dict(
        {
            "title": "t",
            "model": model,
            "initial": initial,
            "time": {"end": end},
            "levels": list(levels),
            "schemes": ["central"],
            "checks": checks,
        }
    )
    assert {one.reason for one in decided(experiment)} == {"unstable"}
