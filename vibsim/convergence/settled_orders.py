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
from numpy.typing import NDArray

from vibsim.convergence.roundoff_onset import LOG2

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

COINCIDENT = 0.2
"""Largest scatter (see `differences.scatter`) of curves that count as proportional."""
FADING = 0.75
"""The scatter fades when it falls at least to this part of itself per level (1/2 and 1/4 are usual)."""
QUICK, SLOW = 0.62, 0.05
"""What fades no faster is a power h^(p+1/2), of which more than a tenth makes the mismatch 0.06."""
GROWS = 1.3
"""The scatter drifts when it grows by more per level; a power lower by 1/2 makes it grow by 2^0.5."""
READABLE = 1e-5
"""Less scatter, or less than `PARALLEL` of the change of the order, is that of series of one shape, and no trend."""
PARALLEL = 0.05
SLOWEST, FASTEST = 0.8, 0.1
"""Factors per level between which changes of the order fade when they come from a power of the expansion."""
ALIKE = 0.15
"""Scatter and order tell of the same power where their factors differ by no more."""
LEAST_WIDTH = 1e-6
"""Half the width of an interval at least: the digits that reports show."""
OF_CHANGE = 2.1
"""Half the width of an interval over the last changes of the order: 95 % of ladders whose trend is not known."""
OF_SETTLED = 7.5
"""The same where scatter and three orders tell of one next power, which is then taken off: over the last change times
what the correction leaves out, which is the distance of the two factors and the scatter itself."""
MOST_SETTLED = 0.6
"""Such an interval is no wider than this part of the last change."""
OF_STEADY = 0.5
"""The same over the larger of two changes, where three orders of series of one shape do."""
OF_FADING = 1.3
"""The same where the scatter alone tells that the next power fades."""
OF_SCATTER = 3.0
"""Half the width of the interval of a single order over its scatter / log 2: shapes at an angle of 18 degrees."""
OF_ERRORS = 2.0
"""Half the width of the interval of a single order over its distance from the order of the last true errors."""
SINGLE_WIDTH = 2e-4
"""Half the width of the interval of a single order at least."""
JUMP = 0.3
"""Change of the order from one triple to the next that a scatter of `HIDDEN` at most cannot come from."""
SETTLED = 0.15
"""Largest mismatch of a settled order: a second term of a tenth of the first makes 0.2 for neighbouring powers."""
HIDDEN = 0.015
"""A tenth of h^(p-1), or of h^(p-2), beside h^p makes at least this mismatch: 0.0167 for p = 2, 0.015 for p = 4.

With more, a ladder of which no trend is known may be on the way to a lower order.
"""
EMERGING = 0.1
"""A lower power that is seen to grow may be so large a part of h^p at the finest level."""
NEAREST = 0.1
"""An order so near a multiple of 1/2 may be that one: expansions have no other, and the distance is an error seen."""
FARTHEST = 3.0
"""A lower power is lower by no more."""
PASSING = 0.05
"""Orders that change by more and do not settle may be on the way from one power to another."""
NEXT = 2.0
"""The powers of an expansion are at most so far apart: an order that has not settled may become one so far away."""


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
