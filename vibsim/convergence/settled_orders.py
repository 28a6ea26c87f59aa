r"""Where the orders of a ladder settle, how surely, and what is left besides the first power.

``d_k = a(t) h^p + b(t) h^q`` leaves ``x_k = |b| h^(q-p)/|a|`` besides the first power, which shows in the order (its
distance from p) and in the scatter of the triples. The *mismatch* is both together:
``sqrt(scatter^2 + (log 2 distance)^2)``, whatever the angle between a and b.

The half widths of intervals are empirical: the correction to the last local order that the next power would need, times
the factor that makes the intervals of random ladders with known truth contain the true order in 95 % of them and more
(``tests/analysis/synthetic.py``; the factors come from one half of these ladders and are tested on the other).
"""

from __future__ import annotations

import numpy as np

from vibsim.convergence.thresholds import (
    ALIKE,
    EMERGING,
    FADING,
    FARTHEST,
    FASTEST,
    GROWS,
    HIDDEN,
    LEAST_WIDTH,
    LOG2,
    MOST_SETTLED,
    NEAREST,
    OF_CHANGE,
    OF_ERRORS,
    OF_FADING,
    OF_SCATTER,
    OF_SETTLED,
    OF_STEADY,
    PARALLEL,
    READABLE,
    SINGLE_WIDTH,
    SLOWEST,
)
from vibsim.core.array_types import Flags, Floats


def settling(
    spread: Floats, before: Floats, change: Floats, earlier: Floats, several: Flags
) -> tuple[Floats, Floats]:
    """Return what the last order still lacks of its limit, and half the width of the interval of that limit.

    Where x falls by the factor f per level, so does the change of the order, and f/(1 - f) times the last change is
    still to come. f is read from the scatter, and where there are three orders from their changes. If both tell nearly
    the same, the correction is as good as they agree; if not, the changes are accidents of the levels, and the interval
    is as wide as they are.
    """
    of_scatter = np.where(before > 0, spread / np.where(before > 0, before, 1.0), 1.0)
    of_change = np.where(np.abs(earlier) > 0, change / np.where(earlier == 0, 1.0, earlier), np.nan)
    generic = np.maximum(spread, before) > READABLE
    generic &= spread > PARALLEL * LOG2 * np.abs(change)
    steady = (of_change > FASTEST) & (of_change < SLOWEST)
    settled = steady & generic & (np.abs(of_change - of_scatter) <= ALIKE) & (of_scatter <= FADING)
    alone = steady & ~generic
    fades = settled | (generic & (of_scatter <= FADING) & np.isnan(earlier))
    f = np.where(fades, of_scatter, np.where(alone, of_change, 0.0))
    tail = np.where(several, change * f / (1.0 - np.minimum(f, SLOWEST)), 0.0)
    largest = np.fmax(np.abs(change), np.abs(earlier))
    doubt = np.abs(of_change - of_scatter) + spread
    unknown = np.where(generic & (of_scatter <= FADING), OF_FADING, OF_CHANGE)
    width = np.where(
        settled,
        np.abs(change) * np.minimum(MOST_SETTLED, OF_SETTLED * doubt),
        np.where(alone, OF_STEADY * largest, unknown * np.maximum(largest, spread / 3)),
    )
    single = np.maximum(OF_SCATTER * spread / LOG2, SINGLE_WIDTH)
    return tail, np.maximum(np.where(several, width, single), LEAST_WIDTH)


def with_errors(width: Floats, local: Floats, of_errors: Floats, several: Flags) -> Floats:
    """Return half the width of the interval of a single order beside which the order of the errors is known."""
    apart = OF_ERRORS * np.abs(of_errors - local)
    return np.where(several | np.isnan(apart), width, np.maximum(width, apart))


def lowest(low: Floats, further: float | Floats) -> Floats:
    """Return the lower end of an interval that reaches further down, to the order 0 of a limit that is missed."""
    return np.maximum(low - further, np.minimum(low, 0.0))


def with_nearest(order: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Return an interval of an order that holds the order of an expansion next to it, too."""
    nearest = np.round(2.0 * order) / 2
    near = np.abs(order - nearest) <= NEAREST
    return np.where(near, np.minimum(low, nearest), low), np.where(
        near, np.maximum(high, nearest), high
    )


def left(
    spread: Floats, before: Floats, change: Floats, earlier: Floats, tail: Floats
) -> tuple[Floats, Floats]:
    """Return how far the last triple, and the one before, are from series of the stated order."""
    known = tail != 0
    last = np.where(known, np.abs(tail), np.abs(change))
    first = np.where(known, np.abs(tail + change), np.nan_to_num(np.abs(earlier)))
    return np.hypot(spread, LOG2 * last), np.hypot(before, LOG2 * first)


def fades(
    left: tuple[Floats, Floats],
    spread: Floats,
    before: Floats,
    tail: Floats,
    onward: Flags,
    tolerance: float,
) -> Flags:
    """Say where what is left fades from triple to triple; `onward`: the last two changes have the same sign."""
    small, large = np.abs(spread), np.abs(before)
    by_scatter = (large > READABLE) & (small <= FADING * large)
    whole = (left[0] <= FADING * left[1]) & (by_scatter | (onward & (small <= 0.5 * HIDDEN)))
    return np.asarray(whole | (by_scatter & (np.abs(tail) <= tolerance)))


def most_left(order: Floats, mismatch: Floats, before: Floats, several: Flags) -> Floats:
    """Return the largest mismatch with which h^p still stands alone, shape (...).

    Of ``h^p + x h^r``, r < p, at the finest level, the last triple sees ``x (2^r - 1)/(2^p - 1) (1 - 2^(r-p))``, and
    the one before it less by 2^(p-r). So the growth of the mismatch tells r, and its size x. Where nothing grows, r is
    not known, and `HIDDEN` is the limit.

    Parameters
    ----------
    order
        p.
    mismatch, before
        Distance from proportional series of order p, of the last triple and the one before.
    several
        Whether there is one before, and what is left is more than round-off.
    """
    growth = np.where(before > 0, mismatch / np.where(before > 0, before, 1.0), np.inf)
    gap = np.clip(np.log2(np.maximum(growth, 1.0)), 0.5, FARTHEST)
    p = np.maximum(order, 1.0)
    lower = np.exp2(np.maximum(p - gap, 0.5)) - 1
    seen = EMERGING * lower / (np.exp2(p) - 1) * (1 - np.exp2(-gap))
    return np.where(several & (growth > GROWS), seen, HIDDEN)
