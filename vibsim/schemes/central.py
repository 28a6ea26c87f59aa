r"""Centred differences (Stoermer-Verlet), ``(u^(n+1) - 2 u^n + u^(n-1))/dt^2 = a(u^n, t^n)``.

Order 2, symplectic and symmetric, explicit, one evaluation of the acceleration per step; stable for w dt <= 2. The
velocity is the centred difference ``(u^(n+1) - u^(n-1))/(2 dt)``. Not to be confused with Euler-Cromer: the same
recurrence, but a first-order solution with plain initial values.

The scheme is written in three ways, algebraically equal but with different round-off:

- ``three_term``, as in the source texts: ``u^(n+1) = 2 u^n - u^(n-1) + dt^2 a``. Each rounding of u acts like a kick of
  the velocity by eps/dt that persists for the rest of the run: round-off grows like eps N^(3/2).
- ``increment``: ``d^(n+1) = d^n + dt^2 a``, ``u^(n+1) = u^n + d^(n+1)``. Round-off grows like eps N^(1/2).
- ``compensated``: the same, but both additions carry their rounding error along (Knuth's two-sum). No growth.

The first step follows from the centred difference ``(u^1 - u^(-1))/(2 dt) = V`` and the scheme at n = 0 (`centred`), or
from three terms of the Taylor polynomial (`taylor`, B, exercise 5): ``u^1 = u^0 + dt V + dt^2 a^0/2`` either way. A
one-sided difference of the initial velocity lowers the order to 1 (B, section 7.2): the forward difference gives
``u^1 = u^0 + dt V`` (`first_order`), like Euler-Cromer with the position first; the backward difference,
``u^(-1) = u^0 - dt V``, gives ``u^1 = u^0 + dt V + dt^2 a^0`` (`backward`), like Euler-Cromer with the velocity first.

Damping. With the increments ``d = u^n - u^(n-1)`` and ``e = u^(n+1) - u^n``, a damping rate c over the mass, and a the
acceleration without damping at n, every step of ``u'' + D(u') = a(u, t)`` is ``e = d + kick``:

- undamped: ``kick = dt^2 a``;
- linear damping, exactly centred, ``D = c (d + e)/(2 dt)``: ``kick = (dt^2 a - c dt d)/(1 + c dt/2)``;
- quadratic damping by the geometric mean, ``D = c |d| e/dt^2``: ``kick = (dt^2 a - c |d| d)/(1 + c |d|)``;
- quadratic damping, exactly centred, ``D = c |s| s/(4 dt^2)`` with ``s = d + e``: s solves a quadratic equation, and
  has the sign of ``r = 2 d + dt^2 a``, so ``s = 2 r/(1 + sqrt(1 + c |r|))`` and ``kick = dt^2 a - c |s| s/4``;
- any damping at the backward difference, ``D(d/dt)``: ``kick = dt^2 a(u^n, d/dt, t^n)`` with D in a.

Source: pendulum lecture (A), equations (7)-(11) and section 3; vibration text (B), equations (7)-(8), (62) and (69),
sections 2.1 and 8.2, and exercise 16. Compensated summation: E. Hairer, C. Lubich and G. Wanner, Geometric Numerical
Integration, section VIII.5.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

from vibsim.core.array_types import Floats
from vibsim.elementary import ELEMENTARY
from vibsim.elementary.exponential import power
from vibsim.models.base import Model
from vibsim.schemes.base import (
    LOW_STARTS,
    UNIT_ROUND_OFF,
    VECTOR,
    ZERO,
    Acceleration,
    Flag,
    Option,
    Options,
    Scheme,
    Stepper,
    Weights,
)
from vibsim.schemes.code_generation import written
from vibsim.schemes.orders import Orders, depends_on_velocity, same_orders

FORWARD_START, BACKWARD_START = 1, 2
"""Variants of the start with a one-sided difference of the initial velocity."""


def first_kick(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration
) -> float:
    """Return the dt^2 term of u^1, A (11): ``dt^2 a/2``, or with a one-sided start 0 (A, section 2.3) or ``dt^2 a``."""
    share = 1.0 if variant == BACKWARD_START else 0.5
    return ZERO if variant == FORWARD_START else share * (dt * dt) * acceleration(u, v, 0.0, p)


def start_three_term(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration
) -> tuple[float, float]:
    """Return u^1 and u^0."""
    return u + dt * v + first_kick(variant, u, v, dt, p, acceleration), u


def backward_three_term(state: tuple[float, float], dt: float) -> float:
    """Return ``(u^n - u^(n-1))/dt``: B, section 2.1."""
    u, previous = state
    return (u - previous) / dt


def start_increment(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration
) -> tuple[float, float]:
    """Return u^1 and the increment u^1 - u^0."""
    d = dt * v + first_kick(variant, u, v, dt, p, acceleration)
    return u + d, d


def backward_increment(state: tuple[float, float], dt: float) -> float:
    """Return ``(u^n - u^(n-1))/dt``."""
    return state[1] / dt


def start_compensated(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration
) -> tuple[float, float, float, float]:
    """Return u^1, the increment u^1 - u^0, and the rounding errors of both."""
    kick = first_kick(variant, u, v, dt, p, acceleration)
    push = dt * v
    d = push + kick
    part = d - push
    d_rest = (push - (d - part)) + (kick - part)
    ahead = u + d
    part = ahead - u
    u_rest = (u - (ahead - part)) + (d - part)
    return ahead, d, u_rest, d_rest


@dataclass(frozen=True)
class Treatment:
    """Treatment of the damping in a step: the text of its kick."""

    kick: str
    """Formula of the kick in ``push`` (``dt^2 a``) and ``d``."""
    lines: tuple[str, ...] = ()
    """Assignments before the kick."""
    velocity: str = "ZERO"
    """Velocity at which the acceleration is evaluated; at rest it contains no damping."""


_RATE = "rate = damping_rate(u, ZERO, t, p)"
UNDAMPED = Treatment("push")
LINEAR = Treatment("(push - rate * dt * d) / (1.0 + 0.5 * dt * rate)", (_RATE,))
GEOMETRIC = Treatment("(push - share * d) / (1.0 + share)", (_RATE, "share = rate * abs(d)"))
ROOT = Treatment(
    "(push - 0.25 * rate * abs(both) * both)",
    (
        _RATE,
        "reach = 2.0 * d + push",
        "both = 2.0 * reach / (1.0 + sqrt(1.0 + rate * abs(reach)))",
    ),
)
BACKWARD = Treatment("push", velocity="d / dt")

_COMPENSATED = '''
def step_compensated(state, t, dt, p, {handed}):
    """Return u^(n+1), its increment, their rounding errors, and the velocity at n."""
    u, d, u_rest, d_rest = state
    push = (dt * dt) * acceleration(u, {velocity}, t, p)
{lines}    kick = {kick} + d_rest
    d_ahead = d + kick
    part = d_ahead - d
    d_rest_ahead = (d - (d_ahead - part)) + (kick - part)
    # the rounding error of d is due to u as well, but only within the compensated sum
    drift = d_ahead + u_rest
    ahead = u + drift
    part_of_u = ahead - u
    u_rest_ahead = (u - (ahead - part_of_u)) + (drift - part_of_u)
    return (ahead, d_ahead, u_rest_ahead, d_rest_ahead), (d + d_ahead) * (0.5 / dt)
'''
_INCREMENT = '''
def step_increment(state, t, dt, p, {handed}):
    """Return u^(n+1), its increment and the velocity at n."""
    u, d = state
    push = (dt * dt) * acceleration(u, {velocity}, t, p)
{lines}    d_ahead = d + {kick}
    return (u + d_ahead, d_ahead), (d + d_ahead) * (0.5 / dt)
'''
_THREE_TERM = '''
def step_three_term(state, t, dt, p, {handed}):
    """Return u^(n+1), u^n and the velocity at n: A (9)."""
    u, previous = state
{increment}    push = (dt * dt) * acceleration(u, {velocity}, t, p)
{lines}    ahead = 2.0 * u - previous + {kick}
    return (ahead, u), (ahead - previous) * (0.5 / dt)
'''


@dataclass(frozen=True)
class Arithmetic:
    """A way of writing the scheme."""

    start: Callable[..., Any]
    text: str
    """Text of the step, with placeholders for the treatment of the damping."""
    backward: Callable[..., float]
    carried: Callable[..., Any]
    growth: float
    """Exponent of the growth of round-off with the number of steps."""


ARITHMETICS = {
    "compensated": Arithmetic(
        start_compensated,
        _COMPENSATED,
        backward_increment,
        # no rounding errors
        lambda u, v, a, t, dt: (u(t), u(t) - u(t - dt), u(t) - u(t), u(t) - u(t)),
        0.0,
    ),
    "increment": Arithmetic(
        start_increment,
        _INCREMENT,
        backward_increment,
        lambda u, v, a, t, dt: (u(t), u(t) - u(t - dt)),
        0.5,
    ),
    "three_term": Arithmetic(
        start_three_term,
        _THREE_TERM,
        backward_three_term,
        lambda u, v, a, t, dt: (u(t), u(t - dt)),
        1.5,
    ),
}


@cache
def _step(arithmetic: str, treatment: Treatment) -> Callable[..., Any]:
    """Return the step of an arithmetic (`vibsim.schemes.base.Stepper.step`) with a treatment of the damping."""
    lines = "".join(f"    {line}\n" for line in treatment.lines)
    text = ARITHMETICS[arithmetic].text.format(
        handed="acceleration, damping_rate" if "damping_rate" in lines else "acceleration",
        velocity=treatment.velocity,
        kick=treatment.kick,
        lines=lines,
        increment="" if treatment is UNDAMPED else "    d = u - previous\n",
    )
    functions = {"sqrt": ELEMENTARY["sqrt"].full} if "sqrt" in lines else {}
    return written(text.lstrip("\n"), {"ZERO": "0"}, functions)


def corrected(p: Floats) -> tuple[Floats, Floats]:
    """Return the factors of force and initial velocity that correct the numerical frequency, from ``p = w dt``.

    The numerical frequency is that of ``sin(w~ dt/2) = w dt/2``, too high by ``p^2/24`` (B, equation (19)); exercise 3
    replaces w by ``w (1 - p^2/24)``, so the force by its square times the force, which leaves ``w~ = w (1 + O(p^4))``.
    The solution is ``u^n = I cos(n w~ dt) + V dt sin(n w~ dt)/sin(w~ dt)``: the initial velocity V stands there with
    the factor ``p/sin p = 1 + p^2/6 + O(p^4)`` relative to the exact ``V/w``, so the start uses ``(1 - p^2/6) V``.
    """
    slower = 1.0 - p * p / 24.0
    return slower * slower, 1.0 - p * p / 6.0


_ENDS = {"extrapolate": "extrapolate", "backward": "backward", "kick": "own"}


def stepper(options: Options, treatment: Treatment = UNDAMPED) -> Stepper:
    """Return the arithmetic, the start and the end for given options.

    The velocity at n is known once u^(n+1) is, so `kick` takes one more step for the velocity at the last point:
    without damping ``(u^(N+1) - u^(N-1))/(2 dt) = (u^N - u^(N-1))/dt + dt a^N/2``.
    """
    name = str(options["arithmetic"])
    arithmetic = ARITHMETICS[name]
    return Stepper(
        arithmetic.start,
        _step(name, treatment),
        arithmetic.backward,
        variant={"first_order": FORWARD_START, "backward": BACKWARD_START}.get(
            str(options["start"]), 0
        ),
        end=_ENDS[str(options["end_velocity"])],
        own_velocity=False,
        scaling=corrected if options.get("frequency_correction") else None,
        carried=arithmetic.carried,
    )


def orders(options: Options) -> Orders:
    """Return order 2, and 4 for the position on a spring with corrected frequency.

    The starts of `LOW_STARTS` promise the same: they miss it, and the verdict says so.
    """
    return same_orders(2, position_linear=4.0 if options.get("frequency_correction") else None)


def round_off(options: Options, steps: int) -> float:
    """Return the predicted round-off after `steps` steps, relative to the solution."""
    return float(
        UNIT_ROUND_OFF * power(float(steps), ARITHMETICS[str(options["arithmetic"])].growth)
    )


def even_powers(quantity: str, model: Model, options: Options) -> bool:
    """Tell whether the error of `quantity` has only even powers of dt (A, section 2.4).

    The start must be centred and the damping linear; quantities of the velocity also need a centred one at the end. A
    corrected frequency scales the velocity and the force of the start, but not the damping of the steps.
    """
    centred_end = quantity in model.positions or options["end_velocity"] == "kick"
    corrected_start = bool(options.get("frequency_correction"))
    centred_damping = model.damping is None or (
        model.damping.kind == "linear" and not corrected_start
    )
    return options["start"] not in LOW_STARTS and centred_end and centred_damping


def _damped(quadratic: Treatment) -> tuple[tuple[str, Callable[[Options], Stepper]], ...]:
    """Return the treatment of each kind of damping, given that of quadratic damping of one coordinate.

    With several coordinates the geometric mean ``|v^(n-1/2)| v^(n+1/2)`` has the error ``dt/2 (|v| v' - |v|' v)``,
    which vanishes only if v' is parallel to v; so quadratic damping is exactly centred there.
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
        ("centred", "taylor", *LOW_STARTS),
        "formula of the first step: from the centred difference of u'(0), A (11); from a Taylor polynomial, which "
        "gives the same (B, exercise 5); from the forward difference, without its dt^2 term; or from the backward "
        "difference, with twice that term (B, section 7.2)",
    ),
    Option(
        "end_velocity",
        tuple(_ENDS),
        "velocity at the last point: linear extrapolation, one-sided difference, "
        "or (u_N - u_(N-1))/dt + dt a_N/2",
    ),
    Option(
        "arithmetic",
        tuple(ARITHMETICS),
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
    start="u^1, by one of the formulas of the option `start`",
    symplectic=True,
    symmetric=True,
    velocity_forces=False,
    damped=_damped(GEOMETRIC),
    weights=lambda options: Weights(0.0, 0.5),
)


CENTRAL_QUADRATIC_ROOT = replace(
    CENTRAL,
    kind="central_quadratic_root",
    title="Centred differences, quadratic damping centred as well",
    weights=None,
    source="vibration text, section 8.2",
    options=_OPTIONS,
    damped=_damped(ROOT),
)
CENTRAL_BACKWARD_DAMPING = replace(
    CENTRAL,
    kind="central_backward_damping",
    title="Centred differences, damping of the backward difference",
    weights=None,
    source="vibration text, exercise 16",
    options=_OPTIONS,
    stepper=partial(stepper, treatment=BACKWARD),
    # the damping is taken half a step too early
    orders=lambda options: same_orders(2, velocity_dependent=same_orders(1)),
    even_powers=lambda quantity, model, options: (
        not depends_on_velocity(model) and even_powers(quantity, model, options)
    ),
    velocity_forces=True,
    damped=(),
)
CENTRED = (CENTRAL, CENTRAL_QUADRATIC_ROOT, CENTRAL_BACKWARD_DAMPING)
