"""Integrals of formulas, as formulas: the potential energy of a spring.

The integral is taken from 0, in forms that do not cancel there: a small energy has all its digits. A sum is integrated
term by term; a term is a constant factor times a power of x, or a function of the table (`antiderivative`) of ``a x``.
What has a corner or jumps is integrated for ``a x + b`` too, though the difference ``F(a x + b) - F(b)`` may cost a
small energy some digits; what holds on one side of a place alone is integrated up to that place or from there. Anything
else is integrated by Gauss and Legendre's rule between 0 and x, written out as a formula: right to round-off for a
function that is smooth there, even if it has a corner at 0. Where a function has poles beside the real axis, as
``x/sqrt(1 + x^2)`` at i, the rule is one over asinh(x): the way from 0 to 128 is then 5.5 long, and i still 1.6 away.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from vibsim.formula.algebra import put
from vibsim.formula.antiderivative import BROKEN, SMOOTH, of_mod, ramp, ramp_integral
from vibsim.formula.linear import factor_of, slope_of, start_of
from vibsim.formula.parser import literal
from vibsim.formula.tree import (
    Binary,
    Call,
    Compare,
    Expression,
    Name,
    Negate,
    Number,
    names_in,
    rebuilt,
    walk,
)

ZERO, ONE, TWO, HALF = Number(0.0), Number(1.0), Number(2.0), Number(0.5)
POINTS = 24
"""Points of the rule: polynomials up to degree 47 are integrated exactly."""
POLES = frozenset(
    ("sqrt", "hypot", "log", "log1p", "log2", "log10", "atan", "asinh", "tanh", "tan", "atan2")
)
"""Functions that are singular beside the real axis."""
MAX_CONDITIONS = 4
"""Most conditions inside one that decides of a part: each of them doubles the text of the integral."""


def integral(node: Expression, name: str) -> Expression:
    """Return the integral of a formula over one of its names, from 0 to the value of that name."""
    found = _found(node, name)
    return _by_quadrature(node, name) if found is None else found


def has_rule(node: Expression, name: str) -> bool:
    """Tell whether the integral of a formula is exact, and not by quadrature."""
    return _found(node, name) is not None


def _found(node: Expression, name: str) -> Expression | None:
    """Return the integral by the rules; None where they give none."""
    if name not in names_in(node):
        return Binary("*", node, Name(name))
    match node:
        case Name():
            return Binary("*", HALF, Binary("**", node, TWO))
        case Negate(operand):
            inner = _found(operand, name)
            return None if inner is None else Negate(inner)
        case Binary("+" | "-" as symbol, left, right):
            first, second = _found(left, name), _found(right, name)
            return None if first is None or second is None else Binary(symbol, first, second)
        case Binary("*", left, right) if name not in names_in(left):
            inner = _found(right, name)
            return None if inner is None else Binary("*", left, inner)
        case Binary("*" | "/" as symbol, left, right) if name not in names_in(right):
            inner = _found(left, name)
            return None if inner is None else Binary(symbol, inner, right)
        case Binary("**", Name() as base, exponent):
            power = literal(exponent)
            if power is None or power <= 0.0:
                return None
            raised = Binary("**", base, Number(power + 1.0))
            return Binary("/", raised, Number(power + 1.0))
        case Binary("**", base, exponent) if name not in names_in(base):
            # e**x
            grown = Call("exp", (Binary("*", Call("log", (base,)), exponent),))
            return _found(grown, name)
        case Call(function, (argument,)) if function in SMOOTH:
            factor = factor_of(argument, name)
            return None if factor is None else Binary("/", SMOOTH[function](argument), factor)
        case _:
            return _of_broken(node, name)


def _of_broken(node: Expression, name: str) -> Expression | None:
    """Return the integral of what has a corner or jumps."""
    match node:
        case Call(function, (argument,)) if function in BROKEN:
            return _of_linear(BROKEN[function], argument, name)
        case Call("mod", (argument, period)) if name not in names_in(period):
            return _of_linear(lambda x: of_mod(x, period), argument, name)
        case Call("max" | "min" as function, (left, right)) if _is_in_one(left, right, name):
            # max(a, b) = b + max(a - b, 0), min(a, b) = a - max(a - b, 0)
            base, symbol = (right, "+") if function == "max" else (left, "-")
            first = _found(base, name)
            second = _of_linear(ramp_integral, Binary("-", left, right), name)
            return None if first is None or second is None else Binary(symbol, first, second)
        case Compare("<" | "<=", left, right) if _is_in_one(left, right, name):
            return _of_linear(ramp, Binary("-", right, left), name)
        case Compare(">" | ">=", left, right) if _is_in_one(left, right, name):
            return _of_linear(ramp, Binary("-", left, right), name)
        case Binary("**", Call("max", (argument, Number(0.0))), exponent):
            more = Number((literal(exponent) or -1.0) + 1.0)
            if more.value <= 1.0:
                return None
            return _of_linear(
                lambda x: Binary("/", Binary("**", ramp(x), more), more), argument, name
            )
        case Call("where", (condition, yes, no)) if name not in names_in(condition):
            first, second = _found(yes, name), _found(no, name)
            if first is None or second is None:
                return None
            return Call("where", (condition, first, second))
        case Call("where", (condition, yes, no)):
            first = _of_part(yes, condition, 1.0, name)
            second = _of_part(no, condition, -1.0, name)
            return None if first is None or second is None else Binary("+", first, second)
        case Binary("*", left, right):
            return _of_part(left, right, 1.0, name) or _of_part(right, left, 1.0, name)
        case _:
            return None


def _of_part(node: Expression, condition: Expression, side: float, name: str) -> Expression | None:
    """Return the integral of a formula where a condition ``a x + b > 0`` holds (side 1), or where it does not (-1).

    On one side of the place c, where H is the integral of the formula, it is ``H(max(x, c)) - H(max(0, c))``, on the
    other the same with ``min``.
    """
    match condition:
        case Compare("<" | "<=", left, right):
            difference = Binary("-", right, left)
        case Compare(">" | ">=", left, right):
            difference = Binary("-", left, right)
        case Call("heaviside", (argument,)):
            difference = Binary("-", argument, ZERO)
        case _:
            return None
    inside = sum(isinstance(part, Compare | Call) for part in walk(node))
    slope = literal(slope_of(difference, name) or ZERO)
    whole = _found(node, name) if inside <= MAX_CONDITIONS else None
    if not slope or whole is None:
        return None
    place = Binary("/", Negate(start_of(difference, name)), _number(slope))
    function = "max" if slope * side > 0.0 else "min"

    def up_to(end: Expression) -> Expression:
        limit = Call(function, (end, place))
        return rebuilt(whole, lambda part: limit if part == Name(name) else part)

    return Binary("-", up_to(Name(name)), up_to(ZERO))


def _number(value: float) -> Expression:
    return Number(value) if value >= 0.0 else Negate(Number(-value))


def _is_in_one(left: Expression, right: Expression, name: str) -> bool:
    """Whether only one of two formulas has the name, so that the slopes of a difference cannot cancel."""
    return (name in names_in(left)) != (name in names_in(right))


def _of_linear(
    write: Callable[[Expression], Expression], argument: Expression, name: str
) -> Expression | None:
    """Return the integral of a function of ``a x + b`` whose antiderivative is given; None for other arguments."""
    factor = factor_of(argument, name)
    if factor is not None:
        return Binary("/", write(argument), factor)
    factor = slope_of(argument, name)
    if factor is None:
        return None
    start = write(start_of(argument, name))
    return Binary("/", Binary("-", write(argument), start), factor)


@cache
def _rule() -> tuple[tuple[float, float], ...]:
    """Return places between 0 and 1 and their weights."""
    x, weights = np.polynomial.legendre.leggauss(POINTS)
    return tuple(zip((0.5 * (x + 1.0)).tolist(), (0.5 * weights).tolist(), strict=True))


def _by_quadrature(node: Expression, name: str) -> Expression:
    """Write Gauss and Legendre's rule, over x itself or, where poles are near, over asinh(x)."""
    if not _has_poles(node, name):
        terms = [
            _weighted(weight, put(node, name, Binary("*", Number(place), Name(name))))
            for place, weight in _rule()
        ]
        return Binary("*", Name(name), _total(terms))
    way = Call("asinh", (Name(name),))
    terms = []
    for place, weight in _rule():
        y = Binary("*", Number(place), way)
        force = put(node, name, Call("sinh", (y,)))
        terms.append(_weighted(weight, Binary("*", force, Call("cosh", (y,)))))
    return Binary("*", way, _total(terms))


def _has_poles(node: Expression, name: str) -> bool:
    """Tell whether a formula may be singular beside the real axis, as 1/(1 + x^2) is at x = i."""

    def may(part: Expression) -> bool:
        match part:
            case Binary("/", _, below):
                return name in names_in(below)
            case Binary("**", base, exponent):
                power = literal(exponent)
                is_entire = power is not None and power >= 0.0 and power.is_integer()
                return name in names_in(base) and not is_entire
            case Call(function, _):
                return function in POLES and name in names_in(part)
        return False

    return any(may(part) for part in walk(node))


def _weighted(weight: float, node: Expression) -> Expression:
    return Binary("*", Number(weight), node)


def _total(terms: list[Expression]) -> Expression:
    """Write a sum in pairs, so that the tree stays flat."""
    while len(terms) > 1:
        ends = zip(terms[::2], terms[1::2], strict=False)
        odd = terms[len(terms) - len(terms) % 2 :]
        terms = [*(Binary("+", left, right) for left, right in ends), *odd]
    return terms[0]
