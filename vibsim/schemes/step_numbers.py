"""The numbers that the functions of a scheme run on where these are not floats: what they offer is all a step may use.

That is ``+ - * /``, powers with a small whole exponent, `abs` and comparisons. A step may compare in a loop, until two
values agree. On numbers that no computer's step would reach such a loop may never end, so comparisons are counted.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass
from functools import reduce
from operator import add, neg, sub
from typing import Any, NoReturn

import numpy as np

from vibsim.core.errors import SimulationError, VibsimError

HIGHEST_POWER = 8
"""Highest exponent of a power in a step, which is multiplied out."""
POWER_RULE = (
    f"the exponent of a power must be a whole number from 1 to {HIGHEST_POWER}, as in dt**2"
)
MOST_COMPARISONS = 500
"""Comparisons after which a step counts as one that does not end; an iteration of a usual step needs some tens."""


class EndlessStepError(VibsimError):
    """A function of a scheme that made more comparisons than are allowed."""


_LEFT: ContextVar[list[int] | None] = ContextVar("comparisons left", default=None)


def small_power(node: ast.BinOp) -> int:
    """Return the exponent of a power in the text of a step; 0 if it is not written as a small whole number."""
    exponent = node.right.value if isinstance(node.right, ast.Constant) else None
    if isinstance(exponent, int | float) and exponent in range(1, HIGHEST_POWER + 1):
        return int(exponent)
    return 0


def counting(function: Callable[..., Any], most: int = MOST_COMPARISONS) -> Callable[..., Any]:
    """Return a function that raises `EndlessStepError` if one call of it makes more than `most` comparisons."""

    def counted(*arguments: Any) -> Any:
        token = _LEFT.set([most])
        try:
            return function(*arguments)
        finally:
            _LEFT.reset(token)

    return counted


class Arithmetic:
    """Operators that follow from ``+ * /``, negation and `lift`, which converts a number to this type.

    Comparisons reduce arrays: ``>``, ``>=`` and ``!=`` tell whether any entry is larger or different, ``<``, ``<=`` and
    ``==`` whether all are smaller or equal. So a loop that continues while a correction is large ends when all are
    small, and a NaN ends it.
    """

    __slots__ = ()

    __add__: Any
    __neg__: Any
    __mul__: Any
    __truediv__: Any
    lift: Any
    nearest: Any
    """Floats with the same signs."""
    __hash__ = object.__hash__

    def __pos__(self) -> Any:
        return self

    def __radd__(self, other: Any) -> Any:
        return self + other

    def __rmul__(self, other: Any) -> Any:
        return self * other

    def __sub__(self, other: Any) -> Any:
        return self + -self.lift(other)

    def __rsub__(self, other: Any) -> Any:
        return self.lift(other) + -self

    def __rtruediv__(self, other: Any) -> Any:
        return self.lift(other) / self

    def __pow__(self, exponent: Any) -> Any:
        if exponent not in range(1, HIGHEST_POWER + 1):
            return NotImplemented
        result = self
        for _ in range(int(exponent) - 1):
            result = result * self
        return result

    def __bool__(self) -> bool:
        raise TypeError("a number is no condition: compare it with another")

    def __gt__(self, other: Any) -> bool:
        return bool(np.any(self._beyond(other) > 0))

    def __ge__(self, other: Any) -> bool:
        return bool(np.any(self._beyond(other) >= 0))

    def __lt__(self, other: Any) -> bool:
        return bool(np.all(self._beyond(other) < 0))

    def __le__(self, other: Any) -> bool:
        return bool(np.all(self._beyond(other) <= 0))

    def __ne__(self, other: Any) -> bool:
        return other is not self and bool(np.any(np.abs(self._beyond(other)) > 0))

    def __eq__(self, other: Any) -> bool:
        return not self != other

    def _beyond(self, other: Any) -> Any:
        """Return floats with the signs of the difference to another number, which is then compared with 0."""
        left = _LEFT.get()
        if left is not None:
            left[0] -= 1
            if left[0] < 0:
                raise EndlessStepError("a loop of the step does not end")
        return (self - other).nearest


@dataclass(frozen=True, eq=False, slots=True)
class Plain(Arithmetic):
    """A float that offers only what a step may use; a division by zero gives no error, as in compiled code."""

    nearest: float

    @staticmethod
    def lift(other: Any) -> Plain:
        """Convert a number."""
        return other if isinstance(other, Plain) else Plain(float(other))

    def __add__(self, other: Any) -> Plain:
        return Plain(self.nearest + self.lift(other).nearest)

    def __neg__(self) -> Plain:
        return Plain(-self.nearest)

    def __mul__(self, other: Any) -> Plain:
        return Plain(self.nearest * self.lift(other).nearest)

    def __truediv__(self, other: Any) -> Plain:
        return Plain(divided(self.nearest, self.lift(other).nearest))

    def __abs__(self) -> Plain:
        return self if self >= 0.0 else -self


def divided(a: Any, b: Any) -> Any:
    """Return a/b by IEEE 754, also for b = 0, where Python raises; a may be a vector."""
    if b != 0.0 or isinstance(a, tuple):
        return a / b
    size = math.nan if a == 0.0 or math.isnan(a) else math.copysign(math.inf, a)
    return size * math.copysign(1.0, b)


class Vector(tuple[float, ...]):
    """Position, velocity or acceleration of a model with several coordinates."""

    __slots__ = ()

    def __add__(self, other: Any) -> Vector:
        return Vector(map(add, self, self._vector(other)))

    def __sub__(self, other: Any) -> Vector:
        return Vector(map(sub, self, self._vector(other)))

    def __mul__(self, number: Any) -> Vector:
        return Vector([a * self._number(number) for a in self])

    __rmul__ = __mul__

    def __truediv__(self, number: Any) -> Vector:
        return Vector([divided(a, self._number(number)) for a in self])

    def __repr__(self) -> str:
        return f"vector{tuple(self)}"

    def __neg__(self) -> Vector:
        return Vector(map(neg, self))

    def __abs__(self) -> float:
        return math.sqrt(reduce(add, [a * a for a in self]))

    def _vector(self, other: Any) -> Vector:
        return other if isinstance(other, Vector) else self._refuse()

    def _number(self, other: Any) -> Any:
        return self._refuse() if isinstance(other, Vector) else other

    def _refuse(self, *_: Any) -> NoReturn:
        raise SimulationError(
            "the step multiplies or compares two vectors, or adds a number to one. With several coordinates compare "
            "numbers, such as abs(v), and write ZERO for 0"
        )

    __lt__ = __le__ = __gt__ = __ge__ = __radd__ = __rsub__ = __rtruediv__ = _refuse


def vector(*components: float) -> Vector:
    """Return a vector; kernels call this name."""
    return Vector(components)
