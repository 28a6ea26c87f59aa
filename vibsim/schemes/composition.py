r"""Compositions of drifts and kicks for ``u'' = a(u, t)``; each scheme is its coefficients.

A drift moves the position with the velocity held, ``u = u + c dt v``, and time with it, ``t = t + c dt``; a kick moves
the velocity with the position held, ``v = v + d dt a(u, t)``. Each of them is the exact flow of one part of the energy,
so that every composition is symplectic; a palindrome is symmetric, and its errors have even powers of dt only.

Where the first and the last substep are kicks, the last acceleration of a step is the first one of the next step: the
state carries it, and it is worked out once. Euler-Cromer is the composition of one kick and one drift, in either order:
the recurrence of the centred scheme, with a velocity that lives half a step away from the position. With plain initial
values its solution is of first order (`errata`, vibration text 7.1), with the centred start of second order; its own
velocity and energy are of first order with both. Of a motion ``u'' = a(u, t)`` plain initial values leave the errors
``dt/2 y`` and ``dt/2 (y' - a)`` with ``y'' = (da/du) y``, ``y(0) = 0``, ``y'(0) = a(0)`` (less them, position first).
With no acceleration at the start y is 0, and the position of second order. From rest y is v where time does not enter,
and the velocity is of second order.

A kick needs the force at a known velocity. Only Euler-Cromer with the velocity first has one, the old velocity (B,
section 7.1); the others would be implicit or lose their order on a force that depends on the velocity.

Source: vibration text (B), sections 7.1-7.3 and 8.8; E. Hairer, C. Lubich and G. Wanner, Geometric Numerical
Integration, sections I.1.4 and II.5; H. Yoshida, Physics Letters A 150 (1990) 262-268; I. P. Omelyan, I. M. Mryglod and
R. Folk, Computer Physics Communications 146 (2002) 188-202.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

from vibsim.models.base import Model
from vibsim.schemes.base import Acceleration, Function, Option, Options, Scheme, Stepper
from vibsim.schemes.code_generation import self_starting, written
from vibsim.schemes.orders import depends_on_velocity, same_orders

KICK, DRIFT = "kick", "drift"
Substeps = tuple[tuple[str, str], ...]
"""Kind and coefficient, a formula, of every substep in its order."""


def substep_function(substeps: Substeps) -> Callable[..., Any]:
    """Write the step of a composition on the state (u, v), with the acceleration at u behind it where it is carried."""
    formulas: dict[str, str] = {}

    def times_dt(coefficient: str) -> str:
        """Write a part of dt; equal parts are worked out once."""
        if coefficient == "1":
            return "dt"
        names = {formula: name for name, formula in formulas.items()}
        name = names.get(coefficient, f"C_{len(formulas) + 1}")
        formulas[name] = coefficient
        return f"{name} * dt"

    is_carried = carries_acceleration(substeps)
    lines = ["u, v, a_0 = state" if is_carried else "u, v = state"]
    position, velocity, acceleration = "u", "v", "a_0" if is_carried else ""
    passed: list[str] = []
    for i, (kind, coefficient) in enumerate(substeps, 1):
        if kind == DRIFT:
            lines.append(f"u_{i} = {position} + {times_dt(coefficient)} * {velocity}")
            position, acceleration = f"u_{i}", ""
            passed.append(coefficient)
            continue
        if not acceleration:
            acceleration = f"a_{i}"
            whole = (
                " + ".join(f"({part})" for part in passed) if len(passed) > 1 else "".join(passed)
            )
            time = f"t + {times_dt(whole)}" if passed else "t"
            lines.append(f"{acceleration} = acceleration({position}, {velocity}, {time}, p)")
        lines.append(f"v_{i} = {velocity} + {times_dt(coefficient)} * {acceleration}")
        velocity = f"v_{i}"
    following = [position, velocity, *([acceleration] if is_carried else ())]
    lines.append(f"return ({', '.join(following)}), v")
    body = "\n    ".join(lines)
    return written(f"def step_composed(state, t, dt, p, acceleration):\n    {body}\n", formulas)


def carries_acceleration(substeps: Substeps) -> bool:
    """Tell whether a step begins with the acceleration that the step before ended with."""
    return substeps[0][0] == substeps[-1][0] == KICK


def _composed(
    kind: str,
    title: str,
    source: str,
    substeps: Substeps,
    order: float,
    *,
    own_velocity: bool = True,
) -> Scheme:
    """Return the declaration of a symmetric composition."""

    @cache
    def stepper() -> Stepper:
        step, carries = substep_function(substeps), carries_acceleration(substeps)
        return replace(self_starting(step, carries_acceleration=carries), own_velocity=own_velocity)

    kicks = sum(name == KICK for name, _ in substeps)
    return Scheme(
        kind=kind,
        title=title,
        source=source,
        family="symplectic",
        stepper=lambda options: stepper(),
        orders=lambda options: same_orders(order),
        even_powers=True,
        force_evaluations=kicks - carries_acceleration(substeps),
        symplectic=True,
        symmetric=True,
        velocity_forces=False,
    )


VELOCITY_VERLET = _composed(
    "velocity_verlet",
    "Velocity Verlet (kick, drift, kick)",
    "Hairer, Lubich and Wanner, Geometric Numerical Integration, section I.1.4",
    ((KICK, "1/2"), (DRIFT, "1"), (KICK, "1/2")),
    2,
    # in exact arithmetic v^n = (u^(n+1) - u^(n-1))/(2 dt)
    own_velocity=False,
)
POSITION_VERLET = _composed(
    "position_verlet",
    "Position Verlet (drift, kick, drift)",
    "Hairer, Lubich and Wanner, Geometric Numerical Integration, section I.1.4",
    ((DRIFT, "1/2"), (KICK, "1"), (DRIFT, "1/2")),
    2,
)

_OUTER = "1/(2 - 2**(1/3))"
"""Weight of the first and the last of the three Verlet steps that Yoshida composes."""
_INNER = "-2**(1/3)/(2 - 2**(1/3))"

YOSHIDA4 = _composed(
    "yoshida4",
    "Yoshida's symplectic method (order 4)",
    "Yoshida 1990; Hairer, Lubich and Wanner, Geometric Numerical Integration, section II.4",
    (
        (DRIFT, f"({_OUTER})/2"),
        (KICK, _OUTER),
        (DRIFT, f"({_OUTER} + {_INNER})/2"),
        (KICK, _INNER),
        (DRIFT, f"({_OUTER} + {_INNER})/2"),
        (KICK, _OUTER),
        (DRIFT, f"({_OUTER})/2"),
    ),
    4,
)

_XI, _LAMBDA, _CHI = "0.1786178958448091", "(-0.2123418310626054)", "(-0.06626458266981849)"

PEFRL = _composed(
    "pefrl",
    "Position-extended Forest-Ruth-like method (PEFRL, order 4)",
    "Omelyan, Mryglod and Folk 2002",
    (
        (DRIFT, _XI),
        (KICK, f"(1 - 2*{_LAMBDA})/2"),
        (DRIFT, _CHI),
        (KICK, _LAMBDA),
        (DRIFT, f"1 - 2*({_CHI} + {_XI})"),
        (KICK, _LAMBDA),
        (DRIFT, _CHI),
        (KICK, f"(1 - 2*{_LAMBDA})/2"),
        (DRIFT, _XI),
    ),
    4,
)


def start_velocity_first(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration
) -> tuple[float, float]:
    """Return u^1 and v^1: a step from the initial values, or with v^1 half a step after v^0 (B, `solver_ic_fix`)."""
    part = 0.5 * dt if variant else dt
    v_1 = v + part * acceleration(u, v, 0.0, p)
    return u + dt * v_1, v_1


def start_position_first(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration
) -> tuple[float, float]:
    """Return u^1 and v^1: a step from the initial values, or from v^0 half a step later."""
    ahead = v + 0.5 * dt * acceleration(u, v, 0.0, p) if variant else v
    u_1 = u + dt * ahead
    return u_1, ahead + dt * acceleration(u_1, ahead, dt, p)


def with_slope_behind(u: Function, v: Function, a: Function, t: Any, dt: Any) -> Any:
    """Return u and ``(u^n - u^(n-1))/dt``: what the velocity of `EULER_CROMER` is."""
    return u(t), (u(t) - u(t - dt)) / dt


def with_slope_ahead(u: Function, v: Function, a: Function, t: Any, dt: Any) -> Any:
    """Return u and ``(u^(n+1) - u^n)/dt``: what the velocity of `EULER_CROMER_U_FIRST` is."""
    return u(t), (u(t + dt) - u(t)) / dt


_STARTS = ("first_order", "centred")

_PLAIN = same_orders(
    1,
    # the errors stand at the head of this module
    from_rest=same_orders(1, velocity=2, velocity_d2t=1, energy_d2t=2, energy_d2t_linear=2),
    from_balance=same_orders(1, position=2, energy_d2t=2, energy_d2t_linear=2),
)
_CENTRED = same_orders(
    1,
    position=2,
    energy_d2t=2,
    energy_d2t_linear=2,
    # the old velocity is half a step behind the place where the force is taken
    velocity_dependent=same_orders(1),
)


def _is_centred(options: Options) -> bool:
    return options["start"] == "centred"


def _even_powers(quantity: str, model: Model, options: Options) -> bool:
    """Tell whether a quantity has even powers only: all that the positions of the centred scheme decide."""
    decided = quantity in (*model.positions, "potential_energy") or quantity.endswith("_d2t")
    return decided and _is_centred(options) and not depends_on_velocity(model)


def _euler_cromer(
    kind: str,
    title: str,
    source: str,
    substeps: Substeps,
    start: Callable[..., tuple[float, float]],
    carried: Callable[..., tuple[float, float]],
    *,
    velocity_forces: bool,
) -> Scheme:
    """Return the declaration of one order of the two substeps."""

    def stepper(options: Options) -> Stepper:
        variant = _STARTS.index(str(options["start"]))
        return Stepper(
            start, substep_function(substeps), variant=variant, staggered=True, carried=carried
        )

    return Scheme(
        kind=kind,
        title=title,
        source=source,
        family="symplectic",
        options=(
            Option(
                "start",
                _STARTS,
                "plain initial values, as the text has them, or the velocity half a step away from the position, "
                "which makes the positions those of `central`",
            ),
        ),
        stepper=stepper,
        orders=lambda options: _CENTRED if _is_centred(options) else _PLAIN,
        even_powers=_even_powers,
        start="plain initial values, or the formula of the option `start`",
        symplectic=True,
        velocity_forces=velocity_forces,
    )


EULER_CROMER = _euler_cromer(
    "euler_cromer",
    "Euler-Cromer, velocity first (symplectic Euler)",
    "vibration text, section 7.1, equations (53)-(54), and section 8.8",
    ((KICK, "1"), (DRIFT, "1")),
    start_velocity_first,
    with_slope_behind,
    velocity_forces=True,
)
EULER_CROMER_U_FIRST = _euler_cromer(
    "euler_cromer_u_first",
    "Euler-Cromer, position first (symplectic Euler)",
    "vibration text, section 7.1, equations (51)-(52)",
    ((DRIFT, "1"), (KICK, "1")),
    start_position_first,
    with_slope_ahead,
    velocity_forces=False,
)

COMPOSITIONS = (
    EULER_CROMER,
    EULER_CROMER_U_FIRST,
    VELOCITY_VERLET,
    POSITION_VERLET,
    YOSHIDA4,
    PEFRL,
)
