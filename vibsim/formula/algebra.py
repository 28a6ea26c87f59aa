"""Formulas made of formulas, and what is seen of one without values for its names."""

from __future__ import annotations

from functools import cache

from vibsim.formula.parser import parse
from vibsim.formula.render import evaluate
from vibsim.formula.tree import (
    ONE,
    OPERATORS,
    STEPS,
    ZERO,
    Binary,
    Call,
    Compare,
    Expression,
    Name,
    Negate,
    Number,
    literal,
    number,
    rebuilding,
    replacing,
    walk,
)

_OPERATIONS = {symbol: OPERATORS[symbol] for symbol in "+-*/"}


@cache
def _pattern(text: str, names: tuple[str, ...]) -> Expression:
    return parse(text, names)


def filled(text: str, **formulas: Expression) -> Expression:
    """Return the formula of a text, with other formulas in the places of its names."""
    return replacing(formulas)(_pattern(text, tuple(formulas)))


def tidied(node: Expression) -> Expression:
    """Return a formula without sums with 0, products with 0 and 1, and operations on numbers alone.

    Raises `ExpressionError` where numbers alone have no value: 1/0.
    """

    def tidy(part: Expression) -> Expression:
        if isinstance(part, Binary) and part.operator in _OPERATIONS:
            part = _OPERATIONS[part.operator](part.left, part.right)
        if part.names or isinstance(part, Number):
            return part
        return number(evaluate(part, {}))

    return rebuilding(tidy)(node)


def is_zero(node: Expression) -> bool:
    """Tell whether a formula is the number 0."""
    return node in (ZERO, Negate(ZERO))


def is_multiple(node: Expression, slope: Expression, name: str) -> bool:
    """Tell whether a formula with that derivative is a factor times `name`, whatever the parameters."""

    def vanishes(part: Expression) -> bool:
        """Tell whether a part is seen to be 0 where `name` is."""
        match part:
            case Number(value):
                return value == 0.0
            case Name(own):
                return own == name
            case Negate(operand) | Binary("/", operand, _):
                return vanishes(operand)
            case Binary("*", left, right):
                return vanishes(left) or vanishes(right)
            case Binary("+" | "-", left, right) | Call("where", (_, left, right)):
                return vanishes(left) and vanishes(right)
            case Binary("**", base, exponent):
                return (literal(exponent) or 0.0) > 0.0 and vanishes(base)
        return False

    # the derivative does not tell of a jump
    jumps = (part for part in walk(node) if is_jump(part))
    varies = name in slope.names or any(name in part.names for part in jumps)
    return not varies and vanishes(node)


def is_jump(node: Expression) -> bool:
    """Tell whether the value jumps where an operand varies."""
    return isinstance(node, Compare) or (
        isinstance(node, Call) and node.function in STEPS | {"mod"}
    )


def slope_of(node: Expression, name: str, *, with_start: bool = True) -> Expression | None:
    """Return the a of a formula ``a x + b``, or of ``a x`` alone; None where it is another one."""

    def inner(part: Expression) -> Expression | None:
        return slope_of(part, name, with_start=with_start)

    match node:
        case Name(own) if own == name:
            return ONE
        case Negate(operand):
            found = inner(operand)
            return None if found is None else Negate(found)
        case Binary("+" | "-", left, right) if with_start and name not in right.names:
            return inner(left)
        case Binary("+" | "-" as symbol, left, right) if with_start and name not in left.names:
            found = inner(right)
            return Negate(found) if found is not None and symbol == "-" else found
        case Binary("*", left, right) if name not in left.names:
            found = inner(right)
            return None if found is None else left * found
        case Binary("*" | "/" as symbol, left, right) if name not in right.names:
            found = inner(left)
            return None if found is None else _OPERATIONS[symbol](found, right)
    return None
