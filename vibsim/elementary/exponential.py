r"""Exponential function, and what it has above 1.

``e^x = 2^k e^r`` with ``k = round(x/ln 2)``, so that \|r\| <= 0.3466, and ``e^r = 1 + r + r^2/2 + r^3 P(r)``, P of
degree 8 (Remez with rounded coefficients, relative error 6e-18). ln 2 is in two parts, the first of 40 bits, so that
its product with k is exact. For ``e^x - 1`` the 1 is taken away before the parts are added.

Source: W. J. Cody and W. Waite, Software Manual for the Elementary Functions (1980), chapter 6; J.-M. Muller,
Elementary Functions, 3rd ed. (2016), section 11.3.
"""

from __future__ import annotations

from vibsim.elementary.doubled import fast_two_sum, nearest_whole, two_product, two_sum
from vibsim.elementary.primitives import two_to

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
    # where 1 is too small to count it need not be right
    a, a_cut = two_sum(a, -two_to(-100.0 if k > 100.0 else -k))
    a, z_cut = two_sum(a, 0.5 * z)
    far = scaled(a + ((cut + a_cut) + (z_cut + (behind + behind * r)) + rest), k)
    value = near + (near_cut + rest) if k == 0.0 else far
    return value if abs(x) > 0.0 else x


def within(x: float) -> float:
    """Return `x` or the nearest number whose exponential has a value of its own; NaN for NaN."""
    x = 710.0 if x > 710.0 else x
    return -746.0 if x < -746.0 else x


def scaled(x: float, k: float) -> float:
    """Return ``x 2^k`` for whole k in -2044 ... 2046, rounded once where it is subnormal."""
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
