"""The graph of a formula: six kinds of node, all frozen, of which the operators ``+ - * /`` make further formulas.

Formulas that read alike are one object. So two are equal where they are the same, and what formulas have in common is
looked at once: written out, equations that are solved for the accelerations would be longer than any memory.
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


class _Alike(type):
    """What makes nodes: one that reads as another does is that one."""

    def __call__(cls, *fields: Any) -> Any:
        key = (cls, *fields)
        found = _nodes.get(key)
        return _nodes.setdefault(key, super().__call__(*fields)) if found is None else found


_nodes: WeakValueDictionary[tuple[Any, ...], Expression] = WeakValueDictionary()


class Expression(metaclass=_Alike):
    """A formula. A sum, product or quotient of two has no terms 0 and no factors 1; a product with 0 is 0."""

    __match_args__: tuple[str, ...]
    operands: tuple[Expression, ...]
    """In the order of the formula."""
    names: KeysView[str]
    """Names in it, in the order of their first use."""
    slopes: dict[str, Expression]
    """Derivatives that are known already, by name (`vibsim.formula.derivatives`)."""

    def __post_init__(self) -> None:
        fields = (x if isinstance(x, tuple) else (x,) for x in vars(self).values())
        operands = tuple(x for field in fields for x in field if isinstance(x, Expression))
        own = {self.name: None} if isinstance(self, Name) else {}
        names, *others = [part.names for part in operands] or [own.keys()]
        if not all(more <= names for more in others):
            names = dict.fromkeys(name for part in operands for name in part.names).keys()
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
    """A finite number that is not negative."""

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
    """``left operator right`` with an operator out of ``+ - * / **``."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True, eq=False)
class Compare(Expression):
    """``left operator right`` with an operator out of ``< <= > >= == !=``; its value is 1 or 0."""

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


def _nothing(_: Expression) -> bool:
    return False


def parts_of(
    *formulas: Expression, but: Callable[[Expression], bool] = _nothing
) -> list[Expression]:
    """Return the distinct parts of formulas, operands before what uses them, from left to right.

    Parameters
    ----------
    but
        Tells of parts that are left out, with all that they alone use.
    """
    found: dict[Expression, None] = {}
    waiting = [*reversed(formulas)]
    while waiting:
        node = waiting[-1]
        missing = [part for part in node.operands if part not in found and not but(part)]
        if missing and not but(node):
            waiting += reversed(missing)
            continue
        waiting.pop()
        if not but(node):
            found[node] = None
    return list(found)


def folded(formulas: Sequence[Expression], work_out: Callable[..., T]) -> list[T]:
    """Return what is worked out of each formula: of a part, and of what was worked out of its operands.

    It is done once for each distinct part, and what no other part needs any more is forgotten.
    """
    found: dict[Expression, T] = {}
    for part, done in _in_order(tuple(formulas)):
        found[part] = work_out(part, *[found[operand] for operand in part.operands])
        for operand in done:
            del found[operand]
    return [found[formula] for formula in formulas]


@lru_cache(maxsize=64)
def _in_order(formulas: tuple[Expression, ...]) -> list[tuple[Expression, list[Expression]]]:
    """Return the parts of formulas, each with those that no part behind it uses."""
    parts, later = parts_of(*formulas), set(formulas)
    found = []
    for part in reversed(parts):
        done = [operand for operand in dict.fromkeys(part.operands) if operand not in later]
        later.update(done)
        found.append((part, done))
    return found[::-1]


def rebuilding(change: Callable[[Expression], Expression]) -> Callable[[Expression], Expression]:
    """Return what applies `change` to every part of formulas, to operands before what uses them."""
    made: dict[Expression, Expression] = {}

    def rebuilt(node: Expression) -> Expression:
        for part in parts_of(node, but=made.__contains__):
            operands = tuple(made[operand] for operand in part.operands)
            made[part] = change(_with_operands(part, operands))
        return made[node]

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
    """Return what puts formulas in the places of names."""
    return rebuilding(
        lambda part: formulas.get(part.name, part) if isinstance(part, Name) else part
    )


def put(node: Expression, name: str, what: Expression) -> Expression:
    """Return a formula with another one in the place of a name."""
    return replacing({name: what})(node)


def walk(node: Expression) -> Iterator[Expression]:
    """Yield each distinct part of a formula, `node` first, in the order of the formula."""
    seen: set[Expression] = set()
    waiting = [node]
    while waiting:
        part = waiting.pop()
        if part not in seen:
            seen.add(part)
            yield part
            waiting += reversed(part.operands)


def paired(terms: Sequence[Expression], join: Callable[..., Expression]) -> Expression:
    """Return terms joined in pairs, so that the tree stays flat."""
    while len(terms) > 1:
        pairs = [join(*pair) for pair in zip(terms[::2], terms[1::2], strict=False)]
        terms = [*pairs, *terms[len(terms) - len(terms) % 2 :]]
    return terms[0]
