"""Symbolic operations: substitution, simplification, and properties that hold for all values of the names."""

from __future__ import annotations

from collections.abc import Iterator
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
    """Parse a text and substitute other formulas for its names."""
    return replacing(formulas)(_pattern(text, tuple(formulas)))


def tidied(node: Expression) -> Expression:
    """Return a formula simplified by removing terms 0 and factors 0 and 1, and by constant folding.

    Raises `ExpressionError` for a constant without a value, such as 1/0.
    """

    def tidy(inner: Expression) -> Expression:
        if isinstance(inner, Binary) and inner.operator in _OPERATIONS:
            inner = _OPERATIONS[inner.operator](inner.left, inner.right)
        if inner.names or isinstance(inner, Number):
            return inner
        return number(evaluate(inner, {}))

    return rebuilding(tidy)(node)


def is_zero(node: Expression) -> bool:
    """Tell whether a formula is the number 0."""
    return node in (ZERO, Negate(ZERO))


def is_multiple(node: Expression, slope: Expression, name: str) -> bool:
    """Tell whether a formula with derivative `slope` is a constant times `name`, for all values of the parameters."""

    def vanishes(inner: Expression) -> bool:
        """Tell whether a subexpression is certainly 0 at `name` = 0."""
        match inner:
            case Number(value):
                return value == 0.0
            case Name(variable):
                return variable == name
            case Negate(operand) | Binary("/", operand, _):
                return vanishes(operand)
            case Binary("*", left, right):
                return vanishes(left) or vanishes(right)
            case Binary("+" | "-", left, right) | Call("where", (_, left, right)):
                return vanishes(left) and vanishes(right)
            case Binary("**", base, exponent):
                return (literal(exponent) or 0.0) > 0.0 and vanishes(base)
        return False

    # the derivative ignores jumps
    jumps = (inner for inner in walk(node) if is_jump(inner))
    varies = name in slope.names or any(name in inner.names for inner in jumps)
    return not varies and vanishes(node)


def is_jump(node: Expression) -> bool:
    """Tell whether the operation is discontinuous in its operands."""
    return isinstance(node, Compare) or (
        isinstance(node, Call) and node.function in STEPS | {"mod"}
    )


def slope_of(node: Expression, name: str, *, with_start: bool = True) -> Expression | None:
    """Return the slope a of a formula ``a x + b``, or of ``a x`` without `with_start`; None for any other form."""

    def inner(part: Expression) -> Expression | None:
        return slope_of(part, name, with_start=with_start)

    match node:
        case Name(variable) if variable == name:
            return ONE
        case Negate(operand):
            slope = inner(operand)
            return None if slope is None else Negate(slope)
        case Binary("+" | "-", left, right) if with_start and name not in right.names:
            return inner(left)
        case Binary("+" | "-" as symbol, left, right) if with_start and name not in left.names:
            slope = inner(right)
            return Negate(slope) if slope is not None and symbol == "-" else slope
        case Binary("*", left, right) if name not in left.names:
            slope = inner(right)
            return None if slope is None else left * slope
        case Binary("*" | "/" as symbol, left, right) if name not in right.names:
            slope = inner(left)
            return None if slope is None else _OPERATIONS[symbol](slope, right)
    return None


def terms_of(node: Expression) -> Iterator[Expression]:
    """Yield the terms of a sum, with factors and divisors of sums multiplied out."""
    match node:
        case Binary("+", left, right):
            yield from terms_of(left)
            yield from terms_of(right)
        case Binary("-", left, right):
            yield from terms_of(left)
            yield from (Negate(term) for term in terms_of(right))
        case Negate(operand):
            yield from (Negate(term) for term in terms_of(operand))
        case Binary("/", left, right):
            yield from (term / right for term in terms_of(left))
        case Binary("*", left, right) if len(_sum := list(terms_of(right))) > 1:
            yield from (left * term for term in _sum)
        case Binary("*", left, right) if len(_sum := list(terms_of(left))) > 1:
            yield from (term * right for term in _sum)
        case _:
            yield node
