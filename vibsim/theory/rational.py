"""The acceleration of a model as a formula for exact numbers: what of it meets the polynomial, and its names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from vibsim.formula import (
    ZERO,
    Binary,
    Call,
    Expression,
    Name,
    Negate,
    Number,
    literal,
    minus,
    names_in,
    over,
    plus,
    times,
)
from vibsim.models.base import Model, tree
from vibsim.theory.laurent import Field

COEFFICIENTS, FREQUENCY = "c", "w"
"""Letters of the symbols c_0, c_1, ..., and of w_0, the natural frequency, for schemes that are corrected by it."""


@cache
def restoring(model: Model) -> Expression:
    """Return the acceleration without the terms that name no state: the force for the polynomial cancels them."""
    states = {state.name for state in model.states}

    def is_constant(node: Expression) -> bool:
        return states.isdisjoint(names_in(node))

    def kept(node: Expression) -> Expression:
        match node:
            case _ if is_constant(node):
                return ZERO
            case Negate(operand):
                return Negate(kept(operand))
            case Binary("+" | "-" as sign, left, right):
                return (plus if sign == "+" else minus)(kept(left), kept(right))
            case Binary("*", left, right) if is_constant(left):
                return times(left, kept(right))
            case Binary("*", left, right) if is_constant(right):
                return times(kept(left), right)
            case Binary("/", left, right) if is_constant(right):
                return over(kept(left), right)
        return node

    return kept(tree(model, model.acceleration))


def is_rational(node: Expression) -> bool:
    """Tell whether a formula has ``+ - * /``, whole powers and absolute values only."""
    match node:
        case Number() | Name():
            return True
        case Negate(operand) | Call("abs", (operand,)):
            return is_rational(operand)
        case Binary("**", base, exponent):
            power = literal(exponent)
            return power is not None and power >= 0.0 and power.is_integer() and is_rational(base)
        case Binary(_, left, right):
            return is_rational(left) and is_rational(right)
    return False


def in_series(node: Expression, numbers: Mapping[str, Any], field: Field) -> Any:
    """Return the value of a formula for which `is_rational` holds."""
    match node:
        case Number(value):
            return field.constant(value)
        case Name(name):
            return numbers[name]
        case Negate(operand):
            return -in_series(operand, numbers, field)
        case Call("abs", (operand,)):
            return abs(in_series(operand, numbers, field))
        case Binary("**", base, exponent):
            return in_series(base, numbers, field) ** int(literal(exponent) or 0.0)
        case Binary(symbol, left, right):
            one, other = (in_series(side, numbers, field) for side in (left, right))
            return _OPERATIONS[symbol](one, other)
    raise ValueError("a formula with more than + - * /, whole powers and abs is no series")


_OPERATIONS: Mapping[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
}


@cache
def symbol(model: Model, letter: str, k: int) -> str:
    """Return ``letter_k``, with the letter as often as it takes to be no name of the model: ``cc_0`` beside a c_0."""
    taken = names_in(restoring(model))
    while any(name.startswith(f"{letter}_") for name in taken):
        letter += letter[0]
    return f"{letter}_{k}"


def names_of(model: Model, degree: int) -> tuple[str, ...]:
    """Name everything that a residual may depend on, but dt."""
    states = {state.name for state in model.states}
    own = [name for name in names_in(restoring(model)) if name not in states and name != "t"]
    of_solution = (symbol(model, COEFFICIENTS, k) for k in range(degree + 1))
    return ("t", *of_solution, *own, symbol(model, FREQUENCY, 0))
