r"""The window of a ladder: which of its local orders count, where they settle, and how surely.

``d_k = a(t) h^p + b(t) h^q`` has local orders that approach p, and successive differences whose directions (as vectors
over time) approach each other, both like ``x_k = |b| h^(q-p)/|a|``. So the *change* of the order and the *scatter* of
the triples (`series.scatter`) measure what is left of the next power, and the trend of the scatter says whether it
fades (the first power takes over) or grows (a lower power emerges, or noise).

The interval of an order is empirical: it is the correction to the last local order that the next power would need,
times the factor that makes intervals of random ladders with known truth contain the true order in 95 % of them
(``tests/analysis/synthetic.py``; the factors come from one half of these ladders and are tested on the other).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.cut import LOG2, LOUD, QUIET, SHOWS, before_round_off, noise_share

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]

FADING = 0.75
"""The scatter fades when it falls at least to this part of itself per level (1/2 and 1/4 are usual)."""
QUICK, SLOW = 0.62, 0.05
"""What fades no faster is a power h^(p+1/2), of which more than a tenth makes the mismatch 0.06."""
GROWS = 1.3
"""The scatter drifts when it grows by more per level; a power lower by 1/2 makes it grow by 2^0.5."""
READABLE = 1e-5
"""Less scatter, or less than `PARALLEL` of the change of the order, comes from series of one shape and tells no trend."""
PARALLEL = 0.05
SLOWEST, FASTEST = 0.8, 0.1
"""Factors per level between which changes of the order fade when they come from a power of the expansion."""
ALIKE = 0.15
"""Scatter and order tell of the same power where their factors differ by no more."""
LEAST_WIDTH = 1e-6
"""Half the width of an interval at least: the digits that reports show."""
OF_CHANGE = 2.1
"""Half the width of an interval over the last changes of the order: 95 % of ladders whose trend is not known."""
OF_SETTLED = 0.42
"""The same where scatter and three orders tell of one next power, which is then taken off."""
OF_STEADY = 0.75
"""The same over the larger of two changes, where three orders of series of one shape do."""
OF_FADING = 1.5
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
EMERGING = 0.08
"""A lower power that is seen to grow may be so large a part of h^p at the finest level: below a tenth, with a margin."""
FARTHEST = 3.0
"""A lower power is lower by no more."""
PASSING = 0.05
"""Orders that change by more and do not settle may be on the way from one power to another."""
NEXT = 2.0
"""The powers of an expansion are at most so far apart: an order that has not settled may become one so far away."""


@dataclass(frozen=True)
class Trend:
    """The window of every ladder and the order in it; arrays of shape (...)."""

    count: Integers
    """Number of triples before round-off."""
    first: Integers
    """First triple that the order rests on."""
    last: Integers
    """Last triple that the order rests on."""
    cut: Flags
    """Whether round-off cut finer triples off."""
    order: Floats
    """The order: the limit of the local orders where they settle, else the last one."""
    width: Floats
    """Half the width of its interval."""
    low: Floats
    """Lower end of the interval; lower by `NEXT` where a lower power may be hiding."""
    high: Floats
    """Upper end of the interval; higher by `NEXT` where the orders have not settled."""
    local: Floats
    """The last local order."""
    change: Floats
    """Its change from the triple before; 0 where there is one triple only."""
    scatter: Floats
    """Signed scatter of the last triple."""
    scatter_before: Floats
    """Its size at the triple before; 0 where there is one triple only."""
    drifting: Flags
    """Whether the scatter grows although round-off does not explain it."""
    alternating: Flags
    """Whether differences change their sign, or orders swing, from level to level."""
    turning: Flags
    """Whether the changes of the order grow, or the differences turn round: it has not settled."""
    gap: Flags
    """Whether a triple of the window has no order: differences vanish that should not."""
    noisy: Flags
    """Whether round-off explains changes of the order as large as the last one."""
    fading: Flags
    """Whether what is left of the next power fades from triple to triple."""
    open: Flags
    """Whether the orders have not settled."""
    hiding: Flags
    """Whether a lower power may be hiding in what is left besides the first."""
    several: Flags
    """Whether the order rests on several triples."""
    irregular: Flags
    """Whether the last two changes of the order are small and of opposite signs: accidents of the levels."""
    slow: Flags
    """Whether what is left is not small, and fades no faster than h^(1/2)."""


def trend(
    orders: Floats,
    scatter: Floats,
    difference: Floats,
    floor: Floats,
    blame: float,
    tolerance: float,
    ceiling: Floats | None = None,
    of_errors: Floats | None = None,
    vouched: Flags | None = None,
) -> Trend:
    """Find the window of every ladder.

    Parameters
    ----------
    orders, scatter
        Local order and signed scatter of every triple, shape (..., m); NaN where a difference vanishes.
    difference
        Norms of the differences, shape (..., m+1).
    floor
        Predicted round-off at every level, shape (..., m+2).
    blame
        Differences up to so many times the floor are suspect.
    tolerance
        How far from the stated order the local orders of a window may be.
    ceiling
        The most round-off that any arithmetic makes at every level, shape (..., m+2); the floor where None.
    of_errors
        Order of the last two true errors of three levels, shape (...); NaN where not known.
    vouched
        Where the true errors leave no room for a lower power, shape (...).
    """
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        noise = noise_share(difference, floor)
        possible = noise if ceiling is None else noise_share(difference, ceiling)
        clean = before_round_off(orders, scatter, difference, noise, possible, 1.0 / blame)
        count = np.sum(clean, axis=-1)
        last = np.maximum(count - 1, 0)
        local, spread, rest = (_at(x, last) for x in (orders, scatter, noise))
        several = (count > 1) & ~_starts_here(orders, scatter, last, rest)
        before = np.where(several, _at(scatter, last - 1), 0.0)
        change = np.where(several, local - _at(orders, last - 1), 0.0)
        earlier = np.where(
            several & (count > 2), _at(orders, last - 1) - _at(orders, last - 2), np.nan
        )
        tail, width = _settling(np.abs(spread), np.abs(before), change, earlier, several)
        width = np.maximum(width, np.minimum(rest, SHOWS * np.abs(spread)) / LOG2)
        # what is so far away is not known to be reached
        width = np.where(np.abs(tail) > tolerance, np.maximum(width, np.abs(tail)), width)
        tail = np.where(np.abs(tail) > tolerance, 0.0, tail)
        order = local + tail
        left = _left(spread, before, change, earlier, tail)
        fading = several & _fades(left, spread, before, tail, change * earlier > 0, tolerance)
        hiding = ~fading & (left[0] > most_left(order, *left, several))
        if vouched is not None:
            hiding &= several | ~vouched
        turned = several & np.signbit(before)
        open_ = turned | (left[0] > SETTLED) | np.signbit(spread) | (~fading & (np.abs(change) > PASSING))
        # where orders fall, a higher one is behind
        falls = several & (change < 0) & ~np.signbit(spread) & ~turned
        reach = width if of_errors is None else _with_errors(width, local, of_errors, several)
        unexplained = np.abs(spread) > 3 * rest
        return Trend(
            count=count,
            first=_first(orders, order, np.maximum(width, tolerance), last),
            last=last,
            cut=count < orders.shape[-1],
            order=order,
            width=width,
            low=order - reach - np.where(open_ | hiding, NEXT, 0.0),
            high=np.where(falls, np.maximum(order, local), order)
            + reach
            + np.where(open_ & ~falls, NEXT, 0.0),
            open=open_,
            local=local,
            change=change,
            scatter=spread,
            scatter_before=np.abs(before),
            drifting=several
            & (np.abs(spread) > GROWS * np.abs(before))
            & (np.abs(spread) > QUIET)
            & unexplained,
            alternating=_alternating(scatter, last, several, change, earlier, tolerance),
            turning=turned
            | ((np.abs(change) > np.abs(earlier)) & (np.abs(change) > 5 * QUIET)),
            gap=np.any(clean & np.isnan(orders), axis=-1),
            noisy=np.abs(change) <= np.minimum(LOUD * rest, SHOWS * np.abs(spread)) / LOG2,
            fading=fading,
            hiding=hiding,
            several=several,
            irregular=(change * earlier < 0)
            & (np.abs(earlier) <= tolerance)
            & (np.abs(change) <= tolerance),
            slow=~(left[0] <= np.maximum(QUICK * left[1], SLOW)),
        )


def _with_errors(width: Floats, local: Floats, of_errors: Floats, several: Flags) -> Floats:
    """Return half the width of the interval of a single order beside which the order of the errors is known."""
    apart = OF_ERRORS * np.abs(of_errors - local)
    return np.where(several | np.isnan(apart), width, np.maximum(width, apart))


def _left(
    spread: Floats, before: Floats, change: Floats, earlier: Floats, tail: Floats
) -> tuple[Floats, Floats]:
    """Return how far the last triple, and the one before, are from series of the stated order."""
    known = tail != 0
    last = np.where(known, np.abs(tail), np.abs(change))
    first = np.where(known, np.abs(tail + change), np.nan_to_num(np.abs(earlier)))
    return np.hypot(spread, LOG2 * last), np.hypot(before, LOG2 * first)


def _fades(
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

    Of ``h^p + x h^r``, r < p, at the finest level, the last triple sees ``x (2^r - 1)/(2^p - 1) (1 - 2^(r-p))``, and the
    one before it less by 2^(p-r). So the growth of the mismatch tells r, and its size x. Where nothing grows, r is not
    known, and `HIDDEN` is the limit.

    Parameters
    ----------
    order
        p.
    mismatch, before
        Distance from proportional series of order p, of the last triple and the one before.
    several
        Whether there is one before.
    """
    growth = np.where(before > 0, mismatch / np.where(before > 0, before, 1.0), np.inf)
    gap = np.clip(np.log2(np.maximum(growth, 1.0)), 0.5, FARTHEST)
    p = np.maximum(order, 1.0)
    lower = np.exp2(np.maximum(p - gap, 0.5)) - 1
    seen = EMERGING * lower / (np.exp2(p) - 1) * (1 - np.exp2(-gap))
    return np.where(several & (growth > GROWS), seen, HIDDEN)


def _starts_here(orders: Floats, scatter: Floats, last: Integers, rest: Floats) -> Flags:
    """Say where the window begins with the last triple: it is proportional, and the one before has another order.

    A power that fades would have left more in the scatter than there is. The coarser levels are of another range:
    they have blown up, or their errors are as large as the solution.
    """
    size = np.abs(_at(scatter, last))
    jump = np.abs(_at(orders, last) - _at(orders, last - 1))
    return (jump > JUMP) & (size <= HIDDEN) & (size > np.maximum(READABLE, 3 * rest))


def _settling(
    spread: Floats, before: Floats, change: Floats, earlier: Floats, several: Flags
) -> tuple[Floats, Floats]:
    """Return what the last order still lacks of its limit, and half the width of the interval of that limit.

    Where x falls by the factor f per level, so does the change of the order, and f/(1 - f) times the last change is
    still to come. f is read from the scatter, and where there are three orders from their changes. If both tell the
    same, the correction is good to `OF_SETTLED` of the last change; if not, the changes are accidents of the levels,
    and the interval is as wide as they are.
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
    unknown = np.where(generic & (of_scatter <= FADING), OF_FADING, OF_CHANGE)
    width = np.where(
        settled,
        OF_SETTLED * np.abs(change),
        np.where(alone, OF_STEADY * largest, unknown * np.maximum(largest, spread / 3)),
    )
    single = np.maximum(OF_SCATTER * spread / LOG2, SINGLE_WIDTH)
    return tail, np.maximum(np.where(several, width, single), LEAST_WIDTH)


def _alternating(
    scatter: Floats,
    last: Integers,
    several: Flags,
    change: Floats,
    earlier: Floats,
    tolerance: float,
) -> Flags:
    """Say where differences alternate in sign, or orders swing without settling."""
    now = _at(scatter, last)
    opposite = np.signbit(now)
    signs = opposite & np.where(several, np.signbit(_at(scatter, last - 1)), now > -0.5)
    swings = change * earlier < 0
    wide = (np.abs(change) > tolerance) & (np.abs(change) > 0.5 * np.abs(earlier))
    return signs | (swings & wide)


def _first(orders: Floats, order: Floats, reach: Floats, last: Integers) -> Integers:
    """Return the first triple from which on the local orders stay within `reach` of the order."""
    index = np.arange(orders.shape[-1])
    away = ~(np.abs(orders - order[..., None]) <= reach[..., None])
    away &= index < np.maximum(last - 1, 0)[..., None]
    return np.asarray(np.max(np.where(away, index + 1, 0), axis=-1))


def _at(values: Floats, index: Integers) -> Floats:
    """Return one entry of the last axis for each ladder; the first one for a negative index."""
    return np.take_along_axis(values, np.maximum(index, 0)[..., None], axis=-1)[..., 0]
