r"""The window of a ladder: which of its local orders count, where they settle, how surely, and what is left besides.

``d_k = a(t) h^p + b(t) h^q`` has local orders that approach p, and successive differences whose directions (as vectors
over time) approach each other, both like ``x_k = |b| h^(q-p)/|a|``. So the *change* of the order and the *scatter* of
the triples (`differences.scatters`) measure what is left of the next power, and the trend of the scatter says whether
it fades (the first power takes over) or grows (a lower power emerges, or noise). The *mismatch* is both together:
``sqrt(scatter^2 + (log 2 distance)^2)``, with the distance of the order from p, whatever the angle between a and b.

The half widths of intervals are empirical: the correction to the last local order that the next power would need, times
the factor that makes the intervals of random ladders with known truth contain the true order in 95 % of them and more
(``tests/analysis/synthetic.py``; the factors come from one half of these ladders and are tested on the other).

Coefficients of an error may depend on the level, by the phase of an oscillation or by chance: orders then swing about
one order although the shape of the differences stays, and no trend can be read from them. Their mean is the slope over
all levels in it, in which most of these accidents cancel, and how far they are from it says how surely it is known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.convergence import thresholds as th
from vibsim.convergence.ladder_statistics import Evidence, pick
from vibsim.convergence.roundoff_onset import before_round_off
from vibsim.core.array_types import Flags, Floats, Integers


@dataclass(frozen=True)
class Tail:
    """The last triples of every ladder before round-off; arrays of shape (...)."""

    count: Integers  # number of triples before round-off
    last: Integers  # the last of them, and the last that the order rests on
    several: Flags  # whether the one before belongs to the window, too: the order rests on several
    local: Floats  # the last local order
    change: Floats  # its change from the triple before; 0 where there is one triple only
    earlier: Floats  # the change before that; NaN where the order rests on two triples only
    scatter: Floats  # signed scatter of the last triple
    before: Floats  # that of the triple before; 0 where there is one triple only
    noise: Floats  # how much of the last triple the predicted round-off may be

    @property
    def scatter_before(self) -> Floats:
        """Size of the scatter of the triple before."""
        return np.abs(self.before)

    @property
    def turned(self) -> Flags:
        """Where the differences have turned round at the triple before the last one."""
        return self.several & np.signbit(self.before)


@dataclass(frozen=True)
class Trend(Tail):
    """The window of every ladder and the order in it; arrays of shape (...)."""

    first: Integers  # first triple that the order rests on
    cut: Flags  # whether round-off cut finer triples off
    order: Floats  # the limit of the local orders where they settle, else the last one
    width: Floats  # half the width of its interval
    low: Floats  # lower end of the interval; lower by `NEXT` where a lower power may be hiding
    high: Floats  # upper end of the interval; higher by `NEXT` where the orders have not settled
    drifting: Flags  # whether the scatter grows although round-off does not explain it
    alternating: Flags  # whether differences change their sign, or orders swing, at every level
    turning: (
        Flags  # whether changes of the order grow, or differences turn round: it is not settled
    )
    gap: Flags  # whether a triple of the window has no order: differences vanish that should not
    noisy: Flags  # whether round-off explains changes of the order as large as the last one
    fading: Flags  # whether what is left of the next power fades from triple to triple
    open: Flags  # whether the orders have not settled
    hiding: Flags  # whether a lower power may be hiding in what is left besides the first
    irregular: Flags  # whether the last orders swing about their mean: accidents of the levels
    slow: Flags  # whether what is left is not small, and fades no faster than h^(1/2)


def trend(e: Evidence, orders: Floats, of_errors: Floats, vouched: Flags) -> Trend:
    """Find the window of every ladder.

    Parameters
    ----------
    orders
        Local order of every triple, shape (..., n-2); NaN where a difference vanishes.
    of_errors
        Order of the last two true errors of three levels, shape (...); NaN where not known.
    vouched
        Where the true errors of three levels leave no room for a lower power, shape (...).
    """
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        clean, noise = before_round_off(e, orders)
        tail = _last_triples(orders, e.scatter, clean, noise)
        to_come, width = _settled(tail, e.tolerance)
        left = _left(tail, to_come)
        fading = tail.several & _fades(tail, left, to_come, e.tolerance)
        uneven = _swings(orders, e.scatter, tail, e.tolerance)
        limit = tail.local + to_come
        order = np.where(uneven.found, uneven.mean, limit)
        hiding = _hides(tail, limit, order, left, fading, vouched, uneven)
        size, change = np.abs(tail.scatter), np.abs(tail.change)
        moves = ~fading & (change > th.PASSING)
        opens = tail.turned | (left[0] > th.SETTLED_MISMATCH) | np.signbit(tail.scatter) | moves
        opens &= ~uneven.sure
        # beside a single order, that of the errors
        apart = th.OF_ERRORS * np.abs(of_errors - tail.local)
        reach = np.where(tail.several | np.isnan(apart), width, np.maximum(width, apart))
        reach, width = (np.where(uneven.found, uneven.width, x) for x in (reach, width))
        low, high = _interval(tail, order, reach, opens, hiding, ~uneven.found)
        speeds_up = (change > np.abs(tail.earlier)) & (change > 5 * th.QUIET)
        return Trend(
            **vars(tail),
            first=_first(orders, order, np.maximum(width, e.tolerance), tail.last),
            cut=tail.count < orders.shape[-1],
            order=order,
            width=width,
            low=low,
            high=high,
            open=opens,
            drifting=tail.several
            & (size > th.GROWS * np.abs(tail.before))
            & (size > np.maximum(th.QUIET, 3 * tail.noise)),
            alternating=_alternating(e.scatter, tail, e.tolerance) & ~uneven.found,
            turning=(tail.turned | speeds_up) & ~uneven.found,
            gap=np.any(clean & np.isnan(orders), axis=-1),
            noisy=change <= np.minimum(th.ROUND_OFF_SAFETY * tail.noise, th.SHOWS * size) / th.LOG2,
            fading=fading,
            hiding=hiding,
            irregular=uneven.found,
            slow=~(left[0] <= np.maximum(th.QUICK * left[1], th.SLOW)),
        )


def _last_triples(orders: Floats, scatter: Floats, clean: Flags, noise: Floats) -> Tail:
    """Return the last triples of ladders; all arrays of shape (..., m), of which the `clean` ones come first."""
    count = np.sum(clean, axis=-1)
    last = np.maximum(count - 1, 0)
    local, spread, rest = (pick(x, last) for x in (orders, scatter, noise))
    step, size = local - pick(orders, last - 1), np.abs(spread)
    # The window begins with the last triple where that is proportional, and the one before has another order: a power
    # that fades would have left more in the scatter. The coarser levels have blown up, or are no better than guesses.
    starts_here = (np.abs(step) > th.JUMP) & (size <= th.HIDDEN)
    starts_here &= size > np.maximum(th.READABLE, 3 * rest)
    several = (count > 1) & ~starts_here
    before = np.where(several, pick(scatter, last - 1), 0.0)
    change = np.where(several, step, 0.0)
    earlier = pick(orders, last - 1) - pick(orders, last - 2)
    earlier = np.where(several & (count > 2), earlier, np.nan)
    # and with the last triple but one where the last two agree, and the one before is far away
    agree = np.hypot(before, th.LOG2 * change) <= th.TRIPLES_AGREE
    earlier = np.where((np.abs(earlier) > th.JUMP) & agree, np.nan, earlier)
    return Tail(count, last, several, local, change, earlier, spread, before, rest)


def _settled(tail: Tail, tolerance: float) -> tuple[Floats, Floats]:
    """Return what the last order still lacks of its limit, and half the width of the interval of that limit.

    Where x falls by the factor f per level, so does the change of the order, and f/(1 - f) times the last change is
    still to come. f is read from the scatter, and where there are three orders from their changes. If both tell nearly
    the same, the correction is as good as they agree; if not, the changes are accidents of the levels, and the interval
    is as wide as they are.
    """
    change, earlier, spread, before = tail.change, tail.earlier, np.abs(tail.scatter), tail.before
    before = np.abs(before)
    of_scatter = np.where(before > 0, spread / np.where(before > 0, before, 1.0), 1.0)
    of_change = np.where(np.abs(earlier) > 0, change / np.where(earlier == 0, 1.0, earlier), np.nan)
    generic = np.maximum(spread, before) > th.READABLE
    generic &= spread > th.PARALLEL * th.LOG2 * np.abs(change)
    steady = (of_change > th.FASTEST) & (of_change < th.SLOWEST)
    falls = of_scatter <= th.FADING
    settled = steady & generic & (np.abs(of_change - of_scatter) <= th.SAME_POWER) & falls
    alone = steady & ~generic
    fades = settled | (generic & falls & np.isnan(earlier))
    f = np.where(fades, of_scatter, np.where(alone, of_change, 0.0))
    to_come = np.where(tail.several, change * f / (1.0 - np.minimum(f, th.SLOWEST)), 0.0)
    largest = np.fmax(np.abs(change), np.abs(earlier))
    doubt = np.abs(of_change - of_scatter) + spread
    unknown = np.where(generic & falls, th.OF_FADING, th.OF_CHANGE)
    width = np.where(
        settled,
        np.abs(change) * np.minimum(th.MOST_SETTLED, th.OF_SETTLED * doubt),
        np.where(alone, th.OF_STEADY * largest, unknown * np.maximum(largest, spread / 3)),
    )
    single = np.maximum(th.OF_SCATTER * spread / th.LOG2, th.SINGLE_WIDTH)
    width = np.maximum(np.where(tail.several, width, single), th.LEAST_WIDTH)
    width = np.maximum(width, np.minimum(tail.noise, th.SHOWS * spread) / th.LOG2)
    # what is so far away is not known to be reached
    far = np.abs(to_come) > tolerance
    return np.where(far, 0.0, to_come), np.where(far, np.maximum(width, np.abs(to_come)), width)


def _left(tail: Tail, to_come: Floats) -> tuple[Floats, Floats]:
    """Return how far the last triple, and the one before, are from series of the stated order."""
    known, change = to_come != 0, tail.change
    last = np.where(known, np.abs(to_come), np.abs(change))
    first = np.where(known, np.abs(to_come + change), np.nan_to_num(np.abs(tail.earlier)))
    return np.hypot(tail.scatter, th.LOG2 * last), np.hypot(tail.before, th.LOG2 * first)


def _fades(tail: Tail, left: tuple[Floats, Floats], to_come: Floats, tolerance: float) -> Flags:
    """Say where what is left fades from triple to triple."""
    small, large = np.abs(tail.scatter), np.abs(tail.before)
    onward = tail.change * tail.earlier > 0
    by_scatter = (large > th.READABLE) & (small <= th.FADING * large)
    whole = (left[0] <= th.FADING * left[1]) & (by_scatter | (onward & (small <= 0.5 * th.HIDDEN)))
    return np.asarray(whole | (by_scatter & (np.abs(to_come) <= tolerance)))


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
    gap = np.clip(np.log2(np.maximum(growth, 1.0)), 0.5, th.LARGEST_POWER_GAP)
    p = np.maximum(order, 1.0)
    lower = np.exp2(np.maximum(p - gap, 0.5)) - 1
    seen = th.EMERGING * lower / (np.exp2(p) - 1) * (1 - np.exp2(-gap))
    return np.where(several & (growth > th.GROWS), seen, th.HIDDEN)


@dataclass(frozen=True)
class _Swings:
    """Where orders swing about their mean; arrays of shape (...)."""

    found: Flags
    sure: Flags  # whether they change their direction so often that no power can do that
    mean: Floats  # mean of these orders; NaN where they do not swing
    width: Floats  # half the width of its interval


def _swings(orders: Floats, scatter: Floats, tail: Tail, tolerance: float) -> _Swings:
    """Find the ladders of which the last orders swing about their mean, by no more than the tolerance."""
    fewest, most = th.JITTER_ORDERS
    shape = tail.last.shape
    found, sure = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    mean, width = np.full(shape, np.nan), np.full(shape, np.nan)
    for count in range(fewest, min(most, orders.shape[-1]) + 1):
        # the last triple first
        index = np.maximum(tail.last[..., None] - np.arange(count), 0)
        values, left = (np.take_along_axis(x, index, axis=-1) for x in (orders, scatter))
        change = np.diff(values, axis=-1)
        turns = np.sum(change[..., 1:] * change[..., :-1] < 0, axis=-1)
        middle = np.mean(values, axis=-1)
        away = np.max(np.abs(values - middle[..., None]), axis=-1)
        swings = tail.several & (tail.last + 1 >= count) & (away <= tolerance)
        swings &= turns >= (1 if count == fewest else th.SURE_TURNS)
        swings &= np.all((left >= 0) & (left <= th.COINCIDENT), axis=-1)
        # differences that turn from their direction do so by another power
        swings &= ~((left[..., 0] > th.GROWS * left[..., 1]) & (left[..., 0] > th.QUIET))
        found |= swings
        sure = np.where(swings, turns >= th.SURE_TURNS, sure)
        mean = np.where(swings, middle, mean)
        width = np.where(swings, th.OF_SWINGS * away, width)
    return _Swings(found, sure, mean, width)


def _hides(
    tail: Tail,
    limit: Floats,
    order: Floats,
    left: tuple[Floats, Floats],
    fading: Flags,
    vouched: Flags,
    uneven: _Swings,
) -> Flags:
    """Say where a lower power may be hiding in what is left besides the first one."""
    # what round-off may have made does not tell of a lower power that grows
    grown = tail.several & (left[0] > tail.noise)
    hiding = ~fading & (left[0] > most_left(limit, *left, grown)) & (tail.several | ~vouched)
    suspect = th.SUSPECT * most_left(order, *left, grown)
    hiding |= ~fading & grown & (left[0] > np.maximum(th.GROWS * left[1], suspect))
    hiding |= ~fading & uneven.found & (left[0] > th.SUSPECT * th.HIDDEN)
    return np.asarray(hiding & ~uneven.sure)


def lowest(low: Floats, further: float | Floats) -> Floats:
    """Return the lower end of an interval that reaches further down, to the order 0 of a limit that is missed."""
    return np.maximum(low - further, np.minimum(low, 0.0))


def _interval(
    tail: Tail, order: Floats, reach: Floats, opens: Flags, hiding: Flags, trend: Flags
) -> tuple[Floats, Floats]:
    """Return the ends of the interval of the order; `trend`: whether the last change is more than an accident."""
    # where orders fall, a higher one is behind
    falls = trend & tail.several & (tail.change < 0) & ~np.signbit(tail.scatter) & ~tail.turned
    low = lowest(order - reach, np.where(opens | hiding, th.NEXT, 0.0))
    high = np.where(falls, np.maximum(order, tail.local), order) + reach
    high += np.where(opens & ~falls, th.NEXT, 0.0)
    # the order of an expansion next to it belongs to it, too
    nearest = np.round(2.0 * order) / 2
    near = np.abs(order - nearest) <= th.NEAREST
    low = np.where(near, np.minimum(low, nearest), low)
    return low, np.where(near, np.maximum(high, nearest), high)


def mismatches(t: Trend, p: Floats) -> tuple[Floats, Floats]:
    """Return how far the last triple, and the one before, are from proportional series of order p."""
    now = np.hypot(t.scatter, th.LOG2 * (t.local - p))
    return now, np.hypot(t.scatter_before, th.LOG2 * (t.local - t.change - p))


def _alternating(scatter: Floats, tail: Tail, tolerance: float) -> Flags:
    """Say where differences alternate in sign, or orders swing without settling."""
    now, before = tail.scatter, pick(scatter, tail.last - 1)
    signs = np.signbit(now) & np.where(tail.several, np.signbit(before), now > -0.5)
    swings = tail.change * tail.earlier < 0
    wide = np.abs(tail.change) > np.maximum(tolerance, 0.5 * np.abs(tail.earlier))
    return signs | (swings & wide)


def _first(orders: Floats, order: Floats, reach: Floats, last: Integers) -> Integers:
    """Return the first triple from which on the local orders stay within `reach` of the order."""
    index = np.arange(orders.shape[-1])
    away = ~(np.abs(orders - order[..., None]) <= reach[..., None])
    away &= index < np.maximum(last - 1, 0)[..., None]
    return np.asarray(np.max(np.where(away, index + 1, 0), axis=-1))
