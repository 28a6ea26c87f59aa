"""Characteristic scales of the general oscillator with a linear spring: vibration text (B), section 10.2.

``t_c = sqrt(m/k)``; ``u_c = A/k`` under a force ``A sin(phi t)``, else the initial amplitude; ``E_c = k u_c^2``. With
them ``u'' + 2 beta |u'| u' + u = sin(gamma t)``, equation (85): ``beta = b u_c/(2 m) = A b/(2 m k)`` and
``gamma = phi t_c``; of linear damping, ``u'' + 2 beta u' + u``, it is ``beta = b t_c/(2 m) = b/(2 sqrt(m k))``.
"""

from __future__ import annotations

from vibsim.expression import (
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
)
from vibsim.models.base import Formula
from vibsim.models.scales import T_C, X_C, Scales

M, U, V = Name("m"), Name("u"), Name("v")
ONE, TWO = Number(1.0), Number(2.0)


def linear_scales(
    k: Expression, damping: tuple[str, Expression] | None, force: Expression
) -> Scales:
    """Return the scales of an oscillator.

    Parameters
    ----------
    k
        The stiffness of its spring, a formula in the parameters.
    damping
        Kind and coefficient b of a linear or quadratic damping; None for none and for any other.
    force
        The driving force, a formula in t.
    """
    driven = amplitude_and_frequency(force)
    if driven is None:
        # without an initial position the amplitude is V t_c
        is_moved = Compare("!=", U, Number(0.0))
        size: Expression = Call("where", (is_moved, _size(U), _times(_size(V), T_C)))
    else:
        size = _over(_size(driven[0]), k)
    numbers: list[tuple[str, Formula]] = []
    if damping is not None:
        kind, b = damping
        scale = T_C if kind == "linear" else X_C
        numbers.append(("beta", _over(_times(b, scale), _times(TWO, M))))
    if driven is not None:
        numbers.append(("gamma", _times(driven[1], T_C)))
    energy = _times(k, Binary("**", X_C, TWO))
    return Scales(Call("sqrt", (_over(M, k),)), size, energy, tuple(numbers))


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
                amplitude = _times(amplitude, part)
            case Call("sin" | "cos", (argument,)) if frequency is None:
                frequency = derivative(argument, "t")
            case _:
                return None
    return None if frequency is None or "t" in names_in(frequency) else (amplitude, frequency)


def _size(node: Expression) -> Expression:
    number = literal(node)
    return Call("abs", (node,)) if number is None else Number(abs(number))


def _over(left: Expression, right: Expression) -> Expression:
    return left if right == ONE else Binary("/", left, right)


def _times(left: Expression, right: Expression) -> Expression:
    return right if left == ONE else Binary("*", left, right)
