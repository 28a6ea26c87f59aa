r"""Logarithms: the natural one in a double and in two, and from the latter those to base 10 and 2 and of 1 + x.

``x = 2^k m`` with m in [sqrt(1/2), sqrt(2)), ``s = (m - 1)/(m + 1)``, ``log m = 2 artanh s`` with \|s\| <= 0.1716.

Source: J.-M. Muller, Elementary Functions, 3rd ed. (2016), section 11.3; J.-M. Muller et al., Handbook of
Floating-Point Arithmetic, 2nd ed. (2018), section 4.7 for the division in two parts.
"""

from __future__ import annotations

import math

from vibsim.elementary.doubled import fast_two_sum, quotient_parts, two_product, two_sum
from vibsim.elementary.exponential import LN_2_1, LN_2_2, LN_2_3
from vibsim.elementary.primitives import exponent_of, mantissa_of, two_to

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


def log(x: float) -> float:
    """Return the natural logarithm, error below 1 unit in the last place; -inf for zero, NaN below."""
    # a stand-in where there is no logarithm: plain Python refuses to divide by zero
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
    # where the rest is too small to count it need not be right
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
