"""The largest value of a smooth function between its samples, from polynomials through the samples around a crest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial

from vibsim.core.array_types import Flags, Floats, Integers

WIDTH, NARROW = 7, 5
"""Points of the polynomial, and of a narrower one: their distance is the error bound."""
SMOOTH = 0.25
"""A function has no corner if its fifth differences are below this part of the third ones: w dt = 1/2. [derived]"""
_SIDE = WIDTH // 2
_NEWTON_STEPS = 4


def largest_between_samples(grids: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Return the largest value of each function, and a bound of its error, shape (m, grid).

    Parameters
    ----------
    grids
        At least `WIDTH` equally spaced samples on each grid, shape (m, t). The result is NaN if one is not finite.
    """
    is_finite = np.stack([np.isfinite(series).all(axis=-1) for series in grids])
    finite = [np.where(k[:, None], x, 0.0) for k, x in zip(is_finite, grids, strict=True)]
    largest = np.stack([np.max(series, axis=-1) for series in finite])
    bound = np.zeros(largest.shape)
    crests = [_crests(series, top) for series, top in zip(finite, largest, strict=True)]
    grid = np.repeat(np.arange(len(grids)), [len(crest.row) for crest in crests])
    row, _, place, limit, samples = (np.concatenate(x) for x in zip(*crests, strict=True))
    _, value, error = _highest(samples, place)
    np.maximum.at(largest, (grid, row), np.minimum(value, limit))
    np.maximum.at(bound, (grid, row), error)
    return np.where(is_finite, largest, np.nan).T, np.where(is_finite, bound, np.nan).T


class _Crests(NamedTuple):
    """Local maxima of the samples, near which a function may exceed all samples; arrays of shape (crest,)."""

    row: Integers
    centre: Integers  # index of the middle sample of the polynomial
    place: Integers  # index of the crest relative to the middle sample
    limit: Floats  # upper bound of a smooth function near the crest
    samples: Floats  # samples of the polynomial, shape (crest, WIDTH)


def _crests(series: Floats, top: Floats) -> _Crests:
    """Return the crests that may exceed the largest sample `top` of their function."""
    row, index = np.nonzero(_is_crest(series))
    centre = np.clip(index, _SIDE, series.shape[-1] - 1 - _SIDE)
    samples = series[row[:, None], centre[:, None] + np.arange(-_SIDE, _SIDE + 1)]
    # at a corner a function exceeds its samples by half of a second difference
    limit = series[row, index] + 0.5 * _largest_difference(samples, 2)
    may = limit >= top[row]
    return _Crests(row[may], centre[may], (index - centre)[may], limit[may], samples[may])


class Heights(NamedTuple):
    """Crests of several functions in the order of rows and places."""

    keys: Floats  # twice the row, plus the place as a part of the interval
    values: Floats


def rise_of_other_crests(grids: Sequence[Heights], falls: Sequence[Floats]) -> Floats:
    """Return by how much another crest may exceed, in the limit, the crest that is the highest on the finest grid.

    The lead of each crest over the highest is extrapolated from the two finest grids. Its uncertainty is what it would
    change by if extrapolated again from the lead that the two grids before tell. Without a third grid, it is what the
    crest has still to change.

    Parameters
    ----------
    grids
        Crests of m functions on two or three grids, the finest last.
    falls
        Remaining change to the limit, over the change from a grid to the next, shape (m,).

    Returns
    -------
    array
        Shape (m,); 0 if no other crest can be the highest.
    """
    count, fine = len(falls[-1]), grids[-1]
    if not all(len(crests.keys) for crests in grids):
        return np.zeros(count)
    row = fine.keys.astype(np.int64) // 2
    highest = np.full(count, -np.inf)
    np.maximum.at(highest, row, fine.values)
    is_highest = fine.values == highest[row]
    partner, is_same, limit = _extrapolated(grids[-2], fine, falls[-1])
    lead = _lead(limit, row, is_highest, count)
    unsure = np.abs(limit - fine.values)
    if len(grids) > 2:
        *_, before = _extrapolated(grids[-3], grids[-2], falls[-2])
        change = lead - _lead(before[partner], row, is_highest, count)
        unsure = np.where(is_same, falls[-1][row] * np.abs(change), 0.0)
    rise = np.zeros(count)
    np.maximum.at(rise, row, np.where(is_highest, 0.0, lead + unsure))
    return rise


def _extrapolated(coarse: Heights, fine: Heights, fall: Floats) -> tuple[Integers, Flags, Floats]:
    """Return for each fine crest the nearest coarse one, whether they are the same, and the height in the limit."""
    partner, back = _nearest(coarse.keys, fine.keys), _nearest(fine.keys, coarse.keys)
    is_same = back[partner] == np.arange(len(partner))
    row = fine.keys.astype(np.int64) // 2
    rest = np.where(is_same, fall[row] * (fine.values - coarse.values[partner]), 0.0)
    return partner, is_same, fine.values + rest


def _lead(limit: Floats, row: Integers, is_highest: Flags, count: int) -> Floats:
    """Return how far each crest is above the highest one of its function."""
    of_highest = np.full(count, -np.inf)
    np.maximum.at(of_highest, row[is_highest], limit[is_highest])
    return np.asarray(limit - of_highest[row])


def crest_heights(series: Floats) -> Heights:
    """Return all crests of functions over the same interval from their samples, shape (m, t)."""
    crests = _crests(series, np.full(len(series), -np.inf))
    place, value, _ = _highest(crests.samples, crests.place)
    position = np.clip((crests.centre + place) / (series.shape[-1] - 1), 0.0, 1.0)
    return Heights(2.0 * crests.row + position, np.minimum(value, crests.limit))


def _nearest(ascending: Floats, targets: Floats) -> Integers:
    """Return the index of the nearest of some ascending numbers to each target."""
    above = np.clip(np.searchsorted(ascending, targets), 1, max(len(ascending) - 1, 1))
    above = np.minimum(above, len(ascending) - 1)
    below = np.maximum(above - 1, 0)
    return np.where(targets - ascending[below] <= ascending[above] - targets, below, above)


def _largest_difference(samples: Floats, order: int) -> Floats:
    """Return the largest absolute difference of this order in each row."""
    return np.asarray(np.max(np.abs(np.diff(samples, order, axis=-1)), axis=-1))


def _is_crest(series: Floats) -> Flags:
    """Mark samples that exceed the previous sample and are not below the next one."""
    rises = np.diff(series, axis=-1) > 0.0
    rises_before = np.pad(rises, ((0, 0), (1, 0)), constant_values=True)
    falls_after = np.pad(~rises, ((0, 0), (0, 1)), constant_values=True)
    return np.asarray(rises_before & falls_after)


def _highest(samples: Floats, crest: Integers) -> tuple[Floats, Floats, Floats]:
    """Return the position of the highest value within one unit of the crests, that value, and a bound of its error.

    The bound is the distance from the narrower polynomial if differences fall with their order; otherwise it is a third
    difference, the distance of a polynomial from a function with a corner. The samples, of shape (m, WIDTH), have the
    positions -3 to 3, and `crest` is one of these.
    """
    shift = np.clip(crest, -1, 1)
    low, high = np.maximum(crest - 1, -_SIDE), np.minimum(crest + 1, _SIDE)
    wide = _through(samples)
    first = shift + (WIDTH - NARROW) // 2
    narrow = _through(np.take_along_axis(samples, first[:, None] + np.arange(NARROW), axis=-1))
    slope, bend = polynomial.polyder(wide), polynomial.polyder(wide, 2)
    x = crest.astype(np.float64)
    for _ in range(_NEWTON_STEPS):
        s, b = (polynomial.polyval(x, of, tensor=False) for of in (slope, bend))
        x = np.clip(x - np.divide(s, b, out=np.zeros_like(s), where=b < 0.0), low, high)
    value, narrow_value = (
        np.asarray(polynomial.polyval(at, of, tensor=False), dtype=np.float64)
        for at, of in ((x, wide), (x - shift, narrow))
    )
    third, fifth = (_largest_difference(samples, order) for order in (3, 5))
    return x, value, np.where(fifth < SMOOTH * third, np.abs(value - narrow_value), third)


def _through(samples: Floats) -> Floats:
    """Return the coefficients, lowest power first, of the polynomials through samples at integers around 0."""
    terms = zip(_lagrange(samples.shape[-1]), samples.T, strict=True)
    # summed term by term: a linear solver has other bits on other machines
    return sum((basis[:, None] * row for basis, row in terms), np.zeros((1, 1)))


@cache
def _lagrange(count: int) -> list[Floats]:
    """Return the Lagrange polynomials of integers around 0; their coefficients before division are exact."""
    places = range(-(count // 2), count // 2 + 1)
    others = {i: [j for j in places if j != i] for i in places}
    return [
        polynomial.polyfromroots(others[i]) / math.prod(i - j for j in others[i]) for i in places
    ]
