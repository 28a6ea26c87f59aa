r"""Inverse circular functions, all from the angle of a point ``(c, s)``.

``atan(s/c)`` with 0 <= s <= c after a reflection; if ``s > tan(pi/8) c`` the angle is ``pi/4 + atan((s-c)/(s+c))``. The
remaining arctangent is ``t + t^3 P(t^2)`` with \|t\| <= tan(pi/8), P of degree 10 (Remez with rounded coefficients,
relative error 2e-18). ``asin x`` is the angle of ``(sqrt(1 - x^2), x)`` with the root in two parts, ``acos x`` that of
its reflection.

Source: J.-M. Muller, Elementary Functions, 3rd ed. (2016), section 11.3.
"""

from __future__ import annotations

import math

from vibsim.elementary.circular import HALF_PI, HALF_PI_REST
from vibsim.elementary.doubled import fast_two_sum, root_parts, two_product, two_sum

_PI = 2.0 * HALF_PI
_PI_REST = 2.0 * HALF_PI_REST
_QUARTER_PI = 0.5 * HALF_PI
_QUARTER_PI_REST = 0.5 * HALF_PI_REST
_TAN_PI_8 = 0.41421356237309503
_ANGLE_IS_TANGENT = 1.0e-9
_HALF_PI_FROM = 1.0e30
_VANISHING = 1.0e-100
_HUGE = 1.0e280
_MINUTE = 1.0e-150
_SMALLER = 2.0**-200
_LARGER = 2.0**600
_LARGEST_DOUBLE = 1.7976931348623157e308

_T3, _T5, _T7, _T9, _T11, _T13, _T15, _T17, _T19, _T21, _T23 = (
    -0.333333333333332, 0.19999999999953813, -0.14285714280222683, 0.11111110784916481,
    -0.09090897802761111, 0.07692061052797541, -0.06663113819876373, 0.05847961265333233,
    -0.050396299827677286, 0.0380728041949895, -0.01791618170460757,
)  # fmt: skip


def asin(x: float) -> float:
    """Return the inverse sine, error below 1 unit in the last place; NaN beyond -1 ... 1."""
    y = abs(x)
    c, c_behind = cosine_from_sine(y)
    value, behind = angle_of(y, 0.0, c, c_behind)
    value = value + behind
    value = value if x > 0.0 else -value
    value = value if y > _ANGLE_IS_TANGENT else x
    return value if y <= 1.0 else math.nan


def acos(x: float) -> float:
    """Return the inverse cosine, error below 1 unit in the last place; NaN beyond -1 ... 1."""
    y = abs(x)
    s, s_behind = cosine_from_sine(y)
    value, behind = angle_of(s, s_behind, y, 0.0)
    value = mirrored(value, behind, x >= 0.0)
    return value if y <= 1.0 else math.nan


def atan(x: float) -> float:
    """Return the inverse tangent for every double, error below 1 unit in the last place."""
    y = abs(x)
    value, behind = angle_of(_HALF_PI_FROM if y > _HALF_PI_FROM else y, 0.0, 1.0, 0.0)
    value = value + behind
    value = value if x > 0.0 else -value
    return value if y > _ANGLE_IS_TANGENT else x


def atan2(y: float, x: float) -> float:
    """Return the angle of ``(x, y)``, error below 1 unit in the last place; zeros and infinities as in C99, F.9.1.4."""
    if x != x or y != y:
        return math.nan
    c, s = abs(x), abs(y)
    positive = math.copysign(1.0, x) > 0.0
    if s > _LARGEST_DOUBLE or c > _LARGEST_DOUBLE:
        s = 1.0 if s > _LARGEST_DOUBLE else 0.0
        c = 1.0 if c > _LARGEST_DOUBLE else 0.0
    if positive and s < _VANISHING * c:
        return y / x
    angle = angle_from(s, c, positive)
    return math.copysign(angle, y)


def atan2_fast(y: float, x: float) -> float:
    r"""Return `atan2` for finite x and y, not both zero, with y/x = 0 or \|y/x\| > 1e-100; otherwise NaN."""
    c, s = abs(x), abs(y)
    positive = math.copysign(1.0, x) > 0.0
    usual = (c <= _LARGEST_DOUBLE) & (s <= _LARGEST_DOUBLE) & (c + s > 0.0)
    usual = usual & ((s >= _VANISHING * c) | (s == 0.0))
    angle = angle_from(s if usual else 1.0, c if usual else 1.0, positive)
    return math.copysign(angle, y) if usual else math.nan


def angle_from(s: float, c: float, positive: bool) -> float:
    """Return the angle of ``(c, s)``, or of ``(-c, s)``, for s, c >= 0 and finite."""
    size = s if s > c else c
    scale = _SMALLER if size > _HUGE else 1.0
    scale = _LARGER if size < _MINUTE else scale
    value, behind = angle_of(s * scale, 0.0, c * scale, 0.0)
    return mirrored(value, behind, positive)


def mirrored(value: float, behind: float, stays: bool) -> float:
    """Return the sum of the parts of an angle, or pi minus that sum."""
    other, cut = fast_two_sum(_PI, -value)
    behind = behind if stays else cut + (_PI_REST - behind)
    return (value if stays else other) + behind


def cosine_from_sine(x: float) -> tuple[float, float]:
    """Return ``sqrt(1 - x^2)`` in two parts for x in 0 ... 1."""
    p, error = two_product(x, x)
    h, behind = fast_two_sum(1.0, -p)
    return root_parts(h, behind - error)


def angle_of(s: float, s_behind: float, c: float, c_behind: float) -> tuple[float, float]:
    """Return the angle of ``(c, s)`` in two parts for s, c in 0 ... 1e281, each in two parts."""
    steep = s > c
    u, v = (c, s) if steep else (s, c)
    u_behind, v_behind = (c_behind, s_behind) if steep else (s_behind, c_behind)
    v = v if v > 0.0 else 1.0
    middle = u > _TAN_PI_8 * v
    top, top_cut = two_sum(u, -v)
    bottom, bottom_cut = fast_two_sum(v, u)
    top = top if middle else u
    top_behind = top_cut + (u_behind - v_behind) if middle else u_behind
    bottom = bottom if middle else v
    bottom_behind = bottom_cut + (u_behind + v_behind) if middle else v_behind
    t, behind = arctangent(top, top_behind, bottom, bottom_behind)
    value, cut = fast_two_sum(_QUARTER_PI, t)
    value = value if middle else t
    behind = behind + (cut + _QUARTER_PI_REST) if middle else behind
    other, cut = fast_two_sum(HALF_PI, -value)
    return (other, cut + (HALF_PI_REST - behind)) if steep else (value, behind)


def arctangent(
    top: float, top_behind: float, bottom: float, bottom_behind: float
) -> tuple[float, float]:
    """Return the angle whose tangent is a quotient, at most tan(pi/8) in size, in two parts."""
    inverse = 1.0 / bottom
    t = top * inverse
    p, error = two_product(t, bottom)
    t_behind = (((top - p) - error) + (top_behind - t * bottom_behind)) * inverse
    z = t * t
    z2 = z * z
    z4 = z2 * z2
    low = (_T3 + z * _T5) + z2 * (_T7 + z * _T9)
    high = (_T11 + z * _T13) + z2 * (_T15 + z * _T17)
    high = high + z4 * ((_T19 + z * _T21) + z2 * _T23)
    return t, t_behind * (1.0 - z * (1.0 - z)) + t * z * (low + z4 * high)
