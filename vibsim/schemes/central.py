r"""Centred differences (Stoermer-Verlet), ``(u^(n+1) - 2 u^n + u^(n-1))/dt^2 = a(u^n, t^n)``.

Order 2, symplectic and symmetric, explicit, one evaluation of the acceleration per step; stable for w dt <= 2. The
velocity is the centred difference ``(u^(n+1) - u^(n-1))/(2 dt)``. Not to be confused with Euler-Cromer: the same
recurrence, but a first-order solution with plain initial values.

One scheme written three ways, algebraically equal, with different round-off:

- ``three_term``, as in the source texts: ``u^(n+1) = 2 u^n - u^(n-1) + dt^2 a``. Each rounding of u acts like a kick of
  the velocity by eps/dt and is carried on for the rest of the run: round-off grows like eps N^(3/2).
- ``increment``: ``d^(n+1) = d^n + dt^2 a``, ``u^(n+1) = u^n + d^(n+1)``. Grows like eps N^(1/2).
- ``compensated``: the same with both additions carrying their rounding error along (Knuth's two-sum). Does not grow.

The first step follows from the centred difference ``(u^1 - u^(-1))/(2 dt) = V`` and the scheme at n = 0 (`centred`), or
from three terms of the Taylor polynomial (`taylor`, B, exercise 5): ``u^1 = u^0 + dt V + dt^2 a^0/2`` either way.

Source: pendulum lecture (A), equations (7)-(11) and section 3; vibration text (B), equations (7)-(8) and section 2.1.
Compensated summation: E. Hairer, C. Lubich and G. Wanner, Geometric Numerical Integration, section VIII.5.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.models.base import Model
from vibsim.schemes.base import (
    UNIT_ROUND_OFF,
    VECTOR,
    Acceleration,
    Flag,
    Function,
    Option,
    Options,
    Scheme,
    Stepper,
)
from vibsim.schemes.central_steps import (
    BACKWARD,
    GEOMETRIC,
    LINEAR,
    ROOT,
    UNDAMPED,
    Treatment,
    step,
)
from vibsim.schemes.orders import Orders, depends_on_velocity


def start_three_term(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration
) -> tuple[float, float]:
    """Return u^1 and u^0; u^1 by A (11), or without its dt^2 term (the trap of A, section 2.3)."""
    kick = 0.0 if variant else 0.5 * (dt * dt) * acceleration(u, v, 0.0, p)
    return u + dt * v + kick, u


def with_point_behind(u: Function, v: Function, a: Function, t: Any, dt: Any) -> Any:
    """Return u^n and u^(n-1)."""
    return u(t), u(t - dt)


def backward_three_term(state: tuple[float, float], dt: float) -> float:
    """Return ``(u^n - u^(n-1))/dt``: B, section 2.1."""
    u, behind = state
    return (u - behind) / dt


def start_increment(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration
) -> tuple[float, float]:
    """Return u^1 and the increment u^1 - u^0."""
    kick = 0.0 if variant else 0.5 * (dt * dt) * acceleration(u, v, 0.0, p)
    d = dt * v + kick
    return u + d, d


def with_increment(u: Function, v: Function, a: Function, t: Any, dt: Any) -> Any:
    """Return u^n and the increment u^n - u^(n-1)."""
    return u(t), u(t) - u(t - dt)


def backward_increment(state: tuple[float, float], dt: float) -> float:
    """Return ``(u^n - u^(n-1))/dt``."""
    return state[1] / dt


def start_compensated(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration
) -> tuple[float, float, float, float]:
    """Return u^1, the increment u^1 - u^0, and the rounding errors that both still have to get."""
    kick = 0.0 if variant else 0.5 * (dt * dt) * acceleration(u, v, 0.0, p)
    push = dt * v
    d = push + kick
    part = d - push
    d_rest = (push - (d - part)) + (kick - part)
    ahead = u + d
    part = ahead - u
    u_rest = (u - (ahead - part)) + (d - part)
    return ahead, d, u_rest, d_rest


def with_rests(u: Function, v: Function, a: Function, t: Any, dt: Any) -> Any:
    """Return u^n, the increment, and no rounding errors."""
    increment = u(t) - u(t - dt)
    nothing = increment - increment
    return u(t), increment, nothing, nothing


def backward_compensated(state: tuple[float, float, float, float], dt: float) -> float:
    """Return ``(u^n - u^(n-1))/dt``."""
    return state[1] / dt


_ENDINGS: dict[str, tuple[Any, Any, Any]] = {
    "compensated": (start_compensated, backward_compensated, with_rests),
    "increment": (start_increment, backward_increment, with_increment),
    "three_term": (start_three_term, backward_three_term, with_point_behind),
}
"""Start, one-sided velocity and state of every arithmetic; its step is that of `vibsim.schemes.central_steps`."""


def corrected(p: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the factors of force and initial velocity that make the scheme oscillate at w, from ``p = w dt``.

    The numerical frequency is that of ``sin(w~ dt/2) = w dt/2``, too high by ``p^2/24`` (B, equation (19)); exercise 3
    replaces w by ``w (1 - p^2/24)``, so the force by its square times the force, which leaves ``w~ = w (1 + O(p^4))``.
    The solution is ``u^n = I cos(n w~ dt) + V dt sin(n w~ dt)/sin(w~ dt)``: the initial velocity V stands there with
    the factor ``p/sin p = 1 + p^2/6 + O(p^4)`` against the exact ``V/w``, so the start gets ``(1 - p^2/6) V``.
    """
    slower = 1.0 - p * p / 24.0
    return slower * slower, 1.0 - p * p / 6.0


_STARTS = ("centred", "taylor", "first_order")
_ENDS = {"extrapolate": "extrapolate", "backward": "backward", "kick": "own"}

_GROWTH = {"compensated": 0.0, "increment": 0.5, "three_term": 1.5}


def stepper(options: Options, treatment: Treatment = UNDAMPED) -> Stepper:
    """Return the arithmetic, the start and the end that the options ask for.

    The velocity at n is known once u^(n+1) is. At the last point that is one more step, whose velocity is the kick:
    without damping ``(u^(N+1) - u^(N-1))/(2 dt) = (u^N - u^(N-1))/dt + dt a^N/2``.
    """
    arithmetic = str(options["arithmetic"])
    start, backward, carried = _ENDINGS[arithmetic]
    return Stepper(
        start,
        step(arithmetic, treatment),
        backward,
        variant=int(options["start"] == "first_order"),
        end=_ENDS[str(options["end_velocity"])],
        own_velocity=False,
        scaling=corrected if options.get("frequency_correction") else None,
        carried=carried,
    )


def orders(options: Options) -> Orders:
    """Return 2: scheme, start and velocity are centred; the corrected frequency makes it 4 for positions on a spring.

    That holds for the start `first_order` too: it breaks the promise, and the verdict says so.
    """
    position_linear = 4.0 if options["frequency_correction"] else None
    return Orders(
        position=2, velocity=2, energy=2, energy_linear=2, position_linear=position_linear
    )


def round_off(options: Options, steps: int) -> float:
    """Return the predicted round-off after `steps` steps, relative to the solution."""
    return float(UNIT_ROUND_OFF * steps ** _GROWTH[str(options["arithmetic"])])


def even_powers(quantity: str, model: Model, options: Options) -> bool:
    """Tell whether the error of `quantity` has even powers of dt only (A, section 2.4).

    The start must be centred and the damping smooth; whatever has the velocity in it needs a centred one at the end.
    """
    centred_end = quantity in model.positions or options["end_velocity"] == "kick"
    centred_damping = model.damping is None or model.damping.kind == "linear"
    return options["start"] != "first_order" and centred_end and centred_damping


def _damped(quadratic: Treatment) -> tuple[tuple[str, Callable[[Options], Stepper]], ...]:
    """Return how every kind of damping is treated, given the treatment of a quadratic one of one coordinate.

    The geometric mean ``|v^(n-1/2)| v^(n+1/2)`` of several coordinates is off by ``dt/2 (|v| v' - |v|' v)``, which
    vanishes where v' is parallel to v only: there the quadratic damping is centred.
    """
    linear = partial(stepper, treatment=LINEAR)
    centred = partial(stepper, treatment=ROOT)
    return (
        ("linear", linear),
        ("quadratic", partial(stepper, treatment=quadratic)),
        (f"{VECTOR}linear", linear),
        (f"{VECTOR}quadratic", centred),
    )


_OPTIONS = (
    Option(
        "start",
        _STARTS,
        "formula of the first step: from the centred difference of u'(0), A (11); from a Taylor polynomial, which "
        "gives the same (B, exercise 5); or without its dt^2 term",
    ),
    Option(
        "end_velocity",
        tuple(_ENDS),
        "velocity at the last point: linear extrapolation, one-sided difference, "
        "or (u_N - u_(N-1))/dt + dt a_N/2",
    ),
    Option(
        "arithmetic",
        tuple(_ENDINGS),
        "how the scheme is written: equal in exact arithmetic, different in round-off",
    ),
)

CENTRAL = Scheme(
    kind="central",
    title="Centred differences (Stoermer-Verlet)",
    source="pendulum lecture, sections 2.2-2.3; vibration text, sections 1.2, 8.1 and 8.2",
    family="two-step",
    options=(
        *_OPTIONS,
        Flag(
            "frequency_correction",
            "whether the force is scaled so that small oscillations have the right frequency to order 4",
        ),
    ),
    stepper=stepper,
    orders=orders,
    round_off=round_off,
    even_powers=even_powers,
    force_evaluations=1,
    start="u^1, by one of the formulas of the option `start`",
    symplectic=True,
    symmetric=True,
    velocity_forces=False,
    damped=_damped(GEOMETRIC),
)


def orders_of_second(options: Options) -> Orders:
    """Return 2, with the damping centred as well."""
    return Orders(position=2, velocity=2, energy=2, energy_linear=2)


def orders_of_backward(options: Options) -> Orders:
    """Return 2, and 1 where there is a damping, which is taken half a step too early."""
    first = Orders(position=1, velocity=1, energy=1, energy_linear=1)
    return replace(orders_of_second(options), velocity_dependent=first)


def even_without_damping(quantity: str, model: Model, options: Options) -> bool:
    """Tell whether the error of `quantity` has even powers of dt only: see `even_powers`."""
    return not depends_on_velocity(model) and even_powers(quantity, model, options)


CENTRAL_QUADRATIC_ROOT = replace(
    CENTRAL,
    kind="central_quadratic_root",
    title="Centred differences, quadratic damping centred as well",
    source="vibration text, section 8.2",
    options=_OPTIONS,
    orders=orders_of_second,
    damped=_damped(ROOT),
)
CENTRAL_BACKWARD_DAMPING = replace(
    CENTRAL,
    kind="central_backward_damping",
    title="Centred differences, damping of the backward difference",
    source="vibration text, exercise 16",
    options=_OPTIONS,
    stepper=partial(stepper, treatment=BACKWARD),
    orders=orders_of_backward,
    even_powers=even_without_damping,
    velocity_forces=True,
    damped=(),
)
CENTRED = (CENTRAL, CENTRAL_QUADRATIC_ROOT, CENTRAL_BACKWARD_DAMPING)
