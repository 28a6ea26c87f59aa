"""The largest value of a smooth function between its samples, by the polynomials through those around a crest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial

from vibsim.core.array_types import Flags, Floats, Integers

WIDTH, NARROW = 7, 5
"""Samples that the polynomial goes through, and those of a narrower one, whose distance from it is the error bound."""
ALIKE = 0.1
"""Crests whose extrapolations differ by a smaller part of what these add are taken to be equal. [chosen]"""
SMOOTH = 0.25
"""Fifth differences over third ones, below which a function has no corner: that of w dt = 1/2. [derived]"""
_SIDE = WIDTH // 2
_NEWTON_STEPS = 4


def largest_between_samples(grids: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Return the largest value of functions, and a bound of its error, shape (m, grid).

    Parameters
    ----------
    grids
        At least `WIDTH` samples at equal distances, shape (m, t), on every grid. NaN where one is not finite.
    """
    known = np.stack([np.isfinite(series).all(axis=-1) for series in grids])
    finite = [np.where(k[:, None], x, 0.0) for k, x in zip(known, grids, strict=True)]
    largest = np.stack([np.max(series, axis=-1) for series in finite])
    bound = np.zeros(largest.shape)
    crests = [_crests(series, top) for series, top in zip(finite, largest, strict=True)]
    grid = np.repeat(np.arange(len(grids)), [len(crest.row) for crest in crests])
    row, _, place, limit, around = (np.concatenate(x) for x in zip(*crests, strict=True))
    _, value, error = _highest(around, place)
    np.maximum.at(largest, (grid, row), np.minimum(value, limit))
    np.maximum.at(bound, (grid, row), error)
    return np.where(known, largest, np.nan).T, np.where(known, bound, np.nan).T


class _Crests(NamedTuple):
    """Samples that no neighbour exceeds, near which a function may be larger than all samples; shape (crest,)."""

    row: Integers
    centre: Integers  # index of the middle one of the samples around it
    place: Integers  # among the samples around it, of which the middle one is 0
    limit: Floats  # a smooth function stays below it
    around: Floats  # shape (crest, WIDTH)


def _crests(series: Floats, top: Floats) -> _Crests:
    """Return the crests of functions with these largest samples."""
    row, index = np.nonzero(_is_crest(series))
    centre = np.clip(index, _SIDE, series.shape[-1] - 1 - _SIDE)
    around = series[row[:, None], centre[:, None] + np.arange(-_SIDE, _SIDE + 1)]
    # at a corner a function is half of a second difference above the straight line
    limit = series[row, index] + 0.5 * _largest_difference(around, 2)
    may = limit >= top[row]
    return _Crests(row[may], centre[may], (index - centre)[may], limit[may], around[may])


def rise_of_other_crests(coarse: Floats, fine: Floats, fall: Floats) -> Floats:
    """Return how much larger than the crest that is the largest on a fine grid another one may be in the limit.

    Each crest moves on from a coarse to a fine grid and beyond it; those that do so alike are no danger.

    Parameters
    ----------
    coarse, fine
        Samples of functions over the same interval, shape (m, t).
    fall
        What is left to the limit, over the change from the coarse to the fine grid, shape (m,).

    Returns
    -------
    array
        Shape (m,); 0 where no other crest may be the largest.
    """
    (of_coarse, was), (row_and_place, now) = (_crest_values(series) for series in (coarse, fine))
    other, back = _nearest(of_coarse, row_and_place), _nearest(row_and_place, of_coarse)
    is_pair = back[other] == np.arange(len(other))
    row = row_and_place.astype(np.int64) // 2
    left = np.where(is_pair, fall[row] * (now - was[other]), 0.0)
    top = np.full(len(fine), -np.inf)
    np.maximum.at(top, row, now)
    limit_of_top = np.full(len(fine), -np.inf)
    is_top = now == top[row]
    np.maximum.at(limit_of_top, row[is_top], (now + left)[is_top])
    above = now + left - limit_of_top[row]
    found = np.zeros(len(fine))
    np.maximum.at(found, row, np.where(above > ALIKE * np.abs(left), above + np.abs(left), 0.0))
    return found


def _crest_values(series: Floats) -> tuple[Floats, Floats]:
    """Return row and place of all crests as one number, twice the row and a part of the interval, and their values."""
    found = _crests(series, np.full(len(series), -np.inf))
    place, value, _ = _highest(found.around, found.place)
    part = np.clip((found.centre + place) / (series.shape[-1] - 1), 0.0, 1.0)
    return 2.0 * found.row + part, np.minimum(value, found.limit)


def _nearest(rising: Floats, to: Floats) -> Integers:
    """Return the position of the nearest of some rising numbers to each of others."""
    above = np.clip(np.searchsorted(rising, to), 1, max(len(rising) - 1, 1))
    above = np.minimum(above, len(rising) - 1)
    below = np.maximum(above - 1, 0)
    return np.where(to - rising[below] <= rising[above] - to, below, above)


def _largest_difference(samples: Floats, order: int) -> Floats:
    """Return the largest difference of an order, in size, of every row."""
    return np.asarray(np.max(np.abs(np.diff(samples, order, axis=-1)), axis=-1))


def _is_crest(series: Floats) -> Flags:
    """Mark samples that are above the one before, and not below the one behind."""
    rises = np.diff(series, axis=-1) > 0.0
    before = np.pad(rises, ((0, 0), (1, 0)), constant_values=True)
    behind = np.pad(~rises, ((0, 0), (0, 1)), constant_values=True)
    return np.asarray(before & behind)


def _highest(samples: Floats, crest: Integers) -> tuple[Floats, Floats, Floats]:
    """Return the place of the highest value within one unit of the crests, that value, and how far it may be off.

    That is the distance from the narrower polynomial, where differences fall with their order; else a third difference,
    as far as a polynomial is from a function with a corner. The samples, of shape (m, WIDTH), have the places -3 to 3,
    of which `crest` is one.
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
    value, other = (
        np.asarray(polynomial.polyval(at, of, tensor=False), dtype=np.float64)
        for at, of in ((x, wide), (x - shift, narrow))
    )
    third, fifth = (_largest_difference(samples, order) for order in (3, 5))
    return x, value, np.where(fifth < SMOOTH * third, np.abs(value - other), third)


def _through(samples: Floats) -> Floats:
    """Return the coefficients of the polynomials through samples at whole places about 0, lowest power first."""
    terms = zip(_lagrange(samples.shape[-1]), samples.T, strict=True)
    # added up one by one: a solver of linear equations has other bits on other machines
    return sum((basis[:, None] * row for basis, row in terms), np.zeros((1, 1)))


@cache
def _lagrange(count: int) -> list[Floats]:
    """Return Lagrange's polynomials of whole places about 0; those of their integer roots are exact."""
    places = range(-(count // 2), count // 2 + 1)
    others = {i: [j for j in places if j != i] for i in places}
    return [
        polynomial.polyfromroots(others[i]) / math.prod(i - j for j in others[i]) for i in places
    ]
