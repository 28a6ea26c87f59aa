r"""Where round-off begins in a ladder: the triples before it, from the predicted floor and from the data.

Noise is told from an error by its shape. The differences of an error are proportional over time; a lower power that
emerges turns them once and leaves them proportional again. Noise differs from level to level, so that its differences
have nothing to do with each other, and it does not fall. Three floors are told apart by how much evidence they take:

- *predicted*: up to `ABOVE_ROUND_OFF` times what the scheme predicts for its arithmetic. One triple that breaks the
  trend is evidence enough;
- *possible*: up to `ROUND_OFF_SAFETY` times eps N^2, more than double precision makes of N steps in any arithmetic.
  It is fitted: the scatter must rise faster than any lower power can make it (`STEEP`), up to the finest level;
- *unexplained*: any size. The finest `PLATEAU` triples must show unrelated differences that do not fall, or the scatter
  must rise to unrelated differences more steeply than that of any lower power, twice in turn. A single bad level cannot
  look like that. Single numbers have no shape: of these, the finest differences must stop falling.
"""

from __future__ import annotations

import numpy as np

from vibsim.convergence import thresholds as th
from vibsim.convergence.ladder_statistics import Evidence
from vibsim.core.array_types import Flags, Floats


def before_round_off(e: Evidence, orders: Floats) -> tuple[Flags, Floats]:
    """Say of every triple whether it stands before the first one that round-off spoils.

    Parameters
    ----------
    orders
        Local order of every triple, shape (..., n-2).

    Returns
    -------
    tuple of array
        Shape (..., n-2); and how much of the finer difference of each triple the predicted round-off may be.
    """
    scatter, difference = e.scatter, e.difference
    noise, possible = (
        _share(difference[..., 1:], floor[..., 1:]) for floor in (e.floor, e.ceiling)
    )
    incoherent = np.signbit(scatter) | (np.abs(scatter) > th.INCOHERENT) | np.isnan(scatter)
    # what rises out of the floor again on a finer level was no floor
    predicted = _from_here_on(noise) >= 1.0 / th.ABOVE_ROUND_OFF
    spoiled = _breaks_the_trend(orders, scatter, incoherent) & predicted
    # single numbers have no shape that could vouch for differences far below their round-off
    spoiled |= e.numbers[..., None] & (_from_here_on(noise) >= th.ABOVE_ROUND_OFF)
    onset = _onset(orders, scatter, incoherent)
    share = possible / np.fmax(np.fmin(np.abs(scatter), 1.0), th.SINGLE_NUMBER)
    spoiled |= onset & (_from_here_on(share) * th.ROUND_OFF_SAFETY >= 1.0)
    floor = _plateau(incoherent, difference) | _climbs(orders, scatter, incoherent)
    spoiled[..., th.TRIPLES_BEFORE :] |= (onset & floor[..., None])[..., th.TRIPLES_BEFORE :]
    spoiled |= _below_a_flat_end(difference, orders) & e.numbers[..., None] & ~predicted
    return ~np.logical_or.accumulate(spoiled, axis=-1), noise


def _share(finer: Floats, floor: Floats) -> Floats:
    """Return the round-off of pairs of levels over their differences, infinite where these vanish."""
    pairs = floor[..., :-1] + floor[..., 1:]
    return np.where(finer > 0, pairs / np.where(finer > 0, finer, 1.0), np.inf)


def _from_here_on(values: Floats) -> Floats:
    """Return the least value of a triple and all finer ones."""
    return np.minimum.accumulate(values[..., ::-1], axis=-1)[..., ::-1]


def _breaks_the_trend(orders: Floats, scatter: Floats, incoherent: Flags) -> Flags:
    """Say of every triple whether it does not continue the trend.

    It is less proportional than the one before, its order has changed by more than before, or its differences are of
    opposite sign. Noise that changes an order shows in the scatter as well: a change larger than that is no noise,
    unless the series are single numbers, which have no scatter. And a scatter that rises less steeply than that of any
    lower power may rise is no noise; of single numbers, the same is true of the changes of the order.
    """
    size = np.abs(scatter)
    breaks = np.isnan(orders) | np.isnan(scatter) | np.signbit(scatter)
    breaks[..., 0] |= (size[..., 0] > th.UNRELATED_FIRST) | (orders[..., 0] < th.HALF_SPACING)
    change = np.abs(np.diff(orders, axis=-1))
    for i in range(1, orders.shape[-1]):
        usual = np.maximum(th.QUIET, change[..., i - 2]) if i > 1 else 5 * th.QUIET
        worse = size[..., i] > np.maximum(th.AUDIBLE, size[..., i - 1])
        by_noise = change[..., i - 1] <= th.SHOWS * size[..., i] / th.LOG2
        steep = size[..., i] > np.exp2(orders[..., i - 1] - 0.5) * size[..., i - 1]
        by_noise &= steep | incoherent[..., i]
        number = np.maximum(size[..., i], size[..., i - 1]) < th.SINGLE_NUMBER
        if i > 1:
            number &= change[..., i - 1] > np.exp2(orders[..., i - 1] - 0.5) * change[..., i - 2]
        by_noise |= number
        breaks[..., i] |= (worse | (change[..., i - 1] > usual)) & by_noise
    return breaks


def _onset(orders: Floats, scatter: Floats, incoherent: Flags) -> Flags:
    """Say of every triple whether noise begins there by the data alone, and stays to the finest level.

    It begins with an incoherent triple, or one whose scatter has risen too steeply for a power, and reaches back over
    the triples on which the scatter rises to it. What follows must be incoherent.
    """
    size, count = np.abs(scatter), orders.shape[-1]
    to_the_end = np.logical_and.accumulate(incoherent[..., ::-1], axis=-1)[..., ::-1]
    begins = to_the_end.copy()
    most = steepest(orders)
    for i in range(count - 1, 0, -1):
        rises = (size[..., i] > th.AUDIBLE) & (size[..., i] > size[..., i - 1])
        steep = size[..., i] > most[..., i - 1] * size[..., i - 1]
        if i + 1 < count:
            # what is begun here must go on
            rises &= begins[..., i + 1]
            steep |= to_the_end[..., i + 1]
        begins[..., i] |= rises & (steep | begins[..., i])
    return begins


def steepest(orders: Floats) -> Floats:
    """Return the factor by which no lower power makes the scatter rise from one triple to the next."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(th.STEEP * np.exp2(np.clip(orders - 0.5, 0.5, 64.0)))


def _climbs(orders: Floats, scatter: Floats, incoherent: Flags) -> Flags:
    """Say of every ladder whether the scatter rises to unrelated differences, twice too steeply for a power.

    A floor does that, which a single bad level does not: its scatter is large at once.
    """
    if orders.shape[-1] <= th.TRIPLES_BEFORE:
        return np.zeros(orders.shape[:-1], dtype=bool)
    size = np.abs(scatter)
    most = steepest(orders)
    with np.errstate(over="ignore", invalid="ignore"):
        steep = (size[..., 1:] > most[..., :-1] * size[..., :-1]) & (size[..., 1:] > th.AUDIBLE)
    return np.asarray(incoherent[..., -1] & np.any(steep[..., 1:] & steep[..., :-1], axis=-1))


def _below_a_flat_end(difference: Floats, orders: Floats) -> Flags:
    """Say of every triple of single numbers whether it is spoiled by a floor that the finest differences show.

    Numbers have no shape by which noise could be told. But differences that do not fall any more, over `PLATEAU` of
    them at least, are a floor. The first of them tells its size; on coarser levels it is smaller like N^(1/2), as the
    errors of single steps add up at least. What is not far above it is spoiled, or spoils the error
    at the finer level, smaller by 2^p - 1.
    """
    pairs = difference.shape[-1]
    index = np.arange(pairs)
    noise = np.zeros(difference.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.log2(difference)
        for first in range(pairs - th.PLATEAU, th.TRIPLES_BEFORE - 1, -1):
            flat = size[..., first] - size[..., -1] < th.HALF_SPACING * (pairs - 1 - first)
            grown = difference[..., first : first + 1] * np.exp2(0.5 * (index - first))
            noise = np.where(flat[..., None], grown, noise)
        heard = np.minimum(th.HEARD, th.HEARD_IN_ERROR / (np.exp2(np.clip(orders, 1.0, 16.0)) - 1))
        spoiled = ~(noise[..., 1:] <= heard * difference[..., 1:])
    vouched = np.sum(np.logical_and.accumulate(~spoiled, axis=-1), axis=-1) >= th.TRIPLES_BEFORE
    return np.asarray(spoiled & vouched[..., None])


def _plateau(incoherent: Flags, difference: Floats) -> Flags:
    """Say of every ladder whether its finest differences are unrelated and do not fall."""
    if incoherent.shape[-1] < th.PLATEAU:
        return np.zeros(incoherent.shape[:-1], dtype=bool)
    last = difference[..., -th.PLATEAU :]
    return np.asarray(
        np.all(incoherent[..., -th.PLATEAU :], axis=-1)
        & (last[..., -1] >= th.STAYS * last[..., 0])
        & (last[..., -1] > 0)
    )
