"""Characteristic scales of ``m u'' + f(u') + s(u) = F(t)`` with ``k = s'(0)``: vibration text (B), section 10.2.

``t_c = sqrt(m/k)``; ``u_c = A/k`` under a force ``A sin(phi t)``, else the initial amplitude; ``E_c = k u_c^2``. With
them ``u'' + 2 beta |u'| u' + u = sin(gamma t)``, equation (85): ``beta = b u_c/(2 m) = A b/(2 m k)`` and
``gamma = phi t_c``; of linear damping, ``u'' + 2 beta u' + u``, it is ``beta = b t_c/(2 m) = b/(2 sqrt(m k))``. The
parameters of the scaled equation follow from their dimensions (`vibsim.models.shared.dimensions`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from vibsim.formula import (
    ONE,
    ZERO,
    Binary,
    Call,
    Compare,
    Expression,
    ExpressionError,
    Name,
    Negate,
    Number,
    derivative,
    is_zero,
    literal,
    names_in,
    over,
    put,
    tidied,
    times,
)
from vibsim.models.base import Formula, Parameter
from vibsim.models.shared.dimensions import DimensionError, Powers, over_scales, powers
from vibsim.models.shared.scales import T_C, X_C, Scales

if TYPE_CHECKING:
    from vibsim.models.shared.mechanical import Forces

TWO = Number(2.0)


def linear_scales(forces: Forces) -> Scales | None:
    """Return the scales of an oscillator; None where its spring has no stiffness at rest."""
    m, k = forces.mass, stiffness_at_rest(forces)
    if k is None:
        return None
    driven = amplitude_and_frequency(forces.force)
    if driven is None:
        # without an initial position the amplitude is V t_c
        u, v = Name(forces.position), Name(forces.velocity)
        size: Expression = Call("where", (Compare("!=", u, ZERO), _size(u), times(_size(v), T_C)))
    else:
        size = over(_size(driven[0]), k)
    numbers: dict[str, Formula] = {}
    if forces.known_damping is not None:
        kind, b = forces.known_damping
        numbers["beta"] = over(times(b, T_C if kind == "linear" else X_C), times(TWO, m))
    if driven is not None:
        numbers["gamma"] = times(driven[1], T_C)
    energy = times(k, Binary("**", X_C, TWO))
    return Scales(_time_scale(m, k), size, energy, tuple(numbers.items()))


def _time_scale(mass: Expression, stiffness: Expression) -> Expression:
    return Call("sqrt", (over(mass, stiffness),))


def stiffness_at_rest(forces: Forces) -> Expression | None:
    """Return the slope of the spring at u = 0, in the parameters; None where it has none there, or is 0."""
    try:
        slope = tidied(put(forces.stiffness, forces.position, ZERO))
    except ExpressionError:
        return None
    return None if is_zero(slope) else slope


def with_scaled_run(
    scales: Scales,
    forces: Forces,
    parameters: tuple[Parameter, ...],
    given: Mapping[str, Powers],
) -> Scales:
    """Return the scales with the parameters of the scaled equation, or why there are none.

    Parameters that `scales` has are taken as they are. `given` are the powers of mass, position and time that some
    parameters have; those of the others follow from the forces.
    """
    known = {forces.position: (0, 1, 0), forces.velocity: (0, 1, -1), "t": (0, 0, 1), **given}
    known |= dict.fromkeys(names_in(forces.mass), (1, 0, 0))
    terms = tuple(
        term for term in (forces.spring, forces.damping, forces.force) if not is_zero(term)
    )
    try:
        found = powers(terms, known, tuple(row.name for row in parameters))
    except DimensionError as error:
        rule = (
            f"{error} has a number in the place of a parameter: its terms cannot have one dimension"
        )
        return replace(scales, refusal=rule)
    units = forces.mass, X_C, T_C
    exactly = _exactly(forces, scales) | dict(scales.parameters or ())
    scaled = (
        (row.key, exactly.get(row.name) or over_scales(row.name, found[row.name], units))
        for row in parameters
    )
    return replace(scales, parameters=tuple(scaled))


def _exactly(forces: Forces, scales: Scales) -> dict[str, Formula]:
    """Return what the scales make 1, or -1, and should not come out of a quotient with a rounding error."""
    found: dict[str, Formula] = dict.fromkeys(names_in(forces.mass), ONE)
    stiffness = stiffness_at_rest(forces)
    if stiffness is None or scales.time != _time_scale(forces.mass, stiffness):
        return found
    match stiffness:
        case Name(name) | Binary("/", Number(1.0), Name(name)):
            found[name] = ONE
    driven = amplitude_and_frequency(forces.force)
    if driven is not None and isinstance(driven[0], Name):
        found[driven[0].name] = Call("sign", (driven[0],))
    return found


def amplitude_and_frequency(force: Expression) -> tuple[Expression, Expression] | None:
    """Return A and phi of a force ``A sin(phi t)`` or ``A cos(phi t)``; None for any other one."""
    amplitude: Expression = ONE
    frequency: Expression | None = None
    parts = [force]
    while parts:
        part = parts.pop(0)
        match part:
            case Binary("*", left, right):
                parts[:0] = [left, right]
            case Negate(operand):
                parts[:0] = [operand]
            case _ if "t" not in names_in(part):
                amplitude = times(amplitude, part)
            case Call("sin" | "cos", (argument,)) if frequency is None:
                frequency = derivative(argument, "t")
            case _:
                return None
    return None if frequency is None or "t" in names_in(frequency) else (amplitude, frequency)


def _size(node: Expression) -> Expression:
    number = literal(node)
    return Call("abs", (node,)) if number is None else Number(abs(number))
