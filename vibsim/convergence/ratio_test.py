"""Two ratios that are right although the trend behind them cannot be read.

Where the last two ratios are those of h^p, h^p is what the ladder shows, unless a lower power is seen to take over.
What is left beside it may then be a higher power, accidents of the levels, or less than a tenth of a lower power: the
order passes, and its interval reaches down to the lower power that may be there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibsim.convergence.asymptotic_range import Trend, mismatches
from vibsim.convergence.ladder_statistics import Evidence
from vibsim.convergence.roundoff_onset import QUIET, steepest
from vibsim.convergence.settled_orders import (
    COINCIDENT,
    FADING,
    FARTHEST,
    GROWS,
    HIDDEN,
    JUMP,
    READABLE,
    lowest,
    most_left,
)
from vibsim.convergence.true_errors import errors_leave

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

SINGLE = 0.05
"""The same where one triple is the only evidence."""


def two_ratios(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say where the last two ratios are those of h^p, and no lower power is seen to take over."""
    now, before = mismatches(t, p)
    near = np.maximum(np.abs(t.local - p), np.abs(t.local - t.change - p)) <= e.tolerance
    both = t.several & near & (now <= SINGLE) & (before <= COINCIDENT)
    # behind a jump two orders may be neighbours by accident
    both &= ~np.signbit(t.scatter) & ~t.gap & ~t.alternating & ~(np.abs(t.earlier) > JUMP)
    # nor are they the orders of one power where the differences have turned round between them
    both &= ~t.turning
    return np.asarray(both & ~_emerges(t, p) & (t.irregular | ~errors_leave(e, t, p)))


def below(t: Trend) -> Floats:
    """Return the lower end of an interval that reaches to the lowest power that may be hiding, shape (...)."""
    return np.minimum(t.low, lowest(t.order - t.width, FARTHEST))


def little_left(t: Trend, p: Floats) -> Flags:
    """Say where what is left besides h^p is less than a tenth of a lower power would make."""
    now, before = mismatches(t, p)
    # what round-off may have made does not tell of a lower power that grows
    return np.asarray(now <= most_left(p, now, before, t.several & (now > t.noise)))


def _emerges(t: Trend, p: Floats) -> Flags:
    """Say where a lower power is seen to grow: by the shape of the differences, or in the orders.

    Three orders tell of it by their last two changes. Two orders have one, which says little where the differences
    become proportional at the same time.
    """
    now, _ = mismatches(t, p)
    spread, before = np.abs(t.scatter), t.scatter_before
    by_shape = (spread > QUIET) & (spread > GROWS * before)
    # what rises more steeply than any lower power is a floor that begins
    by_shape &= ~(spread > steepest(t.local - t.change) * before)
    last = t.local - p
    away, then, earlier = np.abs(last), np.abs(last - t.change), np.abs(last - t.change - t.earlier)
    calm = (before > READABLE) & (spread <= FADING * before)
    two = np.isnan(t.earlier) & (now > HIDDEN) & ~calm
    by_order = (away > GROWS * then) & ((then > GROWS * earlier) | two)
    return np.asarray((by_shape | by_order) & (now > t.noise) & ~little_left(t, p))
