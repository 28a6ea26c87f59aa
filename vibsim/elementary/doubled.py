"""Rounding to integers, and error-free sums and products, without a library call or fused multiply-add.

A number "in two parts" is an unevaluated sum of two doubles, the larger part first. The smaller part of ``x`` is called
``x_behind`` throughout this package. The sums and products serve arrays as well as floats.

Source: T. J. Dekker, A floating-point technique for extending the available precision, Numerische Mathematik 18 (1971);
J.-M. Muller et al., Handbook of Floating-Point Arithmetic, 2nd ed. (2018), sections 4.3 and 4.4.
"""

from __future__ import annotations

import math
from typing import TypeVar

from vibsim.core.array_types import Floats

Real = TypeVar("Real", float, Floats)

_SPLIT = 134217729.0  # 2^27 + 1
_ROUND = 6755399441055744.0  # 1.5 * 2^52: doubles of this size are integers


def nearest_whole(x: float) -> float:
    r"""Return the integer nearest to `x`, ties to even, for \|x\| <= 2^51."""
    return (x + _ROUND) - _ROUND


def two_product(a: Real, b: Real) -> tuple[Real, Real]:
    """Return ``a b`` rounded, and its error; exact without over- and underflow (sizes up to 2^996)."""
    c = _SPLIT * a
    a_1 = c - (c - a)
    a_2 = a - a_1
    c = _SPLIT * b
    b_1 = c - (c - b)
    b_2 = b - b_1
    p = a * b
    return p, ((a_1 * b_1 - p) + a_1 * b_2 + a_2 * b_1) + a_2 * b_2


def two_sum(a: Real, b: Real) -> tuple[Real, Real]:
    """Return ``a + b`` rounded, and its error."""
    s = a + b
    part = s - a
    return s, (a - (s - part)) + (b - part)


def fast_two_sum(a: Real, b: Real) -> tuple[Real, Real]:
    r"""Return ``a + b`` rounded, and its error, for \|a\| >= \|b\| or a = 0."""
    s = a + b
    return s, b - (s - a)


def quotient(a: float, a_behind: float, b: float, b_behind: float) -> float:
    r"""Return ``(a + a_behind)/(b + b_behind)`` with an error below 0.51 units in the last place.

    b must not be zero, and the size of the quotient must be between 2^-960 and 2^990.
    """
    q, behind = quotient_parts(a, a_behind, b, b_behind)
    return q + behind


def quotient_parts(a: float, a_behind: float, b: float, b_behind: float) -> tuple[float, float]:
    """Return the same quotient in two parts."""
    a, a_behind = fast_two_sum(a, a_behind)
    b, b_behind = fast_two_sum(b, b_behind)
    inverse = 1.0 / b
    q = a * inverse
    p, error = two_product(q, b)
    return q, (((a - p) - error) + (a_behind - q * b_behind)) * inverse


def root_parts(h: float, behind: float) -> tuple[float, float]:
    """Return ``sqrt(h + behind)`` in two parts; 0 for h below 0."""
    root = math.sqrt(h if h > 0.0 else 0.0)
    p, error = two_product(root, root)
    return root, 0.5 * (((h - p) - error) + behind) / (root if root > 0.0 else 1.0)
