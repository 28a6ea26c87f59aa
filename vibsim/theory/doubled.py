"""Numbers of twice the precision, about 32 digits, whole arrays at a time.

A number is the unevaluated sum of two floats. That is enough for the matrix of a step to be raised to any power that
a run can reach, and for the growth of a scheme that grows by 1e-20 per step.

Source: T. J. Dekker, A floating-point technique for extending the available precision, Numer. Math. 18 (1971); sums
by D. E. Knuth, The Art of Computer Programming, volume 2, section 4.2.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_SPLITTER = 2.0**27 + 1.0


@dataclass(frozen=True, eq=False, slots=True)
class Doubled:
    """An array of numbers ``high + low``, for the arithmetic of the step of a scheme.

    A comparison answers for the array as a whole: ``>`` and ``>=`` whether any number is larger, ``<`` and ``<=``
    whether every one is smaller. A loop that goes on while a correction is large goes on until none is.
    """

    high: Floats
    low: Floats

    __array_ufunc__ = None  # so that an array on the left leaves the operation to this class

    def __add__(self, other: Any) -> Doubled:
        b = doubled(other)
        total, rest = _two_sum(self.high, b.high)
        low, rest_low = _two_sum(self.low, b.low)
        total, rest = _fast_two_sum(total, rest + low)
        return Doubled(*_fast_two_sum(total, rest + rest_low))

    def __neg__(self) -> Doubled:
        return Doubled(-self.high, -self.low)

    def __pos__(self) -> Doubled:
        return self

    def __sub__(self, other: Any) -> Doubled:
        return self + -doubled(other)

    def __rsub__(self, other: Any) -> Doubled:
        return doubled(other) + -self

    def __mul__(self, other: Any) -> Doubled:
        b = doubled(other)
        product, rest = _two_product(self.high, b.high)
        return Doubled(*_fast_two_sum(product, rest + (self.high * b.low + self.low * b.high)))

    def __truediv__(self, other: Any) -> Doubled:
        b = doubled(other)
        first = self.high / b.high
        rest = self - b * first
        second = rest.high / b.high
        rest = rest - b * second
        return Doubled(*_fast_two_sum(first, second)) + rest.high / b.high

    def __rtruediv__(self, other: Any) -> Doubled:
        return doubled(other) / self

    __radd__ = __add__
    __rmul__ = __mul__

    def __abs__(self) -> Doubled:
        sign = np.where(self.high < 0, -1.0, 1.0)
        return Doubled(self.high * sign, self.low * sign)

    def __gt__(self, other: Any) -> bool:
        return bool(np.any((self - other).high > 0))

    def __ge__(self, other: Any) -> bool:
        return bool(np.any((self - other).high >= 0))

    def __lt__(self, other: Any) -> bool:
        return bool(np.all((self - other).high < 0))

    def __le__(self, other: Any) -> bool:
        return bool(np.all((self - other).high <= 0))

    def __getitem__(self, index: Any) -> Doubled:
        return Doubled(self.high[index], self.low[index])

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the array."""
        return self.high.shape

    def swapped(self) -> Doubled:
        """Return an array of matrices with rows for columns."""
        return Doubled(np.swapaxes(self.high, -1, -2), np.swapaxes(self.low, -1, -2))

    @property
    def rounded(self) -> Floats:
        """The nearest floats."""
        return self.high + self.low


def doubled(value: Any) -> Doubled:
    """Return a number, an array or a `Decimal` as it is, in twice the precision."""
    if isinstance(value, Doubled):
        return value
    if isinstance(value, Decimal):
        high = float(value)
        return Doubled(np.asarray(high), np.asarray(float(value - Decimal(high))))
    array = np.asarray(value, dtype=float)
    return Doubled(array, np.zeros_like(array))


def product(a: ArrayLike, b: ArrayLike) -> Doubled:
    """Return the product of two arrays of floats without rounding."""
    return Doubled(*_two_product(np.asarray(a, dtype=float), np.asarray(b, dtype=float)))


def stacked(numbers: Any, shape: tuple[int, ...]) -> Doubled:
    """Return numbers as one array with an axis for them behind those of `shape`."""
    parts = [doubled(number) for number in numbers]
    return Doubled(
        np.stack([np.broadcast_to(part.high, shape) for part in parts], axis=-1),
        np.stack([np.broadcast_to(part.low, shape) for part in parts], axis=-1),
    )


def matmul(a: Doubled, b: Doubled) -> Doubled:
    """Return the product of matrices, shapes (..., i, k) and (..., k, j)."""
    total = a[..., :, 0, None] * b[..., None, 0, :]
    for k in range(1, a.shape[-1]):
        total = total + a[..., :, k, None] * b[..., None, k, :]
    return total


def root(x: Doubled) -> Doubled:
    """Return the square root; 0 where the number is not positive."""
    positive = x.high > 0
    first = np.sqrt(np.where(positive, x.high, 1.0))
    rest = x - product(first, first)
    better = doubled(first) + rest.high / (2.0 * first)
    return Doubled(np.where(positive, better.high, 0.0), np.where(positive, better.low, 0.0))


def _two_sum(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _fast_two_sum(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return the sum and what it lacks, for ``|a| >= |b|``."""
    total = a + b
    return total, b - (total - a)


def _halves(a: Floats) -> tuple[Floats, Floats]:
    scaled = _SPLITTER * a
    high = scaled - (scaled - a)
    return high, a - high


def _two_product(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    total = a * b
    a_high, a_low = _halves(a)
    b_high, b_low = _halves(b)
    return total, ((a_high * b_high - total) + a_high * b_low + a_low * b_high) + a_low * b_low
