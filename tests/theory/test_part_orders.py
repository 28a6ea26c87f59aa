"""Orders of phase and amplitude by theory: against closed forms, and against other ways to the same numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scheme_variants import VARIANTS
from thinned import thinned

from vibsim import theory
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES, Stepper
from vibsim.schemes.base import LOW_STARTS
from vibsim.theory.phase_amplitude import principal_mode

SPRING = MODELS["spring"]
DAMPED = MODELS["oscillator"].written({"spring": "u", "damping": "b*v"}, ())
INF = math.inf


def stepper(kind: str, model: Any = SPRING, **options: Any) -> Stepper:
    scheme = SCHEMES[kind]
    return scheme.stepper_for(model, {**scheme.defaults(), **options})


def value(series: Any, h: float) -> float:
    return math.fsum(series.field.value(series.at(k)) * h**k for k in range(series.end))


# vibration text, sections 4 to 7, and `docs/method.md`: by hand from the closed forms, released from rest
TABLE = [
    ("central", {}, 2.0, INF),
    ("crank_nicolson", {}, 2.0, INF),
    ("forward_euler", {}, 2.0, 1.0),
    ("backward_euler", {}, 2.0, 1.0),
    ("rk2", {}, 2.0, 3.0),
    ("rk4", {}, 4.0, 5.0),
    ("euler_cromer", {}, 1.0, 2.0),
    ("central", {"start": "first_order"}, 1.0, 2.0),
    ("central", {"frequency_correction": True}, 4.0, INF),
    ("euler_cromer", {"start": "centred"}, 2.0, INF),
]


@pytest.mark.parametrize(("kind", "options", "phase", "amplitude"), TABLE)
def test_orders_of_the_closed_forms(
    kind: str, options: dict[str, Any], phase: float, amplitude: float
) -> None:
    assert theory.part_orders(stepper(kind, **options), 0.0, 1.0, 0.0) == (phase, amplitude)


def test_what_dominates_depends_on_the_initial_values() -> None:
    # u^n = u_0 cos(n th) + V h sin(n th)/sin th of the centred scheme, and Euler-Cromer's
    # u^n = u_0 cos((n + 1/2) th)/cos(th/2) + V h sin(n th)/sin th
    u, v = [1.0, 0.0, 1.0, 1e-3], [0.0, 1.0, 1.0, 1.0]
    phase, amplitude = theory.part_orders(stepper("central"), 0.0, u, v)
    np.testing.assert_array_equal(phase, [2, 2, 2, 2])
    np.testing.assert_array_equal(amplitude, [INF, 2, 2, 2])
    phase, amplitude = theory.part_orders(stepper("euler_cromer"), 0.0, u, v)
    np.testing.assert_array_equal(phase, [1, 2, 1, 1])
    np.testing.assert_array_equal(amplitude, [2, 2, 1, 1])


def test_only_the_ratio_of_the_initial_values_matters() -> None:
    of = stepper("euler_cromer")
    for size in (1e-200, 1.0, -1e200):
        np.testing.assert_array_equal(theory.part_orders(of, 0.0, size, 0.0), (1.0, 2.0))


@pytest.mark.parametrize("damping", [2.0, -2.0, 3.5, math.nan])
def test_what_does_not_oscillate_has_no_orders(damping: float) -> None:
    assert np.isnan(theory.part_orders(stepper("rk4", DAMPED), damping, 1.0, 0.0)).all()


def test_a_body_at_rest_has_no_orders() -> None:
    phase, amplitude = theory.part_orders(stepper("rk4"), 0.0, [0.0, 1.0], [0.0, 0.0])
    np.testing.assert_array_equal(phase, [np.nan, 4])
    np.testing.assert_array_equal(amplitude, [np.nan, 5])


def test_an_angle_of_sixty_degrees_lifts_the_order_of_the_frequency() -> None:
    # log((1 + z/2)/(1 - z/2)) - z = z^3/12 + ..., and lambda^3 is real where g = 1
    of = stepper("crank_nicolson", DAMPED)
    assert theory.part_orders(of, 1.0, 1.0, 0.0) == (4.0, 2.0)
    assert theory.part_orders(of, 0.999, 1.0, 0.0) == (2.0, 2.0)


FACTORS: dict[str, Callable[[complex], complex]] = {
    "forward_euler": lambda z: 1 + z,
    "backward_euler": lambda z: 1 / (1 - z),
    "crank_nicolson": lambda z: (1 + z / 2) / (1 - z / 2),
    "rk2": lambda z: 1 + z + z**2 / 2,
    "rk3": lambda z: 1 + z + z**2 / 2 + z**3 / 6,
    "rk4": lambda z: 1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24,
    "gauss4": lambda z: (1 + z / 2 + z**2 / 12) / (1 - z / 2 + z**2 / 12),
}


@pytest.mark.parametrize("kind", thinned(FACTORS, 3))
@pytest.mark.parametrize("damping", [0.0, 0.3, -0.2, 1.4])
def test_the_mode_of_one_step_methods_is_that_of_their_stability_function(
    kind: str, damping: float
) -> None:
    model, h = (DAMPED if damping else SPRING), 0.02
    mode = principal_mode(stepper(kind, model), damping)
    right = math.sqrt(1 - damping**2 / 4)
    found = np.log(FACTORS[kind](h * complex(-damping / 2, right))) / h
    assert value(mode.rate, h) == pytest.approx(found.real, rel=1e-12, abs=1e-13)
    assert value(mode.frequency, h) == pytest.approx(found.imag / right, rel=1e-12)
    # a one-step method starts on its mode: u(0) = u_0, u'(0) - s u_0 = V + (g/2) u_0, each in its own measure
    nought = [value(row, h) for row in mode.position]
    assert nought == pytest.approx([1.0, 0.0], abs=1e-14)
    slopes = [value(row, h) * right / found.imag for row in mode.slope]
    assert slopes == pytest.approx([damping / 2, 1.0], rel=1e-12, abs=1e-13)


@pytest.mark.parametrize(("scheme", "options"), thinned(VARIANTS, 3))
def test_the_mode_is_that_of_the_roots_and_of_the_discrete_solution(
    scheme: Any, options: Any
) -> None:
    """Roots in twice the precision, and powers of the matrix, know nothing of series and of projections."""
    of, h, n = scheme.stepper(options), 0.01, np.arange(400, 420)
    mode = principal_mode(of, 0.0)
    rate, w = value(mode.rate, h), value(mode.frequency, h)
    assert w == pytest.approx(float(theory.roots(of, h).angle) / h, rel=1e-14)
    assert rate == pytest.approx(float(theory.roots(of, h).log_growth) / h, rel=1e-9, abs=1e-17)
    t = n * h
    for k, (u, v) in enumerate(((1.0, 0.0), (0.0, 1.0))):
        nought, slope = value(mode.position[k], h), value(mode.slope[k], h)
        mine = np.exp(rate * t) * (nought * np.cos(w * t) + slope / w * np.sin(w * t))
        exact, _ = theory.discrete(of, 1.0, h, u, v, n)
        np.testing.assert_allclose(mine, exact, rtol=0, atol=4e-15)


@pytest.mark.parametrize(("scheme", "options"), thinned(VARIANTS, 3))
def test_the_lower_of_both_orders_is_that_of_the_position(scheme: Any, options: Any) -> None:
    # such a start makes every position of first order; what a scheme promises is with a sound one
    is_sound = options.get("start") not in LOW_STARTS
    order = scheme.formal_order("u", SPRING, options) if is_sound else 1.0
    found = theory.part_orders(scheme.stepper(options), 0.0, [1.0, 0.0, 0.6], [0.0, 1.0, -1.7])
    lower = np.minimum(*found)
    assert (lower >= order).all()
    assert lower[-1] == order
