r"""General power, ``x^y = e^(y log x)`` with the logarithm in two doubles.

The logarithm has an error of 2^-63 of it, and y log x is below 746 in size, so that the result has a relative error of
2^-53.5 before its last rounding. Special values are those of IEEE 754 (C99, annex F.9.4.4).

Source: J.-M. Muller, Elementary Functions, 3rd ed. (2016), section 11.3.
"""

from __future__ import annotations

import math

from vibsim.elementary.doubled import nearest_whole, two_product, two_sum
from vibsim.elementary.exponential import exp_parts, scaled, within
from vibsim.elementary.logarithm import log_parts

_LARGEST_DOUBLE = 1.7976931348623157e308
_LARGEST_FAST_EXPONENT = 1.0e9
_LARGEST_WHOLE = 9007199254740992.0  # 2^53: every double from there on is even
_SATURATED = 1.0e20  # no double but 1 has a finite power of this size other than 0


def power(base: float, exponent: float) -> float:
    """Return ``base^exponent`` for every pair of doubles, error below 1 unit in the last place."""
    if exponent == 0.0 or base == 1.0:
        return 1.0
    if base != base or exponent != exponent:
        return math.nan
    size = abs(base)
    odd, whole = parity(exponent)
    if base < 0.0 and not whole and size < math.inf:
        return math.nan
    sign = -1.0 if odd and (base < 0.0 or is_minus_zero(base)) else 1.0
    if size == 1.0:
        return sign
    if size == 0.0 or size > _LARGEST_DOUBLE:
        return sign * (0.0 if (size == 0.0) == (exponent > 0.0) else math.inf)
    y = _SATURATED if exponent > _SATURATED else exponent
    return sign * power_of(size, -_SATURATED if y < -_SATURATED else y)


def power_fast(base: float, exponent: float) -> float:
    r"""Return `power` for finite base > 0 with any exponent up to 1e9 in size.

    Also for base < 0 and whole exponents, and for base = 0 and exponents > 0 that are not odd; else NaN.
    """
    size = abs(base)
    bounded = abs(exponent) <= _LARGEST_FAST_EXPONENT
    usual = (size > 0.0) & (size <= _LARGEST_DOUBLE) & bounded
    value = power_of(size if usual else 1.0, exponent if usual else 1.0)
    nearest = nearest_whole(exponent)
    whole = nearest == exponent
    even = 2.0 * nearest_whole(0.5 * nearest) == nearest
    negative = (value if even else -value) if whole else math.nan
    value = negative if base < 0.0 else value
    value = value if usual else math.nan
    vanishes = (base == 0.0) & (exponent > 0.0) & bounded & (even | (not whole))
    return 0.0 if vanishes else value


def power_of(x: float, y: float) -> float:
    r"""Return ``x^y`` for finite x > 0 and \|y\| <= 1e20."""
    a, a_behind = log_parts(x)
    t, behind = two_product(y, a)
    t, behind = two_sum(t, behind + y * a_behind)
    usual = abs(t) < 745.5
    k, value, rest = exp_parts(within(t), behind if usual else 0.0)
    return scaled(value + rest, k)


def parity(y: float) -> tuple[bool, bool]:
    """Tell whether `y` is an odd, and whether it is a whole number, for y other than 0; infinities are even."""
    if abs(y) < 1.0:
        return False, False
    if abs(y) >= _LARGEST_WHOLE:
        return False, True
    half = 0.5 * abs(y)
    below = float(int(half))
    return half - below == 0.5, half - below == 0.5 or half == below


def is_minus_zero(x: float) -> bool:
    """Tell -0 from 0."""
    return x == 0.0 and math.copysign(1.0, x) < 0.0
