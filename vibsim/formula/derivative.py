"""Derivatives of formulas, as formulas: what Newton's method needs of a force."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from vibsim.formula.faults import ExpressionError
from vibsim.formula.parser import literal
from vibsim.formula.tree import Binary, Call, Compare, Expression, Name, Negate, Number, size

ZERO, ONE, TWO = Number(0.0), Number(1.0), Number(2.0)
PER_LN_2, PER_LN_10 = 1.4426950408889634, 0.4342944819032518
MAX_NODES = 100_000
"""Operations and names of a derivative, at most."""
STEPS = frozenset({"ceil", "floor", "heaviside", "round", "sign"})
"""Functions that are constant but for jumps."""


def derivative(node: Expression, name: str) -> Expression:
    """Return the derivative of a formula by one of its names.

    Where a formula has a corner or a jump (``abs``, ``min``, ``max``, ``mod``, ``where``, a comparison, one of `STEPS`)
    the derivative is that of the branch taken; jumps count as flat.

    Raises
    ------
    ExpressionError
        Where the derivative is longer than `MAX_NODES`: that of a product of n factors has n*n of them.
    """
    found = _derivative(node, name)
    if size(found, MAX_NODES) > MAX_NODES:
        rule = f"its derivatives are too long: that by {name} has more than {MAX_NODES} operations"
        raise ExpressionError("", 0, rule, "write a simpler formula")
    return found


def _derivative(node: Expression, name: str) -> Expression:
    match node:
        case Name(own):
            return ONE if own == name else ZERO
        case Negate(operand):
            return _negate(_derivative(operand, name))
        case Binary("+" | "-" as symbol, left, right):
            return _sum(symbol, _derivative(left, name), _derivative(right, name))
        case Binary("*", left, right):
            return _sum(
                "+",
                _times(_derivative(left, name), right),
                _times(left, _derivative(right, name)),
            )
        case Binary("/", left, right):
            # not over right**2, which overflows before the quotient does
            change = _times(node, _derivative(right, name))
            return _over(_sum("-", _derivative(left, name), change), right)
        case Binary("**", base, exponent):
            return _of_power(node, base, exponent, name)
        case Call(function, arguments):
            return _of_call(node, function, arguments, name)
        case _:
            return ZERO


def _of_power(node: Expression, base: Expression, exponent: Expression, name: str) -> Expression:
    by_base, by_exponent = _derivative(base, name), _derivative(exponent, name)
    value = literal(exponent)
    if value is not None:
        factor = Number(abs(value)) if value >= 0 else Negate(Number(-value))
        less = _number(value - 1.0)
        power = base if value == 2.0 else ONE if value == 1.0 else Binary("**", base, less)
        return _times(_times(factor, power), by_base)
    lowered = Binary("**", base, Binary("-", exponent, ONE))
    return _sum(
        "+",
        _times(_times(exponent, lowered), by_base),
        _times(_times(node, Call("log", (base,))), by_exponent),
    )


def _number(value: float) -> Expression:
    return Number(value) if value >= 0.0 else Negate(Number(-value))


def _call(function: str, *arguments: Expression) -> Expression:
    return Call(function, arguments)


def _square(node: Expression) -> Expression:
    return Binary("**", node, TWO)


def _over_leg(x: Expression) -> Expression:
    """Return ``1/sqrt(1 - x^2)``, without cancellation near x = 1."""
    product = Binary("*", Binary("-", ONE, x), Binary("+", ONE, x))
    return Binary("/", ONE, _call("sqrt", product))


def _bell(x: Expression) -> Expression:
    """Return ``2/sqrt(pi) exp(-x^2)``, the derivative of the error function."""
    return Binary("*", Number(2.0 / math.sqrt(math.pi)), _call("exp", Negate(_square(x))))


_OUTER: Mapping[str, Callable[[Expression, Expression], Expression]] = {
    "sin": lambda x, f: _call("cos", x),
    "cos": lambda x, f: Negate(_call("sin", x)),
    "tan": lambda x, f: Binary("+", ONE, _square(f)),
    "exp": lambda x, f: f,
    "log": lambda x, f: Binary("/", ONE, x),
    "sinh": lambda x, f: _call("cosh", x),
    "cosh": lambda x, f: _call("sinh", x),
    # 1 - tanh(x)**2 has no digits left for large x
    "tanh": lambda x, f: Binary("/", ONE, _square(_call("cosh", x))),
    "asin": lambda x, f: _over_leg(x),
    "acos": lambda x, f: Negate(_over_leg(x)),
    "atan": lambda x, f: Binary("/", ONE, Binary("+", ONE, _square(x))),
    # sqrt(1 + x**2) overflows before its inverse vanishes
    "asinh": lambda x, f: Binary("/", ONE, _call("hypot", ONE, x)),
    # a product of roots, which has no value below 1
    "acosh": lambda x, f: Binary(
        "/",
        ONE,
        Binary("*", _call("sqrt", Binary("-", x, ONE)), _call("sqrt", Binary("+", x, ONE))),
    ),
    "atanh": lambda x, f: Binary("/", ONE, Binary("*", Binary("-", ONE, x), Binary("+", ONE, x))),
    "log10": lambda x, f: Binary("/", Number(PER_LN_10), x),
    "log2": lambda x, f: Binary("/", Number(PER_LN_2), x),
    "log1p": lambda x, f: Binary("/", ONE, Binary("+", ONE, x)),
    "expm1": lambda x, f: _call("exp", x),
    "cbrt": lambda x, f: Binary("/", Number(1.0 / 3.0), _square(f)),
    "erf": lambda x, f: _bell(x),
    "erfc": lambda x, f: Negate(_bell(x)),
    "sqrt": lambda x, f: Binary("/", Number(0.5), f),
    "abs": lambda x, f: _call("sign", x),
}
"""Derivative of a function of one argument, from its argument and its value."""


def _of_call(
    node: Expression, function: str, arguments: tuple[Expression, ...], name: str
) -> Expression:
    inner = [_derivative(argument, name) for argument in arguments]
    if all(entry == ZERO for entry in inner) or function in STEPS:
        return ZERO
    if function in _OUTER:
        return _times(_OUTER[function](arguments[0], node), inner[0])
    if function == "where":
        return _call("where", arguments[0], inner[1], inner[2])
    first, second = arguments
    if function in ("min", "max"):
        symbol = "<=" if function == "min" else ">="
        return _call("where", Compare(symbol, first, second), inner[0], inner[1])
    if function == "atan2":
        length = Binary("+", _square(first), _square(second))
        turned = _sum("-", _times(second, inner[0]), _times(first, inner[1]))
        return _over(turned, length)
    if function == "hypot":
        # 0 where both are 0, as that of abs
        length = Binary("+", node, Compare("==", node, ZERO))
        return _sum(
            "+",
            _times(Binary("/", first, length), inner[0]),
            _times(Binary("/", second, length), inner[1]),
        )
    if function == "mod":
        # the whole number that mod has taken away, which a rounded quotient may miss by 1
        taken = _call("round", Binary("/", Binary("-", first, node), second))
        return _sum("-", inner[0], _times(taken, inner[1]))
    raise NotImplementedError(f"{function} has no derivative here")


def _negate(node: Expression) -> Expression:
    return ZERO if node == ZERO else Negate(node)


def _sum(symbol: str, left: Expression, right: Expression) -> Expression:
    if right == ZERO:
        return left
    if left == ZERO:
        return right if symbol == "+" else Negate(right)
    return Binary(symbol, left, right)


def _times(left: Expression, right: Expression) -> Expression:
    if ZERO in (left, right):
        return ZERO
    if left == ONE:
        return right
    return left if right == ONE else Binary("*", left, right)


def _over(left: Expression, right: Expression) -> Expression:
    return ZERO if left == ZERO else Binary("/", left, right)
