"""The limit of one number over a ladder: its most accurate value, and a bound of the error of that.

The scheme and the error bar are those of `vibsim.convergence.extrapolation`. A single number has no curve whose shape
would tell an accident from an order, so that nothing is believed but what was seen:

- one more extrapolation is believed where the last changes of the column before it have the ratio of its power;
- its error is as much as it has changed from row to row, times a safety; a part of that only where the changes fall as
  the next power does;
- a change that is smaller than the one before it promises may be passing through zero, and does not count as smaller;
- an entry that a finer row contradicts is as wrong as the contradiction says, times the same safety;
- another power than the promised one is believed where the finest two triples of levels show it;
- where nothing is believed, the finest level stands as it is, with an error of `SPREAD` times what the last levels
  differ by (L. Eca and M. Hoekstra, 2014). It is unknown where they do not approach each other, if only raggedly.

Round-off is added with the weights of the combination. The entry with the least bound is taken. The factors are
calibrated: ``docs/method.md``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vibsim.convergence import thresholds as th
from vibsim.convergence.differences import order_of_ratio, safe_ratio, target_ratio
from vibsim.convergence.extrapolation import (
    Scheme,
    error_left,
    next_row,
    steps_of,
    triangular_scheme,
)
from vibsim.core.array_types import Flags, Floats, Integers


@dataclass(frozen=True)
class Limit:
    """The best values of some ladders; arrays of shape (...)."""

    value: Floats  # the finest level where no extrapolation is believed
    bound: Floats  # bound of the error; NaN where nothing is known of it
    first: Integers  # place of the coarsest level that was used
    last: Integers  # place of the finest one


def limit(
    values: Floats, levels: Sequence[int], order: Floats, even: Flags, floor: Floats
) -> Limit:
    """Find the limits of numbers.

    Levels up to the finest one that has no such number are left out: of a motion that is too coarse there is no period.

    Parameters
    ----------
    values, floor
        The numbers at n levels, NaN where they do not exist, and their predicted round-off, shape (..., n).
    order, even
        Promised order p, and whether the next power is p + 2 rather than p + 1, shape (...); where the levels show
        another order, that is taken.
    """
    n, unknown = len(levels), np.full(values.shape[:-1], np.nan)
    finest = np.full(values.shape[:-1], n - 1)
    found = Limit(values[..., -1].copy(), unknown, finest, finest.copy())
    start = np.max(np.where(np.isfinite(values), 0, np.arange(1, n + 1)), axis=-1)
    for k in np.unique(start[start < n]).tolist():
        own = start == k
        of = _limit(values[own][:, k:], levels[k:], order[own], even[own], floor[own][:, k:])
        found.value[own], found.bound[own] = of.value, of.bound
        found.first[own], found.last[own] = of.first + k, of.last + k
    return found


def _limit(
    values: Floats, levels: Sequence[int], order: Floats, even: Flags, floor: Floats
) -> Limit:
    """Find the limits of numbers that exist at every level."""
    n = len(levels)
    finest = np.full(values.shape[:-1], n - 1)
    with np.errstate(all="ignore"):
        bound = _bound_of_finest(values, levels, floor)
        unsure = np.where(np.isnan(bound), np.inf, bound)
        best = Limit(values[..., -1].copy(), unsure, finest, finest.copy())
        if n > 2:
            p = _leading(values, levels, order, floor)
            best = _extrapolated(values, levels, p, np.where(even, 2, 1), floor, best)
    known = np.isfinite(best.bound) & np.isfinite(best.value)
    return Limit(best.value, np.where(known, best.bound, np.nan), best.first, best.last)


def observed_order(values: Floats, levels: Sequence[int], floor: Floats) -> Floats:
    """Return the order of the finest triple whose differences are above round-off, shape (...); NaN without one."""
    found = np.full(values.shape[:-1], np.nan)
    for i in range(len(levels) - 2):
        triple, clean = triple_at(values, floor, i)
        found = np.where(clean, order_of_ratio(safe_ratio(*triple), levels[i : i + 3]), found)
    return found


def triple_at(values: Floats, floor: Floats, i: int) -> tuple[tuple[Floats, Floats], Flags]:
    """Return the two differences of the triple that begins at place i, and whether they are above round-off."""
    with np.errstate(invalid="ignore"):
        first, second = (values[..., k] - values[..., k + 1] for k in (i, i + 1))
        noise = th.ORDER_ABOVE_ROUND_OFF * (floor[..., i + 1] + floor[..., i + 2])
        return (first, second), (np.abs(second) > noise) & (np.abs(first) > noise)


def _leading(values: Floats, levels: Sequence[int], promised: Floats, floor: Floats) -> Floats:
    """Return the order to extrapolate with: the promised one, or another one that two successive triples show.

    One triple alone may show any order: where an error changes its sign, or on the way to the promised one.
    """
    p = np.where(np.isfinite(promised), promised, th.ORDINARY_ORDER)
    observed = observed_order(values, levels, floor)
    earlier = observed_order(values[..., :-1], levels[:-1], floor[..., :-1])
    likely = np.clip(np.round(2.0 * observed) / 2, 0.5, th.HIGHEST_ORDER)
    other = np.abs(observed - p) > th.OTHER_ORDER_DISTANCE
    for order in (earlier, observed):
        other &= np.abs(order - likely) <= th.HALF_ORDER_TOLERANCE
    return np.where(other, likely, p)


def _bound_of_finest(values: Floats, levels: Sequence[int], floor: Floats) -> Floats:
    """Return a bound of the error of the finest level without any order; NaN where the levels do not approach it."""
    n = values.shape[-1]
    if n == 1:
        return np.full(values.shape[:-1], np.nan)
    change = np.abs(np.diff(values, axis=-1))
    noise = th.ROUND_OFF_SAFETY * floor[..., -1]
    if n == 2:
        return np.asarray(th.SPREAD_OF_TWO * change[..., 0] + noise)
    recent = values[..., -3:]
    spread = th.SPREAD_OF_THREE if n == 3 else th.SPREAD
    bound = spread * (np.max(recent, axis=-1) - np.min(recent, axis=-1)) + noise
    falls = np.ones(values.shape[:-1], dtype=bool)
    for i in range(max(n - 4, 0), n - 2):
        least = target_ratio(th.SLOWEST_ORDER, levels[i : i + 3])
        falls &= change[..., i] >= least * change[..., i + 1]
    rounding = np.max(change[..., -2:], axis=-1) <= th.FALL_ABOVE_ROUND_OFF * floor[..., -1]
    found = np.where(falls | rounding, bound, np.nan)
    if n < th.RAGGED_LEVELS:
        return found
    # an extremum over grid points falls raggedly, as the grid happens to lie
    recent = values[..., -th.RAGGED_LEVELS :]
    wide = th.SPREAD * (np.max(recent, axis=-1) - np.min(recent, axis=-1)) + noise
    ragged = np.max(change[..., -2:], axis=-1) < th.RAGGED_DECLINE * np.max(
        change[..., :-2], axis=-1
    )
    return np.where(ragged, np.fmin(found, wide), found)


def _extrapolated(
    values: Floats, levels: Sequence[int], p: Floats, q: Integers, floor: Floats, best: Limit
) -> Limit:
    """Extrapolate the numbers of each expansion together."""
    expansions = np.stack([p, np.broadcast_to(q, p.shape)], axis=-1)
    for order, step in np.unique(expansions[p > 0], axis=0).tolist():
        own = np.all(expansions == (order, step), axis=-1)
        scheme = triangular_scheme(steps_of(levels), order, int(step), th.MOST_COLUMNS + 1)
        found = _Rows(values[own], scheme, floor[own])
        rows = found.least(Limit(*(of[own] for of in vars(best).values())))
        for of, new in zip(vars(best).values(), vars(rows).values(), strict=True):
            of[own] = new
    return best


class _Rows:
    """The triangular scheme of numbers of one expansion: rows over levels, lists over columns, arrays of shape (m,)."""

    def __init__(self, values: Floats, scheme: Scheme, floor: Floats) -> None:
        self.scheme, self.floor = scheme, floor
        self.entries: list[list[Floats]] = []
        self.changes: list[list[Floats]] = []
        for i, entries in enumerate(scheme):
            before = self.entries[-1] if i else []
            row, changes = next_row(entries[: th.MOST_COLUMNS], values[..., i], before)
            self.entries.append(row)
            self.changes.append(changes)
        few = len(scheme) == 3
        self.agrees_alone = th.RATIO_TOLERANCE_OF_THREE if few else th.SINGLE_RATIO_TOLERANCE
        self.safety_alone = th.SAFETY_OF_THREE if few else th.NUMBER_SAFETY_ALONE
        self.least_part = th.LEAST_SHARE_OF_THREE if few else th.LEAST_SHARE

    def _misfit_of_ratio(self, j: int, i: int) -> Floats:
        """Return how far the ratio of the changes of column j at rows i - 1 and i is from that of its power."""
        wanted = self.scheme[i][j].change_fall
        return np.abs(self.changes[i - 1][j] / (self.changes[i][j] * wanted) - 1.0)

    def _agrees(self, j: int, i: int) -> Flags:
        """Say where the changes of column j up to row i have the ratio of its power."""
        if i < j + 2:
            return np.zeros(self.floor.shape[:-1], dtype=bool)
        alone = i == j + 2
        agrees = self._misfit_of_ratio(j, i) <= (self.agrees_alone if alone else th.RATIO_TOLERANCE)
        if not alone:
            agrees &= self._misfit_of_ratio(j, i - 1) <= th.PREVIOUS_RATIO_TOLERANCE
        return np.asarray(agrees)

    def _error(self, j: int, i: int) -> Floats:
        """Return a bound of the error of the entry at row i and column j, j > 0, without round-off."""
        change, fall, alone = np.abs(self.changes[i][j]), self.scheme[i][j].fall, i == j + 1
        if alone:
            taken = np.abs(self.entries[i][j] - self.entries[i][j - 1])
            change = np.maximum(change, self.least_part * taken)
        else:
            change = np.maximum(change, np.abs(self.changes[i - 1][j]) / fall)
        error = (self.safety_alone if alone else th.NUMBER_SAFETY) * change
        error = np.where(self._agrees(j, i), error_left(error, fall), error)
        for finer in self.entries[i + 1 :]:
            error = np.fmax(error, th.NUMBER_SAFETY * np.abs(self.entries[i][j] - finer[j]))
        return error

    def least(self, best: Limit) -> Limit:
        """Return the entry with the least bound, or what there is already."""
        for i in range(2, len(self.entries)):
            believed = np.ones(self.floor.shape[:-1], dtype=bool)
            for j in range(1, min(i - 1, th.MOST_COLUMNS) + 1):
                believed = believed & self._agrees(j - 1, i)
                floors = [self.floor[..., k] for k in range(i - j, i + 1)]
                noise = self.scheme[i][j - 1].round_off(floors)
                bound = self._error(j, i) + th.ROUND_OFF_SAFETY * noise
                take = believed & (bound < best.bound)
                best = Limit(
                    np.where(take, self.entries[i][j], best.value),
                    np.where(take, bound, best.bound),
                    np.where(take, i - j, best.first),
                    np.where(take, i, best.last),
                )
        return best
