"""Algebra for any of the number types on which theory runs the functions of a scheme."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


def characteristic(matrix: Any) -> list[Any]:
    """Return the coefficients of the characteristic polynomial, the highest power first, by Leverrier's method.

    The matrix has shape (..., s, s), in double-double precision or as an object array; coefficients have shape (...).
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
    """Divide a polynomial, the highest power first, by ``x^2 - T x + D``; return the quotient and two remainder terms.

    All of them are ``b_k = a_k + T b_(k-1) - D b_(k-2)``.
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
    """Return the increase of T and the decrease of D in a step of Bairstow's method for ``x^2 - T x + D``."""
    b = by_quadratic(polynomial, trace, determinant)
    slopes = by_quadratic(b[:-1], trace, determinant)
    one, zero = b[-2], b[-1]
    c_1, c_2, c_3 = slopes[-1], slopes[-2], slopes[-3] if len(slopes) > 2 else 0.0
    bottom = c_2 * c_2 - c_1 * c_3
    return (c_3 * zero - c_2 * one) / bottom, (c_1 * one - c_2 * zero) / bottom
