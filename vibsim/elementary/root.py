r"""Cube root, and the length of a vector.

``x = 2^(3j) m`` with m in [1/2, 4). A cubic polynomial (relative error 5e-3) and one step of Halley's leave 1e-7 of the
root of m; rounded to 17 bits, so that its cube is exact, it is t, and the root is ``t (1 + d)^(1/3)`` with
``d = (m - t^3)/t^3`` below 2^-14, by three terms of the series.

``sqrt(x^2 + y^2)`` takes the squares in two parts, scaled so that they neither over- nor underflow.

Source: J.-M. Muller, Elementary Functions, 3rd ed. (2016), section 5.3; for the length J.-M. Muller et al., Handbook of
Floating-Point Arithmetic, 2nd ed. (2018), section 4.7.
"""

from __future__ import annotations

import math

from vibsim.elementary.doubled import nearest_whole, root_parts, two_product, two_sum
from vibsim.elementary.primitives import exponent_of, mantissa_of, two_to

_SMALLEST_NORMAL = 2.2250738585072014e-308
_LARGEST_DOUBLE = 1.7976931348623157e308
_TO_NORMAL = 18014398509481984.0  # 2^54
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
