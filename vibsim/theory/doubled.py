"""Arrays of double-double numbers: about 32 digits.

A number is the unevaluated sum of two floats. That suffices to raise the matrix of a step to any power that a run can
reach, and to resolve a growth of 1e-20 per step.

Source: T. J. Dekker, A floating-point technique for extending the available precision, Numer. Math. 18 (1971); sums
by D. E. Knuth, The Art of Computer Programming, volume 2, section 4.2.2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vibsim.core.array_types import Floats
from vibsim.elementary.doubled import fast_two_sum, two_product, two_sum
from vibsim.schemes.step_numbers import Arithmetic


@dataclass(frozen=True, eq=False, slots=True)
class Doubled(Arithmetic):
    """An array of numbers ``high + low``."""

    high: Floats
    low: Floats

    __array_ufunc__ = None  # so that an array on the left leaves the operation to this class

    def __add__(self, other: Any) -> Doubled:
        b = doubled(other)
        total, rest = two_sum(self.high, b.high)
        low, rest_low = two_sum(self.low, b.low)
        total, rest = fast_two_sum(total, rest + low)
        return Doubled(*fast_two_sum(total, rest + rest_low))

    def __neg__(self) -> Doubled:
        return Doubled(-self.high, -self.low)

    def __mul__(self, other: Any) -> Doubled:
        b = doubled(other)
        total, rest = two_product(self.high, b.high)
        return Doubled(*fast_two_sum(total, rest + (self.high * b.low + self.low * b.high)))

    def __truediv__(self, other: Any) -> Doubled:
        b = doubled(other)
        first = self.high / b.high
        rest: Doubled = self - b * first
        second = rest.high / b.high
        rest = rest - b * second
        return Doubled(*fast_two_sum(first, second)) + rest.high / b.high

    def __matmul__(self, other: Doubled) -> Doubled:
        """Return the product of matrices, shapes (..., i, k) and (..., k, j)."""
        total = self[..., :, 0, None] * other[..., None, 0, :]
        for k in range(1, self.shape[-1]):
            total = total + self[..., :, k, None] * other[..., None, k, :]
        return total

    def __abs__(self) -> Doubled:
        sign = np.where(self.high < 0, -1.0, 1.0)
        return self.mapped(lambda x: x * sign)

    def __getitem__(self, index: Any) -> Doubled:
        return Doubled(self.high[index], self.low[index])

    @staticmethod
    def lift(other: Any) -> Doubled:
        """Convert a number of any type that `doubled` accepts."""
        return doubled(other)

    @property
    def nearest(self) -> Floats:
        """The high parts, which have the signs of the numbers."""
        return self.high

    @property
    def rounded(self) -> Floats:
        """The numbers rounded to floats."""
        return self.high + self.low

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the array."""
        return self.high.shape

    def mapped(self, function: Callable[[Floats], Any]) -> Doubled:
        """Apply a function without rounding errors to both parts."""
        return Doubled(function(self.high), function(self.low))


def doubled(value: Any) -> Doubled:
    """Convert a number, an array or a `Decimal` to double-double."""
    if isinstance(value, Doubled):
        return value
    if isinstance(value, Decimal):
        high = float(value)
        return Doubled(np.asarray(high), np.asarray(float(value - Decimal(high))))
    array = np.asarray(value, dtype=float)
    return Doubled(array, np.zeros_like(array))


def product(a: ArrayLike, b: ArrayLike) -> Doubled:
    """Return the exact product of two arrays of floats."""
    return Doubled(*two_product(np.asarray(a, dtype=float), np.asarray(b, dtype=float)))


def stacked(numbers: Sequence[Any], shape: tuple[int, ...]) -> Doubled:
    """Return numbers, each broadcast to a shape, stacked along a new last axis."""
    parts = [doubled(number) for number in numbers]
    highs, lows = [part.high for part in parts], [part.low for part in parts]
    return Doubled(
        np.stack([np.broadcast_to(x, shape) for x in highs], axis=-1),
        np.stack([np.broadcast_to(x, shape) for x in lows], axis=-1),
    )


def root(x: Doubled) -> Doubled:
    """Return the square root; 0 for numbers that are not positive."""
    positive = x.high > 0
    first = np.sqrt(np.where(positive, x.high, 1.0))
    rest = x - product(first, first)
    better: Doubled = doubled(first) + rest.high / (2.0 * first)
    return better.mapped(lambda part: np.where(positive, part, 0.0))
