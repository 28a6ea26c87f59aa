r"""Exponential function, logarithms, powers, cube root, and the length of a vector.

``e^x = 2^k e^r`` with ``k = round(x/ln 2)``, so that \|r\| <= 0.3466, and ``e^r = 1 + r + r^2/2 + r^3 P(r)``, P of
degree 8 (Remez with rounded coefficients, relative error 6e-18). ln 2 is in two parts, the first of 40 bits, so that
its product with k is exact. For ``e^x - 1`` the 1 is subtracted before the parts are added.

Logarithms: ``x = 2^k m`` with m in [sqrt(1/2), sqrt(2)), ``s = (m - 1)/(m + 1)``, ``log m = 2 artanh s`` with \|s\| <=
0.1716.

The general power is ``x^y = e^(y log x)`` with the logarithm in two doubles. The logarithm has a relative error of
2^-63, and y log x is below 746 in size, so the result has a relative error of 2^-53.5 before its last rounding. Special
values are those of IEEE 754 (C99, annex F.9.4.4).

The cube root: ``x = 2^(3j) m`` with m in [1/2, 4). A cubic polynomial (relative error 5e-3) and one step of Halley's
method give the root of m to 1e-7. Rounded to 17 bits it is t, whose cube is exact, and the root is ``t (1 + d)^(1/3)``
with ``d = (m - t^3)/t^3`` below 2^-14, by three terms of the series.

``sqrt(x^2 + y^2)`` uses the squares in two parts, scaled against over- and underflow.

Source: W. J. Cody and W. Waite, Software Manual for the Elementary Functions (1980), chapter 6; J.-M. Muller,
Elementary Functions, 3rd ed. (2016), section 11.3, and 5.3 for the cube root; J.-M. Muller et al., Handbook of
Floating-Point Arithmetic, 2nd ed. (2018), section 4.7 for the division in two parts and the length of a vector.
"""

from __future__ import annotations

import math

from vibsim.elementary.doubled import (
    fast_two_sum,
    nearest_whole,
    quotient_parts,
    root_parts,
    two_product,
    two_sum,
)
from vibsim.elementary.primitives import exponent_of, mantissa_of, two_to

_PER_LN_2 = float.fromhex("0x1.71547652b82fep+0")
LN_2_1 = float.fromhex("0x1.62e42fefa2000p-1")
LN_2_2 = float.fromhex("0x1.9ef35793c7673p-41")
LN_2_3 = float.fromhex("0x1.f97b57a079a19p-103")
"""ln 2 in three parts, the first of 40 bits."""

_ALL_BUT_ONE = -40.0  # the exponential is lost beside 1

_E3, _E4, _E5, _E6, _E7, _E8, _E9, _E10, _E11 = (
    0.16666666666666685, 0.0416666666666028, 0.008333333333314527, 0.0013888888927278214,
    0.00019841269903775335, 2.480150806978095e-05, 2.755722712364467e-06, 2.762543121504282e-07,
    2.5114707468091334e-08,
)  # fmt: skip
_SQRT_2 = math.sqrt(2.0)
_SMALLEST_NORMAL = 2.2250738585072014e-308
_LARGEST_DOUBLE = 1.7976931348623157e308
_TO_NORMAL = 18014398509481984.0  # 2^54

_LOG_IS_ARGUMENT = 1.0e-20
_PER_LN_10 = float.fromhex("0x1.bcb7b1526e50ep-2")
_PER_LN_10_BEHIND = float.fromhex("0x1.95355baaafad3p-57")
_ONE_BY_LN_2 = float.fromhex("0x1.71547652b82fep+0")
_ONE_BY_LN_2_BEHIND = float.fromhex("0x1.777d0ffda0d24p-56")

_L3, _L5, _L7, _L9, _L11, _L13, _L15 = (
    0.6666666666666734, 0.39999999999416536, 0.2857142874206495, 0.22222198600198292,
    0.18183563155536964, 0.1531407577843551, 0.1479573647495932,
)  # fmt: skip

_A3 = 1.0 / 3.0
_A3_BEHIND = float.fromhex("0x1.5555555555555p-56")
_A5, _A7, _A9, _A11, _A13, _A15, _A17, _A19 = (
    0.1999999999999999, 0.1428571428572192, 0.11111111108894807, 0.09090909422013156,
    0.07692279212538565, 0.06668132336811912, 0.058378882071781546, 0.05990897398434355,
)  # fmt: skip
_LARGEST_FAST_EXPONENT = 1.0e9
_LARGEST_WHOLE = 9007199254740992.0  # 2^53: every double from there on is even
_SATURATED = 1.0e20  # no double but 1 has a finite power of this size other than 0
_THIRD = 1.0 / 3.0
_NINTH = 1.0 / 9.0
_FIVE_81STS = 5.0 / 81.0
_SIXTEENTH_BIT = 103079215104.0  # 1.5 * 2^36: adding and subtracting it leaves multiples of 2^-16
_ROOT_0, _ROOT_1, _ROOT_2, _ROOT_3 = (
    0.5412370328856352, 0.5782147247179539, -0.13724285601652703, 0.014646532187668952,
)  # fmt: skip
_LONG = 2.0**500
_SHORT = 2.0**-400
_SHORTER = 2.0**-600
_LONGER = 2.0**600


def exp(x: float) -> float:
    """Return ``e^x`` for every double, error below 1 unit in the last place; a subnormal result is rounded twice."""
    k, value, behind = exp_parts(within(x), 0.0)
    return scaled(value + behind, k)


def expm1(x: float) -> float:
    """Return ``e^x - 1`` for every double, error below 1 unit in the last place."""
    y = _ALL_BUT_ONE if x < _ALL_BUT_ONE else within(x)
    k, r, behind, p = exp_reduced(y, 0.0)
    z, z_behind = two_product(r, r)
    rest = 0.5 * z_behind + (r * z) * p
    # k = 0: nothing cancels
    near, near_cut = fast_two_sum(r, 0.5 * z)
    a, cut = fast_two_sum(1.0, r)
    # a 1 that is too small to matter need not be accurate
    a, a_cut = two_sum(a, -two_to(-100.0 if k > 100.0 else -k))
    a, z_cut = two_sum(a, 0.5 * z)
    far = scaled(a + ((cut + a_cut) + (z_cut + (behind + behind * r)) + rest), k)
    value = near + (near_cut + rest) if k == 0.0 else far
    return value if abs(x) > 0.0 else x


def within(x: float) -> float:
    """Return `x` limited to the range in which the exponential neither overflows nor vanishes; NaN for NaN."""
    x = 710.0 if x > 710.0 else x
    return -746.0 if x < -746.0 else x


def scaled(x: float, k: float) -> float:
    """Return ``x 2^k`` for an integer k in -2044 ... 2046, rounded once if the result is subnormal."""
    half = nearest_whole(0.5 * k)
    return x * two_to(half) * two_to(k - half)


def exp_parts(x: float, rest: float) -> tuple[float, float, float]:
    r"""Return k, a and b with ``e^(x + rest) = 2^k (a + b)``, \|x\| <= 746."""
    k, r, behind, p = exp_reduced(x, rest)
    value, cut = fast_two_sum(1.0, r)
    return k, value, (cut + (behind + behind * r)) + (r * r) * (0.5 + r * p)


def exp_reduced(x: float, rest: float) -> tuple[float, float, float, float]:
    r"""Return k, r, b and P(r) with ``e^(x + rest) = 2^k e^(r + b)``, \|x\| <= 746."""
    k = nearest_whole(x * _PER_LN_2)
    coarse = x - k * LN_2_1
    r, behind = two_sum(coarse, rest - k * LN_2_2)
    z = r * r
    low = (_E3 + r * _E4) + z * (_E5 + r * _E6)
    high = (_E7 + r * _E8) + z * (_E9 + r * _E10)
    return k, r, behind, low + (z * z) * (high + (z * z) * _E11)


def log(x: float) -> float:
    """Return the natural logarithm, error below 1 unit in the last place; -inf for zero, NaN below."""
    # 1 replaces arguments without a logarithm, because plain Python raises for a division by zero
    k, m = halves(x if x > 0.0 else 1.0)
    f = m - 1.0
    s = f / (2.0 + f)
    z = s * s
    z2 = z * z
    p = ((_L3 + z * _L5) + z2 * (_L7 + z * _L9)) + (z2 * z2) * ((_L11 + z * _L13) + z2 * _L15)
    # log m = f - f^2/2 + s (f^2/2 + z P): the largest parts are exact or small
    square = 0.5 * f * f
    value, behind = fast_two_sum(k * LN_2_1, f)
    value, cut = two_sum(value, -square)
    value = value + ((behind + cut) + (s * (square + z * p) + k * LN_2_2))
    value = math.inf if x > _LARGEST_DOUBLE else value
    value = -math.inf if x == 0.0 else value
    return value if x >= 0.0 else math.nan


def log10(x: float) -> float:
    """Return the logarithm to base 10, error below 1 unit in the last place; -inf for zero, NaN below."""
    return log_to_base(x, _PER_LN_10, _PER_LN_10_BEHIND)


def log2(x: float) -> float:
    """Return the logarithm to base 2, error below 1 unit in the last place; -inf for zero, NaN below."""
    return log_to_base(x, _ONE_BY_LN_2, _ONE_BY_LN_2_BEHIND)


def log1p(x: float) -> float:
    """Return ``log(1 + x)``, error below 1 unit in the last place; -inf for -1, NaN below."""
    u, rest = two_sum(1.0, x if (x > -1.0) & (x <= _LARGEST_DOUBLE) else 0.0)
    value, behind = log_of_sum(u, rest, 0.0)
    value = value + behind if abs(x) > _LOG_IS_ARGUMENT else x
    value = math.inf if x > _LARGEST_DOUBLE else value
    value = -math.inf if x == -1.0 else value
    return value if x >= -1.0 else math.nan


def log_to_base(x: float, factor: float, factor_behind: float) -> float:
    """Return the logarithm times a factor in two parts."""
    a, behind = log_parts(x if (x > 0.0) & (x <= _LARGEST_DOUBLE) else 1.0)
    value, error = two_product(a, factor)
    value = value + (error + (a * factor_behind + behind * factor))
    value = math.inf if x > _LARGEST_DOUBLE else value
    value = -math.inf if x == 0.0 else value
    return value if x >= 0.0 else math.nan


def halves(x: float) -> tuple[float, float]:
    """Return k and m with ``x = 2^k m`` and m in [sqrt(1/2), sqrt(2)), for finite x > 0."""
    tiny = x < _SMALLEST_NORMAL
    normal = x * _TO_NORMAL if tiny else x
    k = exponent_of(normal)
    k = k - 54.0 if tiny else k
    m = mantissa_of(normal)
    upper = m > _SQRT_2
    return k + 1.0 if upper else k, 0.5 * m if upper else m


def log_parts(x: float) -> tuple[float, float]:
    """Return the logarithm of finite x > 0 in two parts, error below 2^-63 of it."""
    k, m = halves(x)
    f = m - 1.0
    # s in two parts; m + 1 is a sum of two
    bottom, bottom_behind = fast_two_sum(2.0, f)
    inverse = 1.0 / bottom
    s = f * inverse
    p, error = two_product(s, bottom)
    s_behind = (((f - p) - error) - s * bottom_behind) * inverse
    return log_from(k, s, s_behind)


def log_of_sum(x: float, rest: float, doublings: float) -> tuple[float, float]:
    """Return the logarithm of ``2^doublings (x + rest)`` in two parts, for normal x and a rest within its last bit."""
    k, m = halves(x)
    # a rest that is too small to matter need not be accurate
    rest = rest * two_to(-100.0 if k > 100.0 else -k)
    f = m - 1.0
    bottom, cut = fast_two_sum(2.0, f)
    s, s_behind = quotient_parts(f, rest, bottom, cut + rest)
    return log_from(k + doublings, s, s_behind)


def log_from(k: float, s: float, s_behind: float) -> tuple[float, float]:
    """Return ``k log 2 + 2 artanh(s + s_behind)`` in two parts."""
    value, behind = artanh_doubled(s, s_behind)
    value, cut = fast_two_sum(k * LN_2_1, value)
    middle, middle_behind = two_sum(k * LN_2_2, cut)
    value, cut = fast_two_sum(value, middle)
    behind += cut + (middle_behind + k * LN_2_3)
    return fast_two_sum(value, behind)


def artanh_doubled(s: float, s_behind: float) -> tuple[float, float]:
    r"""Return ``2 artanh(s + s_behind)`` in two parts, \|s\| <= 0.172."""
    # z = s^2, also in two
    z, z_behind = two_product(s, s)
    z_behind += 2.0 * s * s_behind
    z2 = z * z
    low = (_A5 + z * _A7) + z2 * (_A9 + z * _A11)
    high = (_A13 + z * _A15) + z2 * (_A17 + z * _A19)
    q = z * (low + (z2 * z2) * high)
    third, third_behind = fast_two_sum(_A3, q)
    third_behind += _A3_BEHIND
    # artanh s = s + s z third
    t, t_behind = two_product(z, third)
    t_behind += z * third_behind + z_behind * third
    cubic, cubic_behind = two_product(s, t)
    cubic_behind += s * t_behind + s_behind * t
    value, behind = fast_two_sum(2.0 * s, 2.0 * cubic)
    return value, behind + 2.0 * (s_behind + cubic_behind)


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
    r"""Return `power` for exponents up to 1e9 in size and finite base > 0.

    Also for base < 0 and integer exponents, and for base = 0 and exponents > 0 that are not odd; otherwise NaN.
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
    """Tell whether `y` is odd, and whether it is an integer, for y other than 0; infinities are even."""
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


def cbrt(x: float) -> float:
    """Return the cube root for every double, error below 1 unit in the last place."""
    y = abs(x)
    usual = (y > 0.0) & (y <= _LARGEST_DOUBLE)
    y = y if usual else 1.0
    tiny = y < _SMALLEST_NORMAL
    y = y * _TO_NORMAL if tiny else y
    e = exponent_of(y)
    j = nearest_whole(e * _THIRD)
    m = mantissa_of(y) * two_to(e - 3.0 * j)
    t = (_ROOT_0 + m * _ROOT_1) + (m * m) * (_ROOT_2 + m * _ROOT_3)
    cube = t * t * t
    t = t * ((cube + 2.0 * m) / (2.0 * cube + m))
    t = (t + _SIXTEENTH_BIT) - _SIXTEENTH_BIT
    cube = t * t * t
    d = (m - cube) / cube
    value = t + t * d * (_THIRD - d * (_NINTH - d * _FIVE_81STS))
    value = value * two_to(j - 18.0 if tiny else j)
    value = value if x > 0.0 else -value
    return value if usual else x


def hypot(x: float, y: float) -> float:
    """Return ``sqrt(x^2 + y^2)`` for every pair of doubles, error below 1 unit in the last place; NaN where one is."""
    a, b = abs(x), abs(y)
    size = a if a > b else b
    is_long, is_short = size > _LONG, size < _SHORT
    scale = _SHORTER if is_long else 1.0
    scale = _LONGER if is_short else scale
    back = _LONGER if is_long else 1.0
    back = _SHORTER if is_short else back
    p, p_behind = two_product(a * scale, a * scale)
    q, q_behind = two_product(b * scale, b * scale)
    h, cut = two_sum(p, q)
    root, behind = root_parts(h, cut + (p_behind + q_behind))
    value = (root + behind) * back
    value = math.inf if size > _LARGEST_DOUBLE else value
    return value if (x == x) & (y == y) else math.nan
