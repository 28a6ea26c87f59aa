r"""Sine, cosine and tangent.

``r = x - k pi`` with pi in three parts (Cody and Waite; k times a part of 35 bits is exact for \|k\| < 2^17), then
``r + r^3 P(r^2)`` on [-pi/2, pi/2], P of degree 7 (least squares with rounded coefficients, relative error 5e-19),
summed in Estrin's form because the longest chain of dependent operations determines the cost of a step. The rounding
error of r is included to first order. The cosine is the same with k half way between integers. Beyond 1e5, about 15 000
turns, the reduction is done in integer arithmetic.

Sines and cosines dominate the cost of a pendulum, and errors of two units in the last place of the force do not matter
there. For intermediate results (the tangent), and beyond 1e5, `sine_parts` gives the sine in two parts:
``r - r^3/6 + r^5 Q(r^2)``, Q of degree 6 (Remez, relative error 4e-19), the larger part of the cubic term exact.

The tangent is the quotient of sine and cosine, both in two parts.

Reduction in integer arithmetic: ``x = M 2^E`` with an integer M < 2^53. Only those digits of 1/pi are used whose
product with x is neither a multiple of a full turn nor negligible: seven digits of 30 bits, whose products are exact in
64 bits. They leave an error of 2^-127 of half a turn. No double is closer to a multiple of pi/2 than about 2^-62, so
the remainder has at least 64 correct bits.

Source: W. J. Cody and W. Waite, Software Manual for the Elementary Functions (1980), chapter 8; M. Payne and R. Hanek,
Radian reduction for trigonometric functions, SIGNUM Newsletter 18 (1983); J.-M. Muller, Elementary Functions, 3rd ed.
(2016), section 11.4.
"""

from __future__ import annotations

import math

from vibsim.elementary.doubled import fast_two_sum, nearest_whole, quotient, two_product
from vibsim.elementary.primitives import exponent_of, mantissa_of, two_to

# 1/pi in digits of 30 bits; the leading zeros let every argument begin after the first digit
_INVERSE_PI_DIGITS = (
    0, 0,
    341782637, 846340265, 335040175, 687512174, 941321298, 751428124, 545520802, 836104029,
    950810340, 594661906, 463847436, 613905668, 976372639, 820992229, 575884925, 876681978,
    634874000, 659350401, 224968444, 547145963, 120613479, 262464546, 1058503666, 337481724,
    318766016, 750813049, 505616052, 87461814, 651155940, 1045974458, 512523981, 254801174,
    782563160, 1063202699, 913968755, 1002776905, 491618155, 1032387690, 974171142,
)  # fmt: skip
_DIGIT = 1073741823  # 2^30 - 1
_SMALL = 2.0**-30
HALF_PI = float.fromhex("0x1.921fb54442d18p+0")
HALF_PI_REST = float.fromhex("0x1.1a62633145c07p-54")
"""The second part of pi/2."""

LARGEST_ANGLE = 1.0e5
_NO_HALF_TURN = 3.14  # a little below pi: the nearest multiple is found from a rounded quotient
_ONE_HALF_TURN = 4.71  # a little below 3 pi/2
PER_PI = float.fromhex("0x1.45f306dc9c883p-2")
_PI_1 = float.fromhex("0x1.921fb54440000p+1")
_PI_2 = float.fromhex("0x1.68c234c4c0000p-38")
_PI_3 = float.fromhex("0x1.98a2e03707345p-76")
_TWELFTH_BIT = 1649267441664.0  # 1.5 * 2^40: adding and subtracting it leaves multiples of 2^-12

_S3 = -1.0 / 6.0
_S3_1 = float.fromhex("-0x1.5554p-3")
_S3_2 = float.fromhex("-0x1.5555555555555p-19")
_S5, _S7, _S9, _S11, _S13, _S15, _S17 = (
    0.008333333333333283, -0.000198412698412353, 2.755731921493914e-06, -2.5052107177645754e-08,
    1.6058953403234195e-10, -7.643314997525792e-13, 2.724302774578837e-15,
)  # fmt: skip

_SHORT_5, _SHORT_7, _SHORT_9, _SHORT_11, _SHORT_13, _SHORT_15, _SHORT_17 = (
    0.008333333333333196, -0.00019841269841207676, 2.7557319210712077e-06,
    -2.5052106827436554e-08, 1.6058937294379453e-10, -7.64292780231204e-13,
    2.720508082623873e-15,
)  # fmt: skip


def sin(x: float) -> float:
    """Return the sine of `x` [rad], error below 2.5 units in the last place; NaN for NaN and infinities.

    The sine of -0 is 0: its sign would cost a twentieth of a step.
    """
    if abs(x) <= HALF_PI:
        # k = 0: the same result as below, with less latency
        return sine_of(x, 0.0)
    if abs(x) <= _ONE_HALF_TURN:
        # k = 1 or -1: likewise
        r, rest = reduced(x, 1.0 if x > 0.0 else -1.0, -1.0)
        return sine_of(r, rest)
    if abs(x) <= LARGEST_ANGLE:
        k = nearest_whole(x * PER_PI)
        r, rest = reduced(x, k, parity_sign(k))
        return sine_of(r, rest)
    if abs(x) < math.inf:
        value, behind = sine_far(abs(x), 0)
        return value + behind if x > 0.0 else -(value + behind)
    return math.nan


def sin_fast(x: float) -> float:
    r"""Return `sin` for \|x\| <= 1e5, else NaN."""
    k = nearest_whole(x * PER_PI)
    r, rest = reduced(x, k, parity_sign(k))
    value = sine_of(r, rest)
    return value if abs(x) <= LARGEST_ANGLE else math.nan


def cos(x: float) -> float:
    """Return the cosine of `x` [rad], error below 2.5 units in the last place; NaN for NaN and infinities."""
    y = abs(x)
    if y <= _NO_HALF_TURN:
        # k = 1/2: the same result as below without the latency of finding it
        r, rest = reduced_half(y, 0.5, -1.0)
        return sine_of(r, rest)
    if y <= LARGEST_ANGLE:
        whole = nearest_whole(y * PER_PI - 0.5)
        r, rest = reduced_half(y, whole + 0.5, -parity_sign(whole))
        return sine_of(r, rest)
    if y < math.inf:
        value, behind = sine_far(y, 1)
        return value + behind
    return math.nan


def cos_fast(x: float) -> float:
    r"""Return `cos` for \|x\| <= 1e5, else NaN."""
    y = abs(x)
    whole = nearest_whole(y * PER_PI - 0.5)
    r, rest = reduced_half(y, whole + 0.5, -parity_sign(whole))
    value = sine_of(r, rest)
    return value if y <= LARGEST_ANGLE else math.nan


def parity_sign(k: float) -> float:
    """Return 1 for even and -1 for odd integers k."""
    odd = k - 2.0 * nearest_whole(0.5 * k)
    return 1.0 - 2.0 * (odd * odd)


def reduced(x: float, k: float, sign: float) -> tuple[float, float]:
    """Return r and `rest` with ``x = k pi + sign (r + rest)``, for k or k + 1/2 an integer."""
    coarse = x - k * _PI_1
    fine = k * _PI_2
    r = coarse - fine
    return sign * r, sign * (((coarse - r) - fine) - k * _PI_3)


def reduced_half(y: float, k: float, sign: float) -> tuple[float, float]:
    """Return the same for ``y >= 0`` and k + 1/2 an integer; for y < 1, ``y - pi/2`` is not exact."""
    r, rest = reduced(y, k, sign)
    far = k * _PI_1
    return r, rest + sign * (y - ((y - far) + far))


def sine_of(r: float, rest: float) -> float:
    r"""Return the sine of ``r + rest``, \|r\| <= pi/2, error below 2.5 units in the last place."""
    z = r * r
    z2 = z * z
    low = (_S3 + z * _SHORT_5) + z2 * (_SHORT_7 + z * _SHORT_9)
    high = (_SHORT_11 + z * _SHORT_13) + z2 * (_SHORT_15 + z * _SHORT_17)
    p = low + (z2 * z2) * high
    # cos r to the few digits that the rest deserves
    return r + ((r * z) * p + rest * (1.0 - z * (0.5 - z * (1.0 / 24.0))))


def sine_parts(r: float, rest: float) -> tuple[float, float]:
    r"""Return the sine of ``r + rest``, \|r\| <= pi/2, in two parts."""
    # w^3 * _S3_1 is exact: w has 13 bits, the factor 15
    w = (r + _TWELFTH_BIT) - _TWELFTH_BIT
    z = r * r
    cube = w * w * w
    cubic = cube * _S3_1
    s = r + cubic
    small = cube * _S3_2 + _S3 * ((r - w) * (z + w * (r + w)))
    # cos r to the few digits that the rest deserves
    turned = rest * (1.0 - z * (0.5 - z * (1.0 / 24.0)))
    z2 = z * z
    low = (_S5 + z * _S7) + z2 * (_S9 + z * _S11)
    high = (_S13 + z * _S15) + z2 * _S17
    q = low + (z2 * z2) * high
    return s, (((r - s) + cubic) + (small + turned)) + (r * z2) * q


def sine_far(y: float, quarters: int) -> tuple[float, float]:
    """Return the sine of ``y + quarters pi/2`` for finite y >= 1 in two parts, with integer reduction."""
    q, r, rest = quarter_turns(y)
    q = (q + quarters) & 3
    sign = 1.0 if q < 2 else -1.0
    if q & 1 == 1:
        # cos r = sin(pi/2 - |r|)
        rest = rest if r < 0.0 else -rest
        near = HALF_PI - abs(r)
        rest += ((HALF_PI - near) - abs(r)) + HALF_PI_REST
        r = near
    return sine_parts(sign * r, sign * rest)


def tan(x: float) -> float:
    """Return the tangent of `x` [rad], error below 1 unit in the last place; NaN for NaN and infinities."""
    y = abs(x)
    if y <= LARGEST_ANGLE:
        return tangent_near(x) if x != 0.0 else x
    if y < math.inf:
        s, s_behind = sine_far(y, 0)
        c, c_behind = sine_far(y, 1)
        value = quotient(s, s_behind, c, c_behind)
        return value if x > 0.0 else -value
    return math.nan


def tan_fast(x: float) -> float:
    r"""Return `tan` for \|x\| <= 1e5, else NaN."""
    value = tangent_near(x)
    value = x if x == 0.0 else value
    return value if abs(x) <= LARGEST_ANGLE else math.nan


def tangent_near(x: float) -> float:
    r"""Return the tangent for 0 < \|x\| <= 1e5."""
    k = nearest_whole(x * PER_PI)
    r, rest = reduced(x, k, 1.0)
    s, s_behind = sine_parts(r, rest)
    # sine and cosine of r = x - k pi; for odd k both have the opposite sign, which cancels
    y = abs(r)
    r, rest_c = reduced_half(y, 0.5, -1.0)
    c, c_behind = sine_parts(r, rest_c - (rest if s > 0.0 else -rest))
    return quotient(s, s_behind, c, c_behind)


def quarter_turns(y: float) -> tuple[int, float, float]:
    r"""Return q in 0 ... 3, r and `rest` with ``y = (q + 4 n) pi/2 + r + rest``, \|r\| <= pi/4.

    For finite y >= 1; error below 2^-64 of r.
    """
    exponent = int(exponent_of(y)) + 8
    first = (exponent - 1) // 30
    shift = 30 * (first + 1) - exponent
    whole = int(mantissa_of(y) * 4503599627370496.0)
    high, low = whole >> 30, whole & _DIGIT
    # the digits of M/pi, the last first, by schoolbook multiplication
    behind = carry = 0
    d_6 = d_5 = d_4 = d_3 = d_2 = d_1 = 0
    for j in range(first + 6, first - 1, -1):
        digit = _INVERSE_PI_DIGITS[j]
        carry += low * digit + high * behind
        d_1, d_2, d_3, d_4, d_5, d_6 = d_2, d_3, d_4, d_5, d_6, carry & _DIGIT
        carry >>= 30
        behind = digit
    unit = 1 << (29 + shift)
    leading = ((d_6 & ((2 << shift) - 1)) << 30) + d_5
    q = (leading + (unit >> 1)) // unit
    leading -= q * unit
    sign = 1.0
    if leading < 0:
        sign = -1.0
        leading = -1 - leading
        d_4, d_3, d_2, d_1 = _DIGIT - d_4, _DIGIT - d_3, _DIGIT - d_2, _DIGIT - d_1
    f, g = sum_of_digits(leading, d_4, d_3, d_2, d_1)
    scale = sign * two_to(-29.0 - shift)
    r, rest = two_product(f * scale, HALF_PI)
    return q & 3, r, rest + scale * (f * HALF_PI_REST + g * HALF_PI)


def sum_of_digits(leading: int, d_4: int, d_3: int, d_2: int, d_1: int) -> tuple[float, float]:
    """Return ``leading + d_4 2^-30 + d_3 2^-60 + ...`` in two parts, for leading in 0 ... 2^60."""
    f, e_1 = fast_two_sum(float(leading >> 30) / _SMALL, float(leading & _DIGIT))
    f, e_2 = fast_two_sum(f, float(d_4) * _SMALL)
    f, e_3 = fast_two_sum(f, float(d_3) * _SMALL * _SMALL)
    f, e_4 = fast_two_sum(f, float(d_2) * _SMALL * _SMALL * _SMALL)
    f, e_5 = fast_two_sum(f, float(d_1) * _SMALL * _SMALL * _SMALL * _SMALL)
    return fast_two_sum(f, e_1 + (e_2 + (e_3 + (e_4 + e_5))))
