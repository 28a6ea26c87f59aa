"""The tree of a formula: six kinds of node, all frozen."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Number:
    """A finite number that is not negative."""

    value: float


@dataclass(frozen=True)
class Name:
    """A state, the time or a parameter."""

    name: str


@dataclass(frozen=True)
class Negate:
    """``-operand``."""

    operand: Expression


@dataclass(frozen=True)
class Binary:
    """``left operator right`` with an operator out of ``+ - * / **``."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True)
class Compare:
    """``left operator right`` with an operator out of ``< <= > >= == !=``; its value is 1 or 0."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True)
class Call:
    """A call of one of `FUNCTIONS`."""

    function: str
    arguments: tuple[Expression, ...]


Expression = Number | Name | Negate | Binary | Compare | Call

CONSTANTS: Mapping[str, float] = {"pi": math.pi, "e": math.e}
"""Names that stand for a number wherever a formula does not declare them otherwise."""


def _sign(x: float) -> float:
    return float((x > 0.0) - (x < 0.0))


def _where(condition: float, yes: float, no: float) -> float:
    return yes if condition else no


FUNCTIONS: Mapping[str, tuple[int, Callable[..., float]]] = {
    "abs": (1, abs),
    "acos": (1, math.acos),
    "asin": (1, math.asin),
    "atan": (1, math.atan),
    "atan2": (2, math.atan2),
    "cos": (1, math.cos),
    "cosh": (1, math.cosh),
    "exp": (1, math.exp),
    "log": (1, math.log),
    "max": (2, max),
    "min": (2, min),
    "sign": (1, _sign),
    "sin": (1, math.sin),
    "sinh": (1, math.sinh),
    "sqrt": (1, math.sqrt),
    "tan": (1, math.tan),
    "tanh": (1, math.tanh),
    "where": (3, _where),
}
"""Functions that a formula may call: number of arguments, and the value for constants."""


def children(node: Expression) -> tuple[Expression, ...]:
    """Return the operands of `node`, in the order of the formula."""
    match node:
        case Negate(operand):
            return (operand,)
        case Binary(_, left, right) | Compare(_, left, right):
            return (left, right)
        case Call(_, arguments):
            return arguments
        case _:
            return ()


def walk(node: Expression) -> Iterator[Expression]:
    """Yield `node` and every node below it, in the order of the formula."""
    yield node
    for child in children(node):
        yield from walk(child)


def names_in(expression: Expression) -> tuple[str, ...]:
    """Return the names that `expression` uses, each once, in the order of their first use."""
    return tuple(dict.fromkeys(node.name for node in walk(expression) if isinstance(node, Name)))
