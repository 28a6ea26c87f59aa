"""Characteristic scales of ``m u'' + f(u') + k u = F(t)``: vibration text (B), section 10.2.

``t_c = sqrt(m/k)``; ``u_c = A/k`` under a force ``A sin(phi t)``, else the initial amplitude; ``E_c = k u_c^2``. With
them ``u'' + 2 beta |u'| u' + u = sin(gamma t)``, equation (85): ``beta = b u_c/(2 m) = A b/(2 m k)`` and
``gamma = phi t_c``; of linear damping, ``u'' + 2 beta u' + u``, it is ``beta = b t_c/(2 m) = b/(2 sqrt(m k))``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.expression import (
    ONE,
    ZERO,
    Binary,
    Call,
    Compare,
    Expression,
    Name,
    Negate,
    Number,
    derivative,
    literal,
    names_in,
    over,
    times,
)
from vibsim.models.base import Formula
from vibsim.models.scales import T_C, X_C, Scales

if TYPE_CHECKING:
    from vibsim.models.mechanical import Forces

TWO = Number(2.0)


def linear_scales(forces: Forces) -> Scales | None:
    """Return the scales of an oscillator; None where its spring is not linear."""
    if not forces.is_linear:
        return None
    m, k = forces.mass, forces.stiffness
    driven = amplitude_and_frequency(forces.force)
    if driven is None:
        # without an initial position the amplitude is V t_c
        u, v = Name(forces.position), Name(forces.velocity)
        size: Expression = Call("where", (Compare("!=", u, ZERO), _size(u), times(_size(v), T_C)))
    else:
        size = over(_size(driven[0]), k)
    numbers: list[tuple[str, Formula]] = []
    if forces.known_damping is not None:
        kind, b = forces.known_damping
        scale = T_C if kind == "linear" else X_C
        numbers.append(("beta", over(times(b, scale), times(TWO, m))))
    if driven is not None:
        numbers.append(("gamma", times(driven[1], T_C)))
    energy = times(k, Binary("**", X_C, TWO))
    return Scales(Call("sqrt", (over(m, k),)), size, energy, tuple(numbers))


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
