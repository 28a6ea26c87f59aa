"""The expression graph of a formula: six kinds of immutable nodes, combined by the operators ``+ - * /``.

Nodes are interned: equal formulas are the same object, so equality is identity and common subexpressions are processed
once. Without that, equations solved for the accelerations would not fit into memory.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator, KeysView, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeVar
from weakref import WeakValueDictionary

from vibsim.elementary import ELEMENTARY

T = TypeVar("T")


class _Interned(type):
    """Metaclass that returns the existing node with the same fields, if there is one."""

    def __call__(cls, *fields: Any) -> Any:
        key = (cls, *fields)
        node = _nodes.get(key)
        return _nodes.setdefault(key, super().__call__(*fields)) if node is None else node


_nodes: WeakValueDictionary[tuple[Any, ...], Expression] = WeakValueDictionary()


class Expression(metaclass=_Interned):
    """A formula. Its operators drop terms 0 and factors 1, and a product with 0 is 0."""

    __match_args__: tuple[str, ...]
    operands: tuple[Expression, ...]
    """The operands, in the order of the formula."""
    names: KeysView[str]
    """The names in the formula, in the order of first use."""
    slopes: dict[str, Expression]
    """Cached derivatives, by name (`vibsim.formula.derivatives`)."""

    def __post_init__(self) -> None:
        fields = (x if isinstance(x, tuple) else (x,) for x in vars(self).values())
        operands = tuple(x for field in fields for x in field if isinstance(x, Expression))
        own_name = {self.name: None} if isinstance(self, Name) else {}
        names, *others = [operand.names for operand in operands] or [own_name.keys()]
        if not all(other <= names for other in others):
            names = dict.fromkeys(name for operand in operands for name in operand.names).keys()
        vars(self).update(operands=operands, names=names, slopes={})

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), tuple(vars(self)[name] for name in self.__match_args__)

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


@dataclass(frozen=True, eq=False)
class Number(Expression):
    """A finite, non-negative number."""

    value: float


@dataclass(frozen=True, eq=False)
class Name(Expression):
    """A state, the time or a parameter."""

    name: str


@dataclass(frozen=True, eq=False)
class Negate(Expression):
    """``-operand``."""

    operand: Expression


@dataclass(frozen=True, eq=False)
class Binary(Expression):
    """``left operator right`` with one of the operators ``+ - * / **``."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True, eq=False)
class Compare(Expression):
    """``left operator right`` with one of the operators ``< <= > >= == !=``; its value is 1 or 0."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True, eq=False)
class Call(Expression):
    """A call of one of `FUNCTIONS`."""

    function: str
    arguments: tuple[Expression, ...]


ZERO: Expression = Number(0.0)
ONE: Expression = Number(1.0)
CONSTANTS: Mapping[str, float] = {"pi": math.pi, "e": math.e}
"""Names of numbers, unless a formula declares them otherwise."""

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
"""Operators for floats and arrays. Powers are missing because they differ between the two."""
STEPS = frozenset({"ceil", "floor", "heaviside", "round", "sign"})
"""Piecewise constant functions."""


def number(value: float) -> Expression:
    """Return the formula of a number of either sign."""
    return Negate(Number(-value)) if value < 0.0 else Number(value)


def literal(node: Expression) -> float | None:
    """Return the value of a number with any number of minus signs; None for other formulas."""
    match node:
        case Number(value):
            return value
        case Negate(operand):
            inner = literal(operand)
            return None if inner is None else -inner
    return None


def _never(_: Expression) -> bool:
    return False


def parts_of(*formulas: Expression, but: Callable[[Expression], bool] = _never) -> list[Expression]:
    """Return the distinct subexpressions of formulas in topological order: operands first, from left to right.

    Parameters
    ----------
    but
        Predicate for subexpressions to leave out, with all that only they use.
    """
    ordered: dict[Expression, None] = {}
    stack = [*reversed(formulas)]
    while stack:
        node = stack[-1]
        missing = [x for x in node.operands if x not in ordered and not but(x)]
        if missing and not but(node):
            stack += reversed(missing)
            continue
        stack.pop()
        if not but(node):
            ordered[node] = None
    return list(ordered)


def folded(formulas: Sequence[Expression], work_out: Callable[..., T]) -> list[T]:
    """Return the result of a bottom-up evaluation of each formula.

    `work_out` maps a node and the results of its operands to the result of the node. It is called once per distinct
    subexpression, and results are dropped after their last use.
    """
    results: dict[Expression, T] = {}
    for node, last_uses in _in_order(tuple(formulas)):
        results[node] = work_out(node, *[results[operand] for operand in node.operands])
        for operand in last_uses:
            del results[operand]
    return [results[formula] for formula in formulas]


@lru_cache(maxsize=64)
def _in_order(formulas: tuple[Expression, ...]) -> list[tuple[Expression, list[Expression]]]:
    """Return the subexpressions of formulas in topological order, each with the operands that it is the last to use."""
    nodes, later = parts_of(*formulas), set(formulas)
    ordered = []
    for node in reversed(nodes):
        last_uses = [operand for operand in dict.fromkeys(node.operands) if operand not in later]
        later.update(last_uses)
        ordered.append((node, last_uses))
    return ordered[::-1]


def rebuilding(change: Callable[[Expression], Expression]) -> Callable[[Expression], Expression]:
    """Return a function that applies `change` to every subexpression of a formula, operands first."""
    results: dict[Expression, Expression] = {}

    def rebuilt(node: Expression) -> Expression:
        for inner in parts_of(node, but=results.__contains__):
            operands = tuple(results[operand] for operand in inner.operands)
            results[inner] = change(_with_operands(inner, operands))
        return results[node]

    return rebuilt


def _with_operands(node: Expression, operands: tuple[Expression, ...]) -> Expression:
    match node:
        case Negate():
            return Negate(*operands)
        case Binary(symbol) | Compare(symbol):
            return type(node)(symbol, *operands)
        case Call(function):
            return Call(function, operands)
    return node


def replacing(formulas: Mapping[str, Expression]) -> Callable[[Expression], Expression]:
    """Return a function that substitutes formulas for names."""
    return rebuilding(
        lambda part: formulas.get(part.name, part) if isinstance(part, Name) else part
    )


def put(node: Expression, name: str, what: Expression) -> Expression:
    """Return a formula with `what` substituted for a name."""
    return replacing({name: what})(node)


def walk(node: Expression) -> Iterator[Expression]:
    """Yield each distinct subexpression of a formula in pre-order, `node` first."""
    seen: set[Expression] = set()
    stack = [node]
    while stack:
        inner = stack.pop()
        if inner not in seen:
            seen.add(inner)
            yield inner
            stack += reversed(inner.operands)


def paired(terms: Sequence[Expression], join: Callable[..., Expression]) -> Expression:
    """Return terms joined pairwise, so that the depth grows only logarithmically."""
    while len(terms) > 1:
        pairs = [join(*pair) for pair in zip(terms[::2], terms[1::2], strict=False)]
        terms = [*pairs, *terms[len(terms) - len(terms) % 2 :]]
    return terms[0]
