"""Formulas made of formulas, and what is seen of one without values for its names."""

from __future__ import annotations

from vibsim.formula.derivative import ONE, STEPS, ZERO
from vibsim.formula.parser import literal
from vibsim.formula.render import evaluate
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

JUMPS = STEPS | {"mod"}
"""Functions whose derivative is that between their jumps."""
EDGES = JUMPS | {"abs", "max", "min", "where"}
"""Functions with corners or jumps."""


def put(node: Expression, name: str, what: Expression) -> Expression:
    """Return a formula with another one in the place of a name."""
    return rebuilt(node, lambda part: what if part == Name(name) else part)


def tidied(node: Expression) -> Expression:
    """Return a formula without sums with 0, products with 0 and 1, and operations on numbers alone.

    Raises
    ------
    ExpressionError
        Where numbers alone have no value: 1/0.
    """
    return rebuilt(node, _tidied_top)


def _tidied_top(node: Expression) -> Expression:
    match node:
        case Binary("+", left, right):
            found = plus(left, right)
        case Binary("-", left, right):
            found = minus(left, right)
        case Binary("*", left, right):
            found = times(left, right)
        case Binary("/", left, right):
            found = over(left, right)
        case _:
            found = node
    if names_in(found) or isinstance(found, Number):
        return found
    value = evaluate(found, {})
    return Negate(Number(-value)) if value < 0.0 else Number(value)


def is_zero(node: Expression) -> bool:
    """Tell whether a formula is the number 0."""
    return node in (ZERO, Negate(ZERO))


def is_multiple(node: Expression, slope: Expression, name: str) -> bool:
    """Tell whether a formula with that derivative is a factor times `name`, whatever the parameters."""
    # the derivative does not tell of a jump
    jumps = (part for part in walk(node) if is_jump(part))
    if name in names_in(slope) or any(name in names_in(part) for part in jumps):
        return False
    return _is_zero_with(node, name)


def _is_zero_with(node: Expression, name: str) -> bool:
    """Tell whether a formula is seen to be 0 where `name` is."""
    match node:
        case Number(value):
            return value == 0.0
        case Name(own):
            return own == name
        case Negate(operand) | Binary("/", operand, _):
            return _is_zero_with(operand, name)
        case Binary("*", left, right):
            return _is_zero_with(left, name) or _is_zero_with(right, name)
        case Binary("+" | "-", left, right) | Call("where", (_, left, right)):
            return _is_zero_with(left, name) and _is_zero_with(right, name)
        case Binary("**", base, exponent):
            return (literal(exponent) or 0.0) > 0.0 and _is_zero_with(base, name)
        case _:
            return False


def is_jump(node: Expression) -> bool:
    """Tell whether the value jumps where an operand varies."""
    return isinstance(node, Compare) or (isinstance(node, Call) and node.function in JUMPS)


def is_smooth(node: Expression) -> bool:
    """Tell whether nothing in a formula has a corner or a jump."""
    return not any(
        isinstance(part, Compare) or (isinstance(part, Call) and part.function in EDGES)
        for part in walk(node)
    )


def times(left: Expression, right: Expression) -> Expression:
    """Return the product of two formulas, without factors 0 and 1."""
    if ZERO in (left, right):
        return ZERO
    if ONE in (left, right):
        return right if left == ONE else left
    return Binary("*", left, right)


def over(left: Expression, right: Expression) -> Expression:
    """Return the quotient of two formulas."""
    return left if right == ONE else Binary("/", left, right)


def plus(left: Expression, right: Expression) -> Expression:
    """Return the sum of two formulas, without 0."""
    if left == ZERO:
        return right
    return left if right == ZERO else Binary("+", left, right)


def minus(left: Expression, right: Expression) -> Expression:
    """Return the difference of two formulas, without 0."""
    if right == ZERO:
        return left
    return Negate(right) if left == ZERO else Binary("-", left, right)
