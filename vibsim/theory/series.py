"""Power series in ``P = (w dt)^2`` with exact coefficients, as lists: growth and frequency of a scheme.

The coefficients are elements of a field of SymPy; the lists are short, and need no more than what is here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

Series = list[Any]
"""Coefficients of 1, P, P^2, ...; all series of one calculation have the same length."""


def times(a: Series, b: Series) -> Series:
    """Return the product."""
    return [sum((a[i] * b[k - i] for i in range(1, k + 1)), a[0] * b[k]) for k in range(len(a))]


def over(a: Series, b: Series) -> Series:
    """Return the quotient; b begins with a number that is not 0."""
    quotient: Series = []
    for k, value in enumerate(a):
        known = sum((quotient[i] * b[k - i] for i in range(k)), value * 0)
        quotient.append((value - known) / b[0])
    return quotient


def logarithm(a: Series) -> Series:
    """Return the logarithm of a series that begins with 1, from ``a L' = a'``."""
    slope = over([k * a[k] for k in range(1, len(a))] + [a[0] * 0], a)
    return [a[0] * 0] + [slope[k - 1] / k for k in range(1, len(a))]


def power(a: Series, exponent: Any) -> Series:
    """Return a power of a series that begins with 1, by Miller's recurrence."""
    result = [a[0]]
    for k in range(1, len(a)):
        terms = [(exponent * j - a[0] * (k - j)) * a[j] * result[k - j] for j in range(1, k + 1)]
        result.append(sum(terms, a[0] * 0) / k)
    return result


def square_of_angle(cosine: Series) -> Series:
    """Return the square of an angle with a cosine that begins with 1: ``sum 2 (2 y)^k/(k^2 C(2k, k))``, y = 1 - cos."""
    nothing = cosine[0] * 0
    y = [nothing] + [-value for value in cosine[1:]]
    total, rise = [nothing] * len(y), [cosine[0]] + [nothing] * (len(y) - 1)
    for k in range(1, len(y)):
        rise = times(rise, y)
        above, below = 2 ** (k + 1), k * k * math.comb(2 * k, k)
        total = [a + b * above / below for a, b in zip(total, rise, strict=True)]
    return total


def divided(polynomial: Sequence[Series], trace: Series, determinant: Series) -> list[Series]:
    """Divide a polynomial, the highest power first, by ``x^2 - T x + D``: the quotient, then two numbers left."""
    quotient: list[Series] = []
    for k, coefficient in enumerate(polynomial):
        value = coefficient
        if k > 0:
            product = times(trace, quotient[-1])
            value = [a + b for a, b in zip(value, product, strict=True)]
        if k > 1:
            product = times(determinant, quotient[-2])
            value = [a - b for a, b in zip(value, product, strict=True)]
        quotient.append(value)
    return quotient


def principal(polynomial: Sequence[Series]) -> tuple[Series, Series]:
    """Return T and D of the factor ``x^2 - T x + D`` that is ``(x - 1)^2`` at P = 0, coefficient by coefficient.

    The quotient at P = 0 has no root 1 in a scheme that converges, so the factor exists and is unique (Hensel).
    """
    one, zero = polynomial[0][0], polynomial[0][0] * 0
    length = len(polynomial[0])
    trace, determinant = ([value] + [zero] * (length - 1) for value in (2 * one, one))
    if len(polynomial) == 3:
        return [-value for value in polynomial[1]], list(polynomial[2])
    rest = [row[0] for row in divided(polynomial, trace, determinant)[:-2]]
    # of the rest q(x) modulo (x - 1)^2: q(1) and q'(1)
    value = sum(rest, zero)
    degree = len(rest) - 1
    slope = sum(((degree - k) * entry for k, entry in enumerate(rest)), zero)
    for k in range(1, length):
        *_, by_x, left = divided(polynomial, trace, determinant)
        # what is left is a x + c at this power of P, so (d_determinant - d_trace x) q(x) = a x + c modulo (x - 1)^2
        a, c = by_x[k], left[k] - 2 * by_x[k]
        at_one = (a + c) / value
        d_trace = (at_one * slope - a) / value
        trace[k] = trace[k] + d_trace
        determinant[k] = determinant[k] + d_trace + at_one
    return trace, determinant
