r"""Compositions of drifts and kicks for ``u'' = a(u, t)``, given by their coefficients.

A drift moves the position at fixed velocity, ``u = u + c dt v``, and advances time, ``t = t + c dt``; a kick moves the
velocity at fixed position, ``v = v + d dt a(u, t)``. Each is the exact flow of one part of the energy, so every
composition is symplectic; a palindrome is symmetric, and its errors have only even powers of dt.

If the first and the last substep are kicks, the last acceleration of a step is the first one of the next: the state
carries it. Euler-Cromer is the composition of one kick and one drift, in either order: the recurrence of the centred
scheme, with a velocity half a step away from the position. With plain initial values its solution is of first order
(`errata`, vibration text 7.1), with the centred start of second order; its own velocity and energy are of first order
with both. With plain initial values the leading errors are ``dt/2 y`` in the position and ``dt/2 (y' - a)`` in the
velocity, where ``y'' = (da/du) y``, ``y(0) = 0``, ``y'(0) = a(0)`` (opposite signs for position first). If the initial
acceleration is 0, so is y, and the position is of second order. From rest, under forces that do not depend on time, y
equals v, and the velocity is of second order.

A kick needs the force at a known velocity. Only Euler-Cromer with the velocity first has one, the old velocity (B,
section 7.1); on a force that depends on the velocity the others would be implicit or lose their order.

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
from vibsim.schemes.base import Acceleration, Option, Options, Scheme, Stepper
from vibsim.schemes.code_generation import self_starting, written
from vibsim.schemes.orders import depends_on_velocity, same_orders

KICK, DRIFT = "kick", "drift"
Substeps = tuple[tuple[str, str], ...]
"""Kind and coefficient (a formula) of every substep, in order."""


def substep_function(substeps: Substeps) -> Callable[..., Any]:
    """Return the step of a composition; its state is (u, v), or (u, v, a) if the acceleration is carried."""
    formulas: dict[str, str] = {}

    def times_dt(coefficient: str) -> str:
        """Return the text of a fraction of dt; equal coefficients share a name."""
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
            whole = passed[0] if len(passed) == 1 else " + ".join(f"({part})" for part in passed)
            time = f"t + {times_dt(whole)}" if passed else "t"
            lines.append(f"{acceleration} = acceleration({position}, {velocity}, {time}, p)")
        lines.append(f"v_{i} = {velocity} + {times_dt(coefficient)} * {acceleration}")
        velocity = f"v_{i}"
    following = [position, velocity, *([acceleration] if is_carried else ())]
    lines.append(f"return ({', '.join(following)}), v")
    body = "\n    ".join(lines)
    return written(f"def step_composed(state, t, dt, p, acceleration):\n    {body}\n", formulas)


def alternating(first: str, *coefficients: str) -> Substeps:
    """Return substeps of alternating kinds with these coefficients."""
    kinds = (first, DRIFT if first == KICK else KICK)
    return tuple((kinds[i % 2], coefficient) for i, coefficient in enumerate(coefficients))


def carries_acceleration(substeps: Substeps) -> bool:
    """Tell whether a step begins with the acceleration at the end of the previous step."""
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
    """Return the scheme of a symmetric composition."""

    @cache
    def stepper() -> Stepper:
        step, carries = substep_function(substeps), carries_acceleration(substeps)
        return replace(self_starting(step, carries_acceleration=carries), own_velocity=own_velocity)

    return Scheme(
        kind=kind,
        title=title,
        source=source,
        family="symplectic",
        stepper=lambda options: stepper(),
        orders=lambda options: same_orders(order),
        even_powers=True,
        symplectic=True,
        symmetric=True,
        velocity_forces=False,
    )


VELOCITY_VERLET = _composed(
    "velocity_verlet",
    "Velocity Verlet (kick, drift, kick)",
    "Hairer, Lubich and Wanner, Geometric Numerical Integration, section I.1.4",
    alternating(KICK, "1/2", "1", "1/2"),
    2,
    # in exact arithmetic v^n = (u^(n+1) - u^(n-1))/(2 dt)
    own_velocity=False,
)
POSITION_VERLET = _composed(
    "position_verlet",
    "Position Verlet (drift, kick, drift)",
    "Hairer, Lubich and Wanner, Geometric Numerical Integration, section I.1.4",
    alternating(DRIFT, "1/2", "1", "1/2"),
    2,
)

_OUTER = "1/(2 - 2**(1/3))"
"""Weight of the first and the last of the three Verlet steps that Yoshida composes."""
_INNER = "-2**(1/3)/(2 - 2**(1/3))"
_ENDS, _MIDDLE = f"({_OUTER})/2", f"({_OUTER} + {_INNER})/2"

YOSHIDA4 = _composed(
    "yoshida4",
    "Yoshida's symplectic method (order 4)",
    "Yoshida 1990; Hairer, Lubich and Wanner, Geometric Numerical Integration, section II.4",
    alternating(DRIFT, _ENDS, _OUTER, _MIDDLE, _INNER, _MIDDLE, _OUTER, _ENDS),
    4,
)

_XI, _LAMBDA, _CHI = "0.1786178958448091", "(-0.2123418310626054)", "(-0.06626458266981849)"
_KICK, _DRIFT = f"(1 - 2*{_LAMBDA})/2", f"1 - 2*({_CHI} + {_XI})"

PEFRL = _composed(
    "pefrl",
    "Position-extended Forest-Ruth-like method (PEFRL, order 4)",
    "Omelyan, Mryglod and Folk 2002",
    alternating(DRIFT, _XI, _KICK, _CHI, _LAMBDA, _DRIFT, _LAMBDA, _CHI, _KICK, _XI),
    4,
)


def start_velocity_first(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration
) -> tuple[float, float]:
    """Return u^1 and v^1: a step from the initial values, or with half a kick to v^1 (B, `solver_ic_fix`)."""
    part = 0.5 * dt if variant else dt
    v_1 = v + part * acceleration(u, v, 0.0, p)
    return u + dt * v_1, v_1


def start_position_first(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration
) -> tuple[float, float]:
    """Return u^1 and v^1: a step from the initial values, or from the velocity half a step later."""
    ahead = v + 0.5 * dt * acceleration(u, v, 0.0, p) if variant else v
    u_1 = u + dt * ahead
    return u_1, ahead + dt * acceleration(u_1, ahead, dt, p)


_STARTS = ("first_order", "centred")

_PLAIN = same_orders(
    1,
    # see the leading errors in the module docstring
    from_rest=same_orders(1, velocity=2, velocity_d2t=1, energy_d2t=2, energy_d2t_linear=2),
    from_balance=same_orders(1, position=2, energy_d2t=2, energy_d2t_linear=2),
)
_CENTRED = same_orders(
    1,
    position=2,
    energy_d2t=2,
    energy_d2t_linear=2,
    # the force is evaluated with a velocity that is half a step old
    velocity_dependent=same_orders(1),
)


def _is_centred(options: Options) -> bool:
    return options["start"] == "centred"


def _even_powers(quantity: str, model: Model, options: Options) -> bool:
    """Tell whether the error of a quantity has only even powers of dt: true if it depends on positions alone."""
    by_positions = quantity in (*model.positions, "potential_energy") or quantity.endswith("_d2t")
    return by_positions and _is_centred(options) and not depends_on_velocity(model)


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
    """Return the scheme with one order of the two substeps."""

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
    alternating(KICK, "1", "1"),
    start_velocity_first,
    # the velocity is (u^n - u^(n-1))/dt
    lambda u, v, a, t, dt: (u(t), (u(t) - u(t - dt)) / dt),
    velocity_forces=True,
)
EULER_CROMER_U_FIRST = _euler_cromer(
    "euler_cromer_u_first",
    "Euler-Cromer, position first (symplectic Euler)",
    "vibration text, section 7.1, equations (51)-(52)",
    alternating(DRIFT, "1", "1"),
    start_position_first,
    # the velocity is (u^(n+1) - u^n)/dt
    lambda u, v, a, t, dt: (u(t), (u(t + dt) - u(t)) / dt),
    velocity_forces=False,
)

COMPOSITIONS = (
    EULER_CROMER, EULER_CROMER_U_FIRST, VELOCITY_VERLET, POSITION_VERLET, YOSHIDA4, PEFRL
)  # fmt: skip
