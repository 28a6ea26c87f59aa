"""The limit of a single number over a ladder: its most accurate value, and a bound of the error of that value.

The triangular scheme and the error bar are those of `vibsim.convergence.extrapolation`. A number has no curve whose
shape would distinguish an order from an accident, so only what the levels show is accepted:

- one more extrapolation is accepted if the last changes of the previous column have the ratio of its power;
- the error of an entry is its change from the previous row times a safety factor; it is less only if the changes fall
  like the next power;
- a change that is smaller than the previous one predicts may be crossing zero, and counts as large as predicted;
- if a finer row contradicts an entry, the error is the contradiction times the same safety factor;
- another order than the promised one is accepted if the finest two triples of levels show it;
- if no extrapolation is accepted, the finest level is the result, and its error is `SPREAD` times the range of the last
  levels (L. Eca and M. Hoekstra, 2014). It is unknown if the levels do not approach each other, not even raggedly.

Round-off is added with the weights of the combination. The entry with the least bound is the result. The factors are
calibrated: ``docs/method.md``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vibsim.convergence.differences import order_of_ratio, safe_ratio, target_ratio
from vibsim.convergence.extrapolation import thresholds as th
from vibsim.convergence.extrapolation.triangular_scheme import (
    Scheme,
    error_left,
    next_row,
    steps_of,
    triangular_scheme,
)
from vibsim.convergence.thresholds import ORDINARY_ORDER, ROUND_OFF_SAFETY
from vibsim.core.array_types import Flags, Floats, Integers


@dataclass(frozen=True)
class Limit:
    """The best values of ladders; arrays of shape (...)."""

    value: Floats  # the finest level if no extrapolation is accepted
    bound: Floats  # bound of the error; NaN if it is unknown
    first: Integers  # index of the coarsest level that was used
    last: Integers  # index of the finest one


def limit(
    values: Floats, levels: Sequence[int], order: Floats, even: Flags, floor: Floats
) -> Limit:
    """Return the limits of numbers.

    Only levels finer than the last one without a number are used: a motion that is too coarse has no period.

    Parameters
    ----------
    values, floor
        The numbers at n levels, NaN where they do not exist, and their predicted round-off, shape (..., n).
    order, even
        Promised order p, and whether the next power is p + 2 rather than p + 1, shape (...). If the levels show
        another order, that one is used.
    """
    n, unknown = len(levels), np.full(values.shape[:-1], np.nan)
    finest = np.full(values.shape[:-1], n - 1)
    result = Limit(values[..., -1].copy(), unknown, finest, finest.copy())
    start = np.max(np.where(np.isfinite(values), 0, np.arange(1, n + 1)), axis=-1)
    for k in np.unique(start[start < n]).tolist():
        own = start == k
        limits = _limit(values[own][:, k:], levels[k:], order[own], even[own], floor[own][:, k:])
        result.value[own], result.bound[own] = limits.value, limits.bound
        result.first[own], result.last[own] = limits.first + k, limits.last + k
    return result


def _limit(
    values: Floats, levels: Sequence[int], order: Floats, even: Flags, floor: Floats
) -> Limit:
    """Return the limits of numbers that exist at every level."""
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
    """Return the order of the finest triple of levels whose differences exceed round-off, shape (...), or NaN."""
    order = np.full(values.shape[:-1], np.nan)
    for i in range(len(levels) - 2):
        triple, clean = triple_at(values, floor, i)
        order = np.where(clean, order_of_ratio(safe_ratio(*triple), levels[i : i + 3]), order)
    return order


def triple_at(values: Floats, floor: Floats, i: int) -> tuple[tuple[Floats, Floats], Flags]:
    """Return the two differences of the levels i to i + 2, and whether both exceed round-off."""
    with np.errstate(invalid="ignore"):
        first, second = (values[..., k] - values[..., k + 1] for k in (i, i + 1))
        noise = th.ORDER_ABOVE_ROUND_OFF * (floor[..., i + 1] + floor[..., i + 2])
        return (first, second), (np.abs(second) > noise) & (np.abs(first) > noise)


def _leading(values: Floats, levels: Sequence[int], promised: Floats, floor: Floats) -> Floats:
    """Return the order to extrapolate with: the promised one, or another one that two successive triples show.

    One triple may show any order, where an error changes its sign or the levels are not yet asymptotic.
    """
    p = np.where(np.isfinite(promised), promised, ORDINARY_ORDER)
    measured = observed_order(values, levels, floor)
    earlier = observed_order(values[..., :-1], levels[:-1], floor[..., :-1])
    rounded = np.clip(np.round(2.0 * measured) / 2, 0.5, th.HIGHEST_ORDER)
    is_other = np.abs(measured - p) > th.OTHER_ORDER_DISTANCE
    for order in (earlier, measured):
        is_other &= np.abs(order - rounded) <= th.HALF_ORDER_TOLERANCE
    return np.where(is_other, rounded, p)


def _bound_of_finest(values: Floats, levels: Sequence[int], floor: Floats) -> Floats:
    """Return a bound of the error of the finest level that uses no order; NaN if the differences do not fall."""
    n = values.shape[-1]
    if n == 1:
        return np.full(values.shape[:-1], np.nan)
    change = np.abs(np.diff(values, axis=-1))
    noise = ROUND_OFF_SAFETY * floor[..., -1]
    if n == 2:
        return np.asarray(th.SPREAD_OF_TWO * change[..., 0] + noise)
    recent = values[..., -3:]
    spread = th.SPREAD_OF_THREE if n == 3 else th.SPREAD
    bound = spread * (np.max(recent, axis=-1) - np.min(recent, axis=-1)) + noise
    falls = np.ones(values.shape[:-1], dtype=bool)
    for i in range(max(n - 4, 0), n - 2):
        least = target_ratio(th.SLOWEST_ORDER, levels[i : i + 3])
        falls &= change[..., i] >= least * change[..., i + 1]
    is_round_off = np.max(change[..., -2:], axis=-1) <= th.FALL_ABOVE_ROUND_OFF * floor[..., -1]
    narrow = np.where(falls | is_round_off, bound, np.nan)
    if n < th.RAGGED_LEVELS:
        return narrow
    # an extremum over grid points converges raggedly, depending on where the points lie
    recent = values[..., -th.RAGGED_LEVELS :]
    wide = th.SPREAD * (np.max(recent, axis=-1) - np.min(recent, axis=-1)) + noise
    last, earlier = (np.max(x, axis=-1) for x in (change[..., -2:], change[..., :-2]))
    ragged = last < th.RAGGED_DECLINE * earlier
    return np.where(ragged, np.fmin(narrow, wide), narrow)


def _extrapolated(
    values: Floats, levels: Sequence[int], p: Floats, q: Integers, floor: Floats, best: Limit
) -> Limit:
    """Extrapolate the numbers, all with the same expansion at once."""
    expansions = np.stack([p, np.broadcast_to(q, p.shape)], axis=-1)
    for order, step in np.unique(expansions[p > 0], axis=0).tolist():
        rows = np.all(expansions == (order, step), axis=-1)
        scheme = triangular_scheme(steps_of(levels), order, int(step), th.MOST_COLUMNS + 1)
        tableau = _Rows(values[rows], scheme, floor[rows])
        improved = tableau.best_entry(Limit(*(old[rows] for old in vars(best).values())))
        for old, new in zip(vars(best).values(), vars(improved).values(), strict=True):
            old[rows] = new
    return best


class _Rows:
    """The triangular scheme of m numbers with one expansion: a list over rows of lists over columns of arrays (m,)."""

    def __init__(self, values: Floats, scheme: Scheme, floor: Floats) -> None:
        self.scheme, self.floor = scheme, floor
        self.entries: list[list[Floats]] = []
        self.changes: list[list[Floats]] = []
        for i, entries in enumerate(scheme):
            previous = self.entries[-1] if i else []
            row, changes = next_row(entries[: th.MOST_COLUMNS], values[..., i], previous)
            self.entries.append(row)
            self.changes.append(changes)
        of_three = len(scheme) == 3
        self.ratio_tolerance = (
            th.RATIO_TOLERANCE_OF_THREE if of_three else th.SINGLE_RATIO_TOLERANCE
        )
        self.single_safety = th.SAFETY_OF_THREE if of_three else th.NUMBER_SAFETY_ALONE
        self.least_share = th.LEAST_SHARE_OF_THREE if of_three else th.LEAST_SHARE

    def _ratio_error(self, j: int, i: int) -> Floats:
        """Return the relative error of the ratio of the changes of column j at rows i - 1 and i, against its power."""
        wanted = self.scheme[i][j].change_fall
        return np.abs(self.changes[i - 1][j] / (self.changes[i][j] * wanted) - 1.0)

    def _has_ratio(self, j: int, i: int) -> Flags:
        """Say where the changes of column j up to row i have the ratio of its power."""
        if i < j + 2:
            return np.zeros(self.floor.shape[:-1], dtype=bool)
        single = i == j + 2
        agrees = self._ratio_error(j, i) <= (self.ratio_tolerance if single else th.RATIO_TOLERANCE)
        if not single:
            agrees &= self._ratio_error(j, i - 1) <= th.PREVIOUS_RATIO_TOLERANCE
        return np.asarray(agrees)

    def _error(self, j: int, i: int) -> Floats:
        """Return a bound of the error of the entry at row i and column j > 0, without round-off."""
        change, fall, single = np.abs(self.changes[i][j]), self.scheme[i][j].fall, i == j + 1
        if single:
            taken = np.abs(self.entries[i][j] - self.entries[i][j - 1])
            change = np.maximum(change, self.least_share * taken)
        else:
            change = np.maximum(change, np.abs(self.changes[i - 1][j]) / fall)
        error = (self.single_safety if single else th.NUMBER_SAFETY) * change
        error = np.where(self._has_ratio(j, i), error_left(error, fall), error)
        for finer in self.entries[i + 1 :]:
            error = np.fmax(error, th.NUMBER_SAFETY * np.abs(self.entries[i][j] - finer[j]))
        return error

    def best_entry(self, best: Limit) -> Limit:
        """Return the accepted entry with the least bound, or `best` if that is better."""
        for i in range(2, len(self.entries)):
            believed = np.ones(self.floor.shape[:-1], dtype=bool)
            for j in range(1, min(i - 1, th.MOST_COLUMNS) + 1):
                believed = believed & self._has_ratio(j - 1, i)
                floors = [self.floor[..., k] for k in range(i - j, i + 1)]
                noise = self.scheme[i][j - 1].round_off(floors)
                bound = self._error(j, i) + ROUND_OFF_SAFETY * noise
                take = believed & (bound < best.bound)
                best = Limit(
                    np.where(take, self.entries[i][j], best.value),
                    np.where(take, bound, best.bound),
                    np.where(take, i - j, best.first),
                    np.where(take, i, best.last),
                )
        return best
