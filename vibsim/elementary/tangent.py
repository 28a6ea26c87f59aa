"""Tangent: the quotient of sine and cosine, both in two parts (see `circular`)."""

from __future__ import annotations

import math

from vibsim.elementary.circular import (
    LARGEST_ANGLE,
    PER_PI,
    reduced,
    reduced_half,
    sine_far,
    sine_parts,
)
from vibsim.elementary.doubled import quotient
from vibsim.elementary.rounding import nearest_whole


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
    # both of r = x - k pi, whose signs differ from those of x alike for odd k
    y = abs(r)
    r, rest_c = reduced_half(y, 0.5, -1.0)
    c, c_behind = sine_parts(r, rest_c - (rest if s > 0.0 else -rest))
    return quotient(s, s_behind, c, c_behind)
