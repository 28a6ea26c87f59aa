"""The tree of a formula: six kinds of node, all frozen, of which the operators ``+ - * /`` make further formulas."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

from vibsim.elementary import ELEMENTARY


class Expression:
    """A formula. A sum, product or quotient of two has no terms 0 and no factors 1; a product with 0 is 0."""

    def __add__(self, right: Expression) -> Expression:
        if self == ZERO:
            return right
        return self if right == ZERO else Binary("+", self, right)

    def __sub__(self, right: Expression) -> Expression:
        if right == ZERO:
            return self
        return Negate(right) if self == ZERO else Binary("-", self, right)

    def __neg__(self) -> Expression:
        return ZERO - self

    def __mul__(self, right: Expression) -> Expression:
        if ZERO in (self, right):
            return ZERO
        if ONE in (self, right):
            return right if self == ONE else self
        return Binary("*", self, right)

    def __truediv__(self, right: Expression) -> Expression:
        return self if right == ONE else Binary("/", self, right)


@dataclass(frozen=True)
class Number(Expression):
    """A finite number that is not negative."""

    value: float


@dataclass(frozen=True)
class Name(Expression):
    """A state, the time or a parameter."""

    name: str


@dataclass(frozen=True)
class Negate(Expression):
    """``-operand``."""

    operand: Expression


@dataclass(frozen=True)
class Binary(Expression):
    """``left operator right`` with an operator out of ``+ - * / **``."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True)
class Compare(Expression):
    """``left operator right`` with an operator out of ``< <= > >= == !=``; its value is 1 or 0."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True)
class Call(Expression):
    """A call of one of `FUNCTIONS`."""

    function: str
    arguments: tuple[Expression, ...]


ZERO: Expression = Number(0.0)
ONE: Expression = Number(1.0)
CONSTANTS: Mapping[str, float] = {"pi": math.pi, "e": math.e}
"""Names that stand for a number wherever a formula does not declare them otherwise."""

_ARGUMENTS = {"atan2": 2, "hypot": 2, "max": 2, "min": 2, "mod": 2, "where": 3}
FUNCTIONS: Mapping[str, tuple[int, Callable[..., float]]] = {
    name: (_ARGUMENTS.get(name, 1), function.full)
    for name, function in ELEMENTARY.items()
    if name != "power"  # written ``**``
}
"""Functions that a formula may call: number of arguments, and the value for constants."""
OPERATORS: Mapping[str, Callable[[Any, Any], Any]] = {
    **{"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv},
    **{"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge},
    **{"==": operator.eq, "!=": operator.ne},
}
"""What operators do with floats and with arrays; a power is another one for each."""
STEPS = frozenset({"ceil", "floor", "heaviside", "round", "sign"})
"""Functions that are constant but for jumps."""


def number(value: float) -> Expression:
    """Return a number of either sign."""
    return Negate(Number(-value)) if value < 0.0 else Number(value)


def literal(node: Expression) -> float | None:
    """Return the value of a number with signs before it, None for anything else."""
    match node:
        case Number(value):
            return value
        case Negate(operand):
            inner = literal(operand)
            return None if inner is None else -inner
    return None


def children(node: Expression) -> tuple[Expression, ...]:
    """Return the operands of `node`, in the order of the formula."""
    match node:
        case Negate(operand):
            return (operand,)
        case Binary(_, left, right) | Compare(_, left, right):
            return (left, right)
        case Call(_, arguments):
            return arguments
    return ()


def rebuilt(node: Expression, change: Callable[[Expression], Expression]) -> Expression:
    """Return the tree with `change` applied to every node, operands before what uses them."""
    parts = [rebuilt(child, change) for child in children(node)]
    match node:
        case Negate():
            return change(Negate(*parts))
        case Binary(symbol) | Compare(symbol):
            return change(type(node)(symbol, *parts))
        case Call(function):
            return change(Call(function, tuple(parts)))
    return change(node)


def put(node: Expression, name: str, what: Expression) -> Expression:
    """Return a formula with another one in the place of a name."""
    return rebuilt(node, lambda part: what if part == Name(name) else part)


def walk(node: Expression) -> Iterator[Expression]:
    """Yield `node` and every node below it, in the order of the formula."""
    yield node
    for child in children(node):
        yield from walk(child)


def size(node: Expression, most: int) -> int:
    """Return how many nodes a formula has when it is written out; beyond `most`, `most` and one more."""
    return sum(1 for _ in islice(walk(node), most + 1))


class Parts:
    """The distinct parts of some formulas, each with a number: parts that read alike are one."""

    def __init__(self, formulas: Iterable[Expression]) -> None:
        self.uses: list[int] = []
        """By the number of a part: how many distinct parts and formulas use it."""
        self.names: dict[int, str] = {}
        """By the number of a part, how a text that has worked it out calls it."""
        self.lines = 0
        """How many lines such a text has."""
        self._numbers: dict[tuple[Any, ...], int] = {}
        for formula in formulas:
            self.uses[self.number(formula)] += 1

    def number(self, node: Expression) -> int:
        """Return the number of a part."""
        inner = tuple(self.number(child) for child in children(node))
        own = (x for x in vars(node).values() if not isinstance(x, Expression | tuple))
        key = (type(node), *own, inner)
        if key not in self._numbers:
            self._numbers[key] = len(self.uses)
            self.uses.append(0)
            for part in inner:
                self.uses[part] += 1
        return self._numbers[key]


def names_in(expression: Expression) -> tuple[str, ...]:
    """Return the names that `expression` uses, each once, in the order of their first use."""
    return tuple(dict.fromkeys(node.name for node in walk(expression) if isinstance(node, Name)))


def paired(terms: Sequence[Expression], join: Callable[..., Expression]) -> Expression:
    """Return terms joined in pairs, so that the tree stays flat."""
    while len(terms) > 1:
        pairs = [join(*pair) for pair in zip(terms[::2], terms[1::2], strict=False)]
        terms = [*pairs, *terms[len(terms) - len(terms) % 2 :]]
    return terms[0]
