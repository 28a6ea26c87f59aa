r"""The window of a ladder: which of its local orders count, where they settle, and how surely.

``d_k = a(t) h^p + b(t) h^q`` has local orders that approach p, and successive differences whose directions (as vectors
over time) approach each other, both like ``x_k = |b| h^(q-p)/|a|``. So the *change* of the order and the *scatter* of
the triples (`series.scatter`) measure what is left of the next power, and the trend of the scatter says whether it
fades (the first power takes over) or grows (a lower power emerges, or noise).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]

FADING = 0.75
"""The scatter fades when it falls at least to this part of itself per level (1/2 and 1/4 are usual)."""
QUIET = 0.01
"""Scatter or change of the order too small to read a trend from."""
SHOWS = 3.0
"""Noise changes an order by no more than so many times its scatter (over log 2)."""
UNRELATED_FIRST = 0.1
"""A first triple with more scatter has no trend before it that could vouch for it: suspect differences spoil it."""
FLAT_FIRST = 0.25
"""The same for a first triple with a lower order, half the least that an expansion has: noise does not fall with dt."""
GROWS = 1.3
"""The scatter drifts when it grows by more per level; a power lower by 1/2 makes it grow by 2^0.5."""
LOUD = 10.0
"""Round-off may be so many times its predicted floor, an order of magnitude, and move the order accordingly."""
LEAST_WIDTH = 1e-3
"""Half the width of an interval at least: what is assumed of the powers beyond the next one carries no more digits."""
LOG2 = float(np.log(2.0))


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
    """Whether the changes of the order grow, so that it has not settled."""
    gap: Flags
    """Whether a triple of the window has no order: differences vanish that should not."""
    noisy: Flags
    """Whether round-off explains changes of the order as large as the last one."""

    @property
    def low(self) -> Floats:
        """Lower end of the interval."""
        return np.asarray(np.minimum(self.order, self.local) - self.width)

    @property
    def high(self) -> Floats:
        """Upper end of the interval."""
        return np.asarray(np.maximum(self.order, self.local) + self.width)


def trend(
    orders: Floats,
    scatter: Floats,
    difference: Floats,
    floor: Floats,
    blame: float,
    tolerance: float,
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
    """
    with np.errstate(invalid="ignore", over="ignore"):
        noise = _noise(difference, floor)
        clean = _before_round_off(orders, scatter, noise, 1.0 / blame)
        count = np.sum(clean, axis=-1)
        last = np.maximum(count - 1, 0)
        local, spread, rest = (_at(x, last) for x in (orders, scatter, noise))
        several = count > 1
        change = np.where(several, local - _at(orders, last - 1), 0.0)
        earlier = np.where(count > 2, _at(orders, last - 1) - _at(orders, last - 2), np.nan)
        fade = _fade(spread, _at(scatter, last - 1), change, earlier)
        tail = np.where(fade < 1, change * fade / (1 - np.minimum(fade, FADING)), 0.0)
        width = np.where(several, _width(spread, change, tail, fade), np.abs(spread) / LOG2)
        rounded = np.minimum(rest, SHOWS * np.abs(spread)) / LOG2
        width = np.maximum(width, np.maximum(rounded, LEAST_WIDTH))
        settles = several & (fade <= FADING) & (np.abs(tail) <= tolerance)
        order = np.where(settles, local + tail, local)
        unexplained = np.abs(spread) > 3 * rest
        return Trend(
            count=count,
            first=_first(orders, order, np.maximum(width, tolerance), last),
            last=last,
            cut=count < orders.shape[-1],
            order=order,
            width=width,
            local=local,
            change=change,
            scatter=spread,
            scatter_before=np.where(several, np.abs(_at(scatter, last - 1)), 0.0),
            drifting=several
            & (np.abs(spread) > GROWS * np.abs(_at(scatter, last - 1)))
            & (np.abs(spread) > QUIET)
            & unexplained,
            alternating=_alternating(scatter, last, several, change, earlier, tolerance),
            turning=(np.abs(change) > np.abs(earlier)) & (np.abs(change) > 5 * QUIET),
            gap=np.any(clean & np.isnan(orders), axis=-1),
            noisy=np.abs(change) <= np.minimum(LOUD * rest, SHOWS * np.abs(spread)) / LOG2,
        )


def _noise(difference: Floats, floor: Floats) -> Floats:
    """Return floor over difference for the finer pair of every triple, shape (..., m)."""
    pairs = floor[..., 1:-1] + floor[..., 2:]
    finer = difference[..., 1:]
    return np.where(finer > 0, pairs / np.where(finer > 0, finer, 1.0), np.inf)


def _before_round_off(orders: Floats, scatter: Floats, noise: Floats, suspect: float) -> Flags:
    """Say of every triple whether it stands before the first one that round-off spoils.

    Spoiled is a triple whose finer differences are all suspect and that does not continue the trend: less
    proportional than the one before, its order changed by more than before, or its differences of opposite sign.
    Noise that changes an order shows in the scatter as well: a change larger than that is no noise.
    """
    size = np.abs(scatter)
    spoiled = np.isnan(orders) | np.isnan(scatter) | (scatter < 0)
    spoiled[..., 0] |= (size[..., 0] > UNRELATED_FIRST) | (orders[..., 0] < FLAT_FIRST)
    change = np.abs(np.diff(orders, axis=-1))
    for i in range(1, orders.shape[-1]):
        usual = np.maximum(QUIET, change[..., i - 2]) if i > 1 else 5 * QUIET
        worse = size[..., i] > np.maximum(QUIET, size[..., i - 1])
        by_noise = change[..., i - 1] <= SHOWS * size[..., i] / LOG2
        spoiled[..., i] |= (worse | (change[..., i - 1] > usual)) & by_noise
    # what rises out of the floor again on a finer level was no floor
    spoiled &= np.minimum.accumulate(noise[..., ::-1], axis=-1)[..., ::-1] >= suspect
    return ~np.logical_or.accumulate(spoiled, axis=-1)


def _fade(spread: Floats, before: Floats, change: Floats, earlier: Floats) -> Floats:
    """Return the factor per level by which the next power fades; 1 where it does not, or is not known to.

    Read from the scatter, and from the changes of the order; the slower of the two counts.
    """
    small, large = np.abs(spread), np.abs(before)
    of_scatter = np.where(large > 0, small / np.where(large > 0, large, 1.0), 1.0)
    quiet = np.maximum(small, large) <= 1e-6
    of_change = np.where(np.abs(earlier) > 0, change / np.where(earlier == 0, 1.0, earlier), np.nan)
    readable = np.isfinite(of_change) & (np.abs(earlier) > QUIET / 10)
    swings = np.where(of_change < 0, np.abs(of_change), of_change)
    slower = np.where(quiet, swings, np.maximum(of_scatter, swings))
    # proportional series without a third order to tell the trend: the slowest usual rate
    alone = np.where(quiet, 0.5, of_scatter)
    return np.asarray(np.minimum(np.where(readable, slower, alone), 1.0))


def _width(spread: Floats, change: Floats, tail: Floats, fade: Floats) -> Floats:
    """Return half the width of the interval of an order read from several triples."""
    fading = np.maximum(np.maximum(np.abs(change), np.abs(tail)), spread**2 / LOG2)
    staying = np.maximum(3 * np.abs(change), np.minimum(np.abs(spread) / LOG2, 2.0))
    return np.where(fade <= FADING, fading, staying)


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
    signs = (now < 0) & np.where(several, _at(scatter, last - 1) < 0, now > -0.5)
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
