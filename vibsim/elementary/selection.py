"""What chooses between values, and the square root: exact, or correctly rounded by IEEE 754.

Unlike Python's `min` and `max`, NaN in any argument that decides gives NaN: a fast function says by NaN that it has no
value, which a comparison would swallow.
"""

from __future__ import annotations

import math


def absolute(x: float) -> float:
    """Return the size of `x`."""
    return math.fabs(x)


def sqrt(x: float) -> float:
    """Return the square root, correctly rounded; NaN below zero."""
    # plain Python refuses negative arguments
    return math.sqrt(x if x >= 0.0 else math.nan)


def sign(x: float) -> float:
    """Return -1, 0 or 1; NaN for NaN."""
    side = 1.0 if x > 0.0 else -1.0
    side = 0.0 if x == 0.0 else side
    return side if x == x else x


def heaviside(x: float) -> float:
    """Return Heaviside's step: 0 below 0, 1/2 at 0, 1 above; NaN for NaN."""
    value = 1.0 if x > 0.0 else 0.0
    value = 0.5 if x == 0.0 else value
    return value if x == x else x


def smaller(a: float, b: float) -> float:
    """Return the smaller one, `a` where they are equal; NaN where one is NaN."""
    least = b if b < a else a
    return least if b == b else b


def larger(a: float, b: float) -> float:
    """Return the larger one, `a` where they are equal; NaN where one is NaN."""
    most = b if b > a else a
    return most if b == b else b


def where(condition: float, yes: float, no: float) -> float:
    """Return `yes` where the condition is not zero, else `no`; NaN where the condition is NaN."""
    chosen = yes if condition != 0.0 else no
    return chosen if condition == condition else math.nan
