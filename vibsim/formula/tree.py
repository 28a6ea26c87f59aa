"""The tree of a formula: six kinds of node, all frozen."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice

from vibsim.elementary import ELEMENTARY


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


_ARGUMENTS = {"atan2": 2, "hypot": 2, "max": 2, "min": 2, "mod": 2, "where": 3}

FUNCTIONS: Mapping[str, tuple[int, Callable[..., float]]] = {
    name: (_ARGUMENTS.get(name, 1), function.full)
    for name, function in ELEMENTARY.items()
    if name != "power"  # written ``**``
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


def rebuilt(node: Expression, change: Callable[[Expression], Expression]) -> Expression:
    """Return the tree with `change` applied to every node, operands before what uses them."""
    match node:
        case Negate(operand):
            return change(Negate(rebuilt(operand, change)))
        case Binary(symbol, left, right):
            return change(Binary(symbol, rebuilt(left, change), rebuilt(right, change)))
        case Compare(symbol, left, right):
            return change(Compare(symbol, rebuilt(left, change), rebuilt(right, change)))
        case Call(function, arguments):
            return change(Call(function, tuple(rebuilt(entry, change) for entry in arguments)))
        case _:
            return change(node)


def walk(node: Expression) -> Iterator[Expression]:
    """Yield `node` and every node below it, in the order of the formula."""
    yield node
    for child in children(node):
        yield from walk(child)


def size(node: Expression, most: int) -> int:
    """Return how many nodes a formula has when it is written out; beyond `most`, `most` and one more."""
    return sum(1 for _ in islice(walk(node), most + 1))


def names_in(expression: Expression) -> tuple[str, ...]:
    """Return the names that `expression` uses, each once, in the order of their first use."""
    return tuple(dict.fromkeys(node.name for node in walk(expression) if isinstance(node, Name)))
