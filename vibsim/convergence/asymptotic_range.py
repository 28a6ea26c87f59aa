r"""The window of a ladder: which of its local orders count, where they settle, and how surely.

``d_k = a(t) h^p + b(t) h^q`` has local orders that approach p, and successive differences whose directions (as vectors
over time) approach each other, both like ``x_k = |b| h^(q-p)/|a|``. So the *change* of the order and the *scatter* of
the triples (`differences.scatter`) measure what is left of the next power, and the trend of the scatter says whether it
fades (the first power takes over) or grows (a lower power emerges, or noise).

What is left, and the interval, are worked out in `vibsim.convergence.settled_orders`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.convergence.ladder_statistics import pick
from vibsim.convergence.level_jitter import Uneven, accidents
from vibsim.convergence.roundoff_onset import before_round_off, noise_share
from vibsim.convergence.settled_orders import (
    fades,
    left,
    lowest,
    most_left,
    settling,
    with_errors,
    with_nearest,
)
from vibsim.convergence.thresholds import (
    GROWS,
    HIDDEN,
    JUMP,
    LOG2,
    NEXT,
    PASSING,
    QUICK,
    QUIET,
    READABLE,
    ROUND_OFF_SAFETY,
    SETTLED_MISMATCH,
    SHOWS,
    SLOW,
    SUSPECT,
    TRIPLES_AGREE,
)
from vibsim.core.array_types import Flags, Floats, Integers


@dataclass(frozen=True)
class Tail:
    """The last triples of every ladder before round-off; arrays of shape (...)."""

    count: Integers
    """Number of triples before round-off."""
    last: Integers
    """The last of them, and the last that the order rests on."""
    several: Flags
    """Whether the one before belongs to the window, too, so that the order rests on several triples."""
    local: Floats
    """The last local order."""
    change: Floats
    """Its change from the triple before; 0 where there is one triple only."""
    earlier: Floats
    """The change before that; NaN where the order rests on two triples only."""
    scatter: Floats
    """Signed scatter of the last triple."""
    before: Floats
    """That of the triple before; 0 where there is one triple only."""
    noise: Floats
    """How much of the last triple the predicted round-off may be."""

    @property
    def scatter_before(self) -> Floats:
        """Size of the scatter of the triple before."""
        return np.abs(self.before)


@dataclass(frozen=True)
class Trend(Tail):
    """The window of every ladder and the order in it; arrays of shape (...)."""

    first: Integers
    """First triple that the order rests on."""
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
    irregular: Flags
    """Whether the last orders swing about their mean: accidents of the levels."""
    slow: Flags
    """Whether what is left is not small, and fades no faster than h^(1/2)."""


def trend(
    orders: Floats,
    scatter: Floats,
    difference: Floats,
    floor: Floats,
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
        clean = before_round_off(orders, scatter, difference, noise, possible, numbers)
        tail = _last_triples(orders, scatter, clean, noise)
        to_come, width = _settled(tail, tolerance)
        beside = left(tail.scatter, tail.before, tail.change, tail.earlier, to_come)
        onward = tail.change * tail.earlier > 0
        fading = tail.several & fades(beside, tail.scatter, tail.before, to_come, onward, tolerance)
        uneven = accidents(orders, scatter, tail.last, tail.several, tolerance)
        limit = tail.local + to_come
        order = np.where(uneven.found, uneven.mean, limit)
        hiding = _hides(tail, limit, order, beside, fading, vouched, uneven)
        open_ = _opens(tail, beside, fading) & ~uneven.sure
        reach = width
        if of_errors is not None:
            reach = with_errors(width, tail.local, of_errors, tail.several)
        reach, width = (np.where(uneven.found, uneven.width, x) for x in (reach, width))
        low, high = _interval(tail, order, reach, open_, hiding, ~uneven.found)
        size, change = np.abs(tail.scatter), np.abs(tail.change)
        return Trend(
            **vars(tail),
            first=_first(orders, order, np.maximum(width, tolerance), tail.last),
            cut=tail.count < orders.shape[-1],
            order=order,
            width=width,
            low=low,
            high=high,
            open=open_,
            drifting=tail.several
            & (size > GROWS * np.abs(tail.before))
            & (size > np.maximum(QUIET, 3 * tail.noise)),
            alternating=_alternating(scatter, tail, tolerance) & ~uneven.found,
            turning=(_turned(tail) | _speeds_up(tail)) & ~uneven.found,
            gap=np.any(clean & np.isnan(orders), axis=-1),
            noisy=change <= np.minimum(ROUND_OFF_SAFETY * tail.noise, SHOWS * size) / LOG2,
            fading=fading,
            hiding=hiding,
            irregular=uneven.found,
            slow=~(beside[0] <= np.maximum(QUICK * beside[1], SLOW)),
        )


def _last_triples(orders: Floats, scatter: Floats, clean: Flags, noise: Floats) -> Tail:
    """Return the last triples of ladders; all arrays of shape (..., m), of which the `clean` ones come first."""
    count = np.sum(clean, axis=-1)
    last = np.maximum(count - 1, 0)
    local, spread, rest = (pick(x, last) for x in (orders, scatter, noise))
    jump = np.abs(local - pick(orders, last - 1))
    several = (count > 1) & ~_starts_here(jump, np.abs(spread), rest)
    before = np.where(several, pick(scatter, last - 1), 0.0)
    change = np.where(several, local - pick(orders, last - 1), 0.0)
    known = several & (count > 2)
    earlier = np.where(known, pick(orders, last - 1) - pick(orders, last - 2), np.nan)
    earlier = np.where(_starts_before(before, change, earlier), np.nan, earlier)
    return Tail(count, last, several, local, change, earlier, spread, before, rest)


def _starts_here(jump: Floats, size: Floats, noise: Floats) -> Flags:
    """Say where the window begins with the last triple: it is proportional, and the one before has another order.

    A power that fades would have left more in the scatter than there is. The coarser levels are of another range:
    they have blown up, or their errors are as large as the solution.
    """
    return (jump > JUMP) & (size <= HIDDEN) & (size > np.maximum(READABLE, 3 * noise))


def _starts_before(before: Floats, change: Floats, earlier: Floats) -> Flags:
    """Say where the window begins with the last triple but one: the last two agree, and the one before is far away."""
    return (np.abs(earlier) > JUMP) & (np.hypot(before, LOG2 * change) <= TRIPLES_AGREE)


def _settled(tail: Tail, tolerance: float) -> tuple[Floats, Floats]:
    """Return what the last order still lacks of its limit, and half the width of the interval of that limit."""
    size = np.abs(tail.scatter)
    to_come, width = settling(size, np.abs(tail.before), tail.change, tail.earlier, tail.several)
    width = np.maximum(width, np.minimum(tail.noise, SHOWS * size) / LOG2)
    # what is so far away is not known to be reached
    far = np.abs(to_come) > tolerance
    return np.where(far, 0.0, to_come), np.where(far, np.maximum(width, np.abs(to_come)), width)


def _turned(tail: Tail) -> Flags:
    """Say where the differences have turned round at the triple before the last one."""
    return tail.several & np.signbit(tail.before)


def _speeds_up(tail: Tail) -> Flags:
    """Say where the changes of the order grow."""
    change = np.abs(tail.change)
    return (change > np.abs(tail.earlier)) & (change > 5 * QUIET)


def _opens(tail: Tail, beside: tuple[Floats, Floats], fading: Flags) -> Flags:
    """Say where the orders have not settled."""
    moves = ~fading & (np.abs(tail.change) > PASSING)
    return _turned(tail) | (beside[0] > SETTLED_MISMATCH) | np.signbit(tail.scatter) | moves


def _hides(
    tail: Tail,
    limit: Floats,
    order: Floats,
    beside: tuple[Floats, Floats],
    fading: Flags,
    vouched: Flags | None,
    uneven: Uneven,
) -> Flags:
    """Say where a lower power may be hiding in what is left besides the first one."""
    # what round-off may have made does not tell of a lower power that grows
    grown = tail.several & (beside[0] > tail.noise)
    hiding = ~fading & (beside[0] > most_left(limit, *beside, grown))
    if vouched is not None:
        hiding &= tail.several | ~vouched
    suspect = SUSPECT * most_left(order, *beside, grown)
    hiding |= ~fading & grown & (beside[0] > np.maximum(GROWS * beside[1], suspect))
    hiding |= uneven.found & (beside[0] > SUSPECT * HIDDEN)
    return np.asarray(hiding & ~uneven.sure)


def _interval(
    tail: Tail, order: Floats, reach: Floats, open_: Flags, hiding: Flags, trend: Flags
) -> tuple[Floats, Floats]:
    """Return the ends of the interval of the order; `trend`: whether the last change is more than an accident."""
    # where orders fall, a higher one is behind
    falls = trend & tail.several & (tail.change < 0) & ~np.signbit(tail.scatter) & ~_turned(tail)
    low = lowest(order - reach, np.where(open_ | hiding, NEXT, 0.0))
    high = np.where(falls, np.maximum(order, tail.local), order) + reach
    high += np.where(open_ & ~falls, NEXT, 0.0)
    return with_nearest(order, low, high)


def mismatches(t: Trend, p: Floats) -> tuple[Floats, Floats]:
    """Return how far the last triple, and the one before, are from proportional series of order p."""
    now = np.hypot(t.scatter, LOG2 * (t.local - p))
    return now, np.hypot(t.scatter_before, LOG2 * (t.local - t.change - p))


def _alternating(scatter: Floats, tail: Tail, tolerance: float) -> Flags:
    """Say where differences alternate in sign, or orders swing without settling."""
    now = tail.scatter
    before = pick(scatter, tail.last - 1)
    signs = np.signbit(now) & np.where(tail.several, np.signbit(before), now > -0.5)
    swings = tail.change * tail.earlier < 0
    size = np.abs(tail.change)
    return signs | (swings & (size > np.maximum(tolerance, 0.5 * np.abs(tail.earlier))))


def _first(orders: Floats, order: Floats, reach: Floats, last: Integers) -> Integers:
    """Return the first triple from which on the local orders stay within `reach` of the order."""
    index = np.arange(orders.shape[-1])
    away = ~(np.abs(orders - order[..., None]) <= reach[..., None])
    away &= index < np.maximum(last - 1, 0)[..., None]
    return np.asarray(np.max(np.where(away, index + 1, 0), axis=-1))
