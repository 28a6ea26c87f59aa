r"""The elementary functions of the engine, in strict ``+ - * /``.

A member's numbers must not depend on the lane or the machine that computes them, so its forces never call the C
library, whose last digit differs between versions. One text serves every lane: plain Python runs it as it stands, the
compiled lanes compile it without contraction.

``sin``: ``r = x - k pi`` with pi in three parts (Cody and Waite; k times a part of 38 bits is exact for \|k\| < 2^15),
then ``r + r^3 P(r^2)`` on [-pi/2, pi/2], P of degree 7 (least squares with rounded coefficients, relative error
5e-19), summed in Estrin's form because the length of the chain of dependent operations is what a step costs. The part
of r that rounding drops is carried in first order. Error below 2 units in the last place for \|x\| <= 1e5 (test:
against 50 digits). Beyond 1e5, 15 000 turns from home, the C library's sine is called.

Source: W. J. Cody and W. Waite, Software Manual for the Elementary Functions (1980), chapter 8.
"""

from __future__ import annotations

import math

_INVERSE_PI = float.fromhex("0x1.45f306dc9c883p-2")
_PI_1 = float.fromhex("0x1.921fb54440000p+1")
_PI_2 = float.fromhex("0x1.68c234c4c0000p-38")
_PI_3 = float.fromhex("0x1.98a2e03707345p-76")
_ROUND = (
    6755399441055744.0  # 1.5 * 2^52: adding and subtracting it rounds to the nearest whole number
)
_HALF_PI = 0.5 * math.pi
_LARGEST = 1.0e5

_S3 = -0.16666666666666666
_S5 = 0.008333333333333196
_S7 = -0.00019841269841207676
_S9 = 2.7557319210712077e-06
_S11 = -2.5052106827436554e-08
_S13 = 1.6058937294379453e-10
_S15 = -7.64292780231204e-13
_S17 = 2.720508082623873e-15


def sin(x: float) -> float:
    """Return the sine of `x` [rad]; NaN for NaN and infinities."""
    if abs(x) <= _HALF_PI:
        # k = 0: the same result as below without its latency
        r, rest = x, 0.0
    elif abs(x) <= _LARGEST:
        k = (x * _INVERSE_PI + _ROUND) - _ROUND
        odd = k - 2.0 * ((0.5 * k + _ROUND) - _ROUND)
        sign = 1.0 - 2.0 * (odd * odd)
        coarse = x - k * _PI_1
        fine = k * _PI_2
        r = coarse - fine
        rest = sign * (((coarse - r) - fine) - k * _PI_3)
        r = sign * r
    elif abs(x) < math.inf:
        return math.sin(x)
    else:
        return math.nan
    z = r * r
    z2 = z * z
    low = (_S3 + z * _S5) + z2 * (_S7 + z * _S9)
    high = (_S11 + z * _S13) + z2 * (_S15 + z * _S17)
    p = low + (z2 * z2) * high
    # cos r to the few digits that the rest deserves
    return r + ((r * z) * p + rest * (1.0 - z * (0.5 - z * (1.0 / 24.0))))
