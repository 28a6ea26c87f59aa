r"""The order that follows from two successive differences, for any three step sizes.

Of three levels with step sizes ``h0 > h1 > h2`` and an error ``A h^p`` the differences of the values have the ratio

    (u0 - u1)/(u1 - u2) = (h0^p - h1^p)/(h1^p - h2^p)

which grows with p, so that a positive ratio belongs to one p (Roache, Verification and Validation in Computational
Science and Engineering, 1998, section 5.10). With one factor r between the levels p is ``log(ratio)/log(r)``.
"""

from __future__ import annotations

import numpy as np

from vibsim.core.array_types import Floats

STEEPEST = 60.0
"""Orders beyond are none: a difference has vanished."""
_SAME = 1e-12
"""Two factors that differ by less, relatively, are one."""


def difference_ratio(order: Floats, h: Floats) -> Floats:
    """Return the ratio of the two differences of three levels with step sizes `h`, shape (3,), for some orders."""
    first, second = np.log(h[0] / h[1]), np.log(h[1] / h[2])
    p = np.asarray(order, dtype=np.float64)
    tiny = np.abs(p) < 1e-12
    safe = np.where(tiny, 1.0, p)
    with np.errstate(over="ignore"):
        found = np.expm1(safe * first) / -np.expm1(-safe * second)
    return np.asarray(np.where(tiny, first / second, found))


def order_of_ratio(ratio: Floats, h: Floats) -> Floats:
    """Solve `difference_ratio` for the order; NaN where the ratio is not positive and finite, or beyond `STEEPEST`."""
    ratio = np.asarray(ratio, dtype=np.float64)
    usable = np.isfinite(ratio) & (ratio > 0.0)
    safe = np.where(usable, ratio, 1.0)
    first, second = np.log(h[0] / h[1]), np.log(h[1] / h[2])
    if abs(first - second) <= _SAME * first:
        order = np.log(safe) / first
        return np.asarray(np.where(usable & (np.abs(order) <= STEEPEST), order, np.nan))
    low, high = np.full(safe.shape, -STEEPEST), np.full(safe.shape, STEEPEST)
    usable &= (safe >= difference_ratio(low, h)) & (safe <= difference_ratio(high, h))
    for _ in range(64):
        middle = 0.5 * (low + high)
        above = difference_ratio(middle, h) > safe
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return np.asarray(np.where(usable, 0.5 * (low + high), np.nan))
