"""Symbolic derivatives of formulas, for Newton's method."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from vibsim.formula.algebra import filled, is_jump
from vibsim.formula.tree import (
    ONE,
    STEPS,
    ZERO,
    Binary,
    Call,
    Expression,
    Name,
    Negate,
    literal,
    number,
    parts_of,
    walk,
)

_BELL = f"{2.0 / math.sqrt(math.pi)!r}*exp(-x**2)"
_RULES = {
    "sin": "cos(x)",
    "cos": "-sin(x)",
    "tan": "1 + f**2",
    "exp": "f",
    "log": "1/x",
    "sinh": "cosh(x)",
    "cosh": "sinh(x)",
    # 1 - tanh(x)**2 cancels for large x
    "tanh": "1/cosh(x)**2",
    # factorised, because 1 - x**2 cancels near 1
    "asin": "1/sqrt((1 - x)*(1 + x))",
    "acos": "-(1/sqrt((1 - x)*(1 + x)))",
    "atan": "1/(1 + x**2)",
    # not 1/sqrt(1 + x**2): x**2 would overflow where the quotient is not yet 0
    "asinh": "1/hypot(1, x)",
    # a product of roots, which is undefined below 1 like acosh itself
    "acosh": "1/(sqrt(x - 1)*sqrt(x + 1))",
    "atanh": "1/((1 - x)*(1 + x))",
    "log10": "0.4342944819032518/x",
    "log2": "1.4426950408889634/x",
    "log1p": "1/(1 + x)",
    "expm1": "exp(x)",
    "cbrt": f"{1.0 / 3.0!r}/f**2",
    "erf": _BELL,
    "erfc": f"-({_BELL})",
    "sqrt": "0.5/f",
    "abs": "sign(x)",
}
"""Derivatives of functions of one argument x with value f."""


def is_linear(node: Expression, name: str, variables: Iterable[str]) -> bool:
    """Tell whether a formula is linear in a name, with a coefficient that contains none of the variables."""
    jumps = any(is_jump(part) and name in part.names for part in walk(node))
    return not jumps and derivative(node, name).names.isdisjoint(variables)


def derivative(node: Expression, name: str) -> Expression:
    """Return the derivative of a formula with respect to one of its names.

    At corners and jumps (``abs``, ``min``, ``max``, ``mod``, ``where``, comparisons, `STEPS`) it is the derivative of
    the active branch; jumps contribute nothing.
    """
    for inner in parts_of(node, but=lambda inner: name not in inner.names or name in inner.slopes):
        inner.slopes[name] = _slope(inner, name)
    return _cached(node, name)


def _cached(node: Expression, name: str) -> Expression:
    return node.slopes.get(name, ZERO)


def _slope(node: Expression, name: str) -> Expression:
    """Return the derivative of a formula from those of its operands."""
    d = [_cached(operand, name) for operand in node.operands]
    match node:
        case Name():
            return ONE
        case Negate():
            return -d[0]
        case Binary("+"):
            return d[0] + d[1]
        case Binary("-"):
            return d[0] - d[1]
        case Binary("*", left, right):
            return d[0] * right + left * d[1]
        case Binary("/", _, right):
            # not divided by right**2, which overflows before the quotient does
            return _quotient(d[0] - node * d[1], right)
        case Binary("**", base, exponent):
            value = literal(exponent)
            if value is not None:
                lowered = Binary("**", base, number(value - 1.0))
                power = base if value == 2.0 else ONE if value == 1.0 else lowered
                return number(value) * power * d[0]
            lowered = Binary("**", base, Binary("-", exponent, ONE))
            return exponent * lowered * d[0] + node * Call("log", (base,)) * d[1]
        case Call(function, arguments):
            return _call_slope(node, function, arguments, d)
    return ZERO


def _call_slope(
    node: Expression,
    function: str,
    arguments: tuple[Expression, ...],
    slopes: Sequence[Expression],
) -> Expression:
    dx, *other_slopes = slopes
    if all(entry == ZERO for entry in (dx, *other_slopes)) or function in STEPS:
        return ZERO
    x, *other_arguments = arguments
    if function in _RULES:
        return filled(_RULES[function], x=x, f=node) * dx
    if function == "where":
        return Call("where", (x, *other_slopes))
    [y], [dy] = other_arguments, other_slopes
    match function:
        case "min":
            return filled("where(x <= y, dx, dy)", x=x, y=y, dx=dx, dy=dy)
        case "max":
            return filled("where(x >= y, dx, dy)", x=x, y=y, dx=dx, dy=dy)
        case "atan2":
            return _quotient(y * dx - x * dy, filled("x**2 + y**2", x=x, y=y))
        case "hypot":
            # 0 where both are 0, like the derivative of abs
            by_x, by_y = (filled("part/(f + (f == 0))", part=part, f=node) for part in (x, y))
            return by_x * dx + by_y * dy
        case "mod":
            # the multiple of y that mod subtracts; floor(x/y) may be off by 1
            multiple = filled("round((x - f)/y)", x=x, y=y, f=node)
            return dx - multiple * dy
    raise NotImplementedError(f"{function} has no derivative here")


def _quotient(left: Expression, right: Expression) -> Expression:
    return ZERO if left == ZERO else Binary("/", left, right)
