r"""The window of a ladder: which of its local orders count, where they settle, and how surely.

``d_k = a(t) h^p + b(t) h^q`` has local orders that approach p, and successive differences whose directions (as vectors
over time) approach each other, both like ``x_k = |b| h^(q-p)/|a|``. So the *change* of the order and the *scatter* of
the triples (`series.scatter`) measure what is left of the next power, and the trend of the scatter says whether it
fades (the first power takes over) or grows (a lower power emerges, or noise).

What is left, and the interval, are worked out in `vibsim.analysis.settling`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.cut import LOG2, LOUD, QUIET, SHOWS, before_round_off, noise_share
from vibsim.analysis.settling import (
    GROWS,
    HIDDEN,
    JUMP,
    NEXT,
    PASSING,
    QUICK,
    READABLE,
    SETTLED,
    SLOW,
    fades,
    left,
    most_left,
    settling,
    with_errors,
    with_nearest,
)
from vibsim.analysis.uneven import accidents

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]

AGREE = 0.01
"""Two triples agree that have no more left besides one power."""
SUSPECT = 1.0 / 3.0
"""From this part of what would be too much on, what grows is told as a lower power that may be hiding."""


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
    noise: Floats
    """How much of the last triple the predicted round-off may be."""
    hiding: Flags
    """Whether a lower power may be hiding in what is left besides the first."""
    several: Flags
    """Whether the order rests on several triples."""
    irregular: Flags
    """Whether the last orders swing about their mean: accidents of the levels."""
    earlier: Floats
    """The change of the order before the last one; NaN where the order rests on two triples only."""
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
    numbers: Flags | None = None,
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
    numbers
        Where the series are single numbers, which have no shape, shape (...); nowhere where None.
    """
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        noise = noise_share(difference, floor)
        possible = noise if ceiling is None else noise_share(difference, ceiling)
        clean = before_round_off(orders, scatter, difference, noise, possible, 1.0 / blame, numbers)
        count = np.sum(clean, axis=-1)
        last = np.maximum(count - 1, 0)
        local, spread, rest = (_at(x, last) for x in (orders, scatter, noise))
        several = (count > 1) & ~_starts_here(orders, scatter, last, rest)
        before = np.where(several, _at(scatter, last - 1), 0.0)
        change = np.where(several, local - _at(orders, last - 1), 0.0)
        earlier = np.where(
            several & (count > 2), _at(orders, last - 1) - _at(orders, last - 2), np.nan
        )
        earlier = np.where(_starts_before(before, change, earlier), np.nan, earlier)
        tail, width = settling(np.abs(spread), np.abs(before), change, earlier, several)
        width = np.maximum(width, np.minimum(rest, SHOWS * np.abs(spread)) / LOG2)
        # what is so far away is not known to be reached
        width = np.where(np.abs(tail) > tolerance, np.maximum(width, np.abs(tail)), width)
        tail = np.where(np.abs(tail) > tolerance, 0.0, tail)
        order = local + tail
        beside = left(spread, before, change, earlier, tail)
        fading = several & fades(beside, spread, before, tail, change * earlier > 0, tolerance)
        # what round-off may have made does not tell of a lower power that grows
        grown = several & (beside[0] > rest)
        hiding = ~fading & (beside[0] > most_left(order, *beside, grown))
        if vouched is not None:
            hiding &= several | ~vouched
        turned = several & np.signbit(before)
        open_ = (
            turned
            | (beside[0] > SETTLED)
            | np.signbit(spread)
            | (~fading & (np.abs(change) > PASSING))
        )
        # where orders fall, a higher one is behind
        falls = several & (change < 0) & ~np.signbit(spread) & ~turned
        reach = width if of_errors is None else with_errors(width, local, of_errors, several)
        unexplained = np.abs(spread) > 3 * rest
        uneven = accidents(orders, scatter, last, several, tolerance)
        order = np.where(uneven.found, uneven.mean, order)
        width = np.where(uneven.found, uneven.width, width)
        reach = np.where(uneven.found, uneven.width, reach)
        open_ &= ~uneven.sure
        falls &= ~uneven.found
        suspect = SUSPECT * most_left(order, *beside, grown)
        hiding |= ~fading & grown & (beside[0] > np.maximum(GROWS * beside[1], suspect))
        hiding |= uneven.found & (beside[0] > SUSPECT * HIDDEN)
        hiding &= ~uneven.sure
        low = order - reach - np.where(open_ | hiding, NEXT, 0.0)
        high = np.where(falls, np.maximum(order, local), order) + reach
        high += np.where(open_ & ~falls, NEXT, 0.0)
        low, high = with_nearest(order, low, high)
        return Trend(
            count=count,
            first=_first(orders, order, np.maximum(width, tolerance), last),
            last=last,
            cut=count < orders.shape[-1],
            order=order,
            width=width,
            low=low,
            high=high,
            open=open_,
            local=local,
            change=change,
            scatter=spread,
            scatter_before=np.abs(before),
            drifting=several
            & (np.abs(spread) > GROWS * np.abs(before))
            & (np.abs(spread) > QUIET)
            & unexplained,
            alternating=_alternating(scatter, last, several, change, earlier, tolerance)
            & ~uneven.found,
            turning=(turned | ((np.abs(change) > np.abs(earlier)) & (np.abs(change) > 5 * QUIET)))
            & ~uneven.found,
            gap=np.any(clean & np.isnan(orders), axis=-1),
            noisy=np.abs(change) <= np.minimum(LOUD * rest, SHOWS * np.abs(spread)) / LOG2,
            fading=fading,
            noise=rest,
            hiding=hiding,
            several=several,
            irregular=uneven.found,
            earlier=earlier,
            slow=~(beside[0] <= np.maximum(QUICK * beside[1], SLOW)),
        )


def mismatches(t: Trend, p: Floats) -> tuple[Floats, Floats]:
    """Return how far the last triple, and the one before, are from proportional series of order p."""
    now = np.hypot(t.scatter, LOG2 * (t.local - p))
    return now, np.hypot(t.scatter_before, LOG2 * (t.local - t.change - p))


def _starts_here(orders: Floats, scatter: Floats, last: Integers, rest: Floats) -> Flags:
    """Say where the window begins with the last triple: it is proportional, and the one before has another order.

    A power that fades would have left more in the scatter than there is. The coarser levels are of another range:
    they have blown up, or their errors are as large as the solution.
    """
    size = np.abs(_at(scatter, last))
    jump = np.abs(_at(orders, last) - _at(orders, last - 1))
    return (jump > JUMP) & (size <= HIDDEN) & (size > np.maximum(READABLE, 3 * rest))


def _starts_before(before: Floats, change: Floats, earlier: Floats) -> Flags:
    """Say where the window begins with the last triple but one: the last two agree, and the one before is far away."""
    return (np.abs(earlier) > JUMP) & (np.hypot(before, LOG2 * change) <= AGREE)


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
