"""What kinds of numbers share that theory runs the functions of a scheme on, and the algebra that takes any kind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


class Arithmetic:
    """The operators that follow from ``+ * /``, the sign and `lift`, which makes a number of another kind one of this.

    A comparison answers for an array as a whole: ``>`` and ``>=`` whether any number is larger, ``<`` and ``<=``
    whether every one is smaller. A loop that goes on while a correction is large goes on until none is.
    """

    __slots__ = ()

    __add__: Any
    __neg__: Any
    __mul__: Any
    __truediv__: Any
    lift: Any
    nearest: Any
    """Floats with the signs of the numbers."""

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

    def __gt__(self, other: Any) -> bool:
        return bool(np.any((self - other).nearest > 0))

    def __ge__(self, other: Any) -> bool:
        return bool(np.any((self - other).nearest >= 0))

    def __lt__(self, other: Any) -> bool:
        return bool(np.all((self - other).nearest < 0))

    def __le__(self, other: Any) -> bool:
        return bool(np.all((self - other).nearest <= 0))


def characteristic(matrix: Any) -> list[Any]:
    """Return the coefficients of the characteristic polynomial, the highest power first, by Leverrier's method.

    The matrix has shape (..., s, s), in twice the precision or as an array of objects; a coefficient has shape (...).
    """
    size = matrix.shape[-1]
    coefficients, product = [matrix[..., 0, 0] * 0.0 + 1.0], matrix
    for k in range(1, size + 1):
        trace = product[..., 0, 0]
        for i in range(1, size):
            trace = trace + product[..., i, i]
        coefficients.append(-trace / float(k))
        if k < size:
            product = matrix @ (product + coefficients[-1][..., None, None] * np.eye(size))
    return coefficients


def by_quadratic(polynomial: Sequence[Any], trace: Any, determinant: Any) -> list[Any]:
    """Divide a polynomial, the highest power first, by ``x^2 - T x + D``: the quotient, then two numbers left.

    These are ``b_k = a_k + T b_(k-1) - D b_(k-2)``.
    """
    quotient: list[Any] = []
    for k, value in enumerate(polynomial):
        if k > 0:
            value = value + trace * quotient[-1]
        if k > 1:
            value = value - determinant * quotient[-2]
        quotient.append(value)
    return quotient


def bairstow(polynomial: Sequence[Any], trace: Any, determinant: Any) -> tuple[Any, Any]:
    """Return by how much T rises and D falls in a step of Bairstow's method to a ``x^2 - T x + D`` that divides."""
    b = by_quadratic(polynomial, trace, determinant)
    slopes = by_quadratic(b[:-1], trace, determinant)
    one, zero = b[-2], b[-1]
    c_1, c_2, c_3 = slopes[-1], slopes[-2], slopes[-3] if len(slopes) > 2 else 0.0
    bottom = c_2 * c_2 - c_1 * c_3
    return (c_3 * zero - c_2 * one) / bottom, (c_1 * one - c_2 * zero) / bottom
