r"""The limit of one number over a ladder: its most accurate value, and a bound of the error of that.

A number at level l, with ``h = 2^-l``, is ``u_l = u + c_1 h^p + c_2 h^(p+q) + ...``. Column 0 of a tableau holds the
levels; each further one takes the next power away,

    T[i][j] = T[i][j-1] + (T[i][j-1] - T[i-1][j-1])/(K - 1),

with K the factor by which that power falls between the two levels. A single number has no curve whose shape would tell
an accident from an order, so that nothing is believed but what was seen:

- one more extrapolation is believed where the last changes of the column before it have the ratio of its power;
- its error is as much as it has changed from row to row, times a safety; a part of that only where the changes fall as
  the next power does;
- a change that is smaller than the one before it promises may be passing through zero, and does not count as smaller;
- an entry that a finer row contradicts is as wrong as the contradiction says;
- where nothing is believed, the finest level stands as it is, with an error of `SPREAD` times what the last levels
  differ by (L. Eca and M. Hoekstra, 2014). It is unknown where they do not approach each other, if only raggedly.

Round-off is added with the weights of the combination. The entry with the least bound is taken. The factors are
calibrated: ``docs/method.md``.

Source: L. F. Richardson (1911); W. Romberg (1955); E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary
Differential Equations I, section II.9.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibsim.convergence.differences import gap_ratio, order_of_ratio, safe_ratio, target_ratio

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]

COLUMNS = 5
"""So many powers are taken away at most."""
AGREES, AGREED, AGREES_ALONE = 0.3, 0.6, 0.2
"""Relative distance of a ratio of changes from that of the power: of the last, of the one before, of a single one."""
SAFETY, SAFETY_ALONE = 2.0, 4.0
"""Factor on the change of an entry: where two ratios agree, and where there is one only."""
LEAST_PART = 0.01
"""The least part of what was taken away that is left, where one change supports the extrapolation."""
SPREAD, SPREAD_OF_THREE, SPREAD_OF_TWO = 3.0, 3.5, 4.0
"""Factor on what the last three levels differ by, three levels that are all there are, and two."""
AGREES_OF_THREE, SAFETY_OF_THREE, LEAST_PART_OF_THREE = 0.05, 6.0, 0.03
"""The same as `AGREES_ALONE`, `SAFETY_ALONE` and `LEAST_PART` of three levels: their only ratio may be an accident."""
THREE = 3
RAGGED, DECLINE = 5, 0.5
"""Of so many levels and more, changes may fall raggedly, where the last two are at most this part of those before."""
ROUND_OFF_SAFETY = 10.0
"""Factor on the predicted round-off, which is an order of magnitude."""
LOUD = 30.0
"""A difference of less than so many times the round-off has no order."""
BLAME = 200.0
"""Differences of less than so many times the round-off need not fall."""
SAME_ORDER, NEAR = 0.3, 0.15
"""An order further than the first from the promised one is another one, where it is as near as the second to a multiple
of 1/2."""
HIGHEST_ORDER = 12.0
"""No higher order is looked for."""
ORDINARY = 2.0
"""Order that is tried where the scheme promises none."""


@dataclass(frozen=True)
class Limit:
    """The best values of some ladders; arrays of shape (...)."""

    value: Floats
    """The finest level where no extrapolation is believed."""
    bound: Floats
    """Bound of the error; NaN where nothing is known of it."""
    first: Integers
    """Place of the coarsest level that was used."""
    last: Integers
    """Place of the finest one."""


def limit(
    values: Floats, levels: Sequence[int], order: Floats, even: Flags, floor: Floats
) -> Limit:
    """Find the limits of numbers.

    Parameters
    ----------
    values
        The numbers at every level, shape (..., n); NaN where they do not exist.
    levels
        Their n levels, strictly increasing.
    order
        Promised order p, shape (...); where the levels show another one, that is taken.
    even
        Whether the next power is p + 2 rather than p + 1, shape (...).
    floor
        Predicted round-off at every level, in the unit of the numbers, shape (..., n).
    """
    n = len(levels)
    finest = np.full(values.shape[:-1], n - 1)
    with np.errstate(all="ignore"):
        bound = _bound_of_finest(values, floor)
        best = Limit(values[..., -1], np.where(np.isnan(bound), np.inf, bound), finest, finest)
        if n > 2:
            p = _leading(observed_order(values, levels, floor), order)
            best = _Tableau(values, levels, p, np.where(even, 2.0, 1.0), floor).least(best)
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
        noise = LOUD * (floor[..., i + 1] + floor[..., i + 2])
        return (first, second), (np.abs(second) > noise) & (np.abs(first) > noise)


def _leading(seen: Floats, promised: Floats) -> Floats:
    """Return the order to extrapolate with: the promised one, or another one that the levels show."""
    p = np.where(np.isfinite(promised), promised, ORDINARY)
    likely = np.clip(np.round(2.0 * seen) / 2, 0.5, HIGHEST_ORDER)
    other = (np.abs(seen - p) > SAME_ORDER) & (np.abs(seen - likely) <= NEAR)
    return np.where(other, likely, p)


def _bound_of_finest(values: Floats, floor: Floats) -> Floats:
    """Return a bound of the error of the finest level without any order; NaN where the levels do not approach it."""
    n = values.shape[-1]
    if n == 1:
        return np.full(values.shape[:-1], np.nan)
    change = np.abs(np.diff(values, axis=-1))
    noise = ROUND_OFF_SAFETY * floor[..., -1]
    if n == 2:
        return np.asarray(SPREAD_OF_TWO * change[..., 0] + noise)
    recent = values[..., -3:]
    spread = SPREAD_OF_THREE if n == THREE else SPREAD
    bound = spread * (np.max(recent, axis=-1) - np.min(recent, axis=-1)) + noise
    falls = np.all(np.diff(change[..., -3:], axis=-1) < 0, axis=-1)
    rounding = np.max(change[..., -2:], axis=-1) <= BLAME * floor[..., -1]
    found = np.where(falls | rounding, bound, np.nan)
    if n < RAGGED:
        return found
    # an extremum over grid points falls raggedly, as the grid happens to lie
    recent = values[..., -RAGGED:]
    wide = SPREAD * (np.max(recent, axis=-1) - np.min(recent, axis=-1)) + noise
    ragged = np.max(change[..., -2:], axis=-1) < DECLINE * np.max(change[..., :-2], axis=-1)
    return np.where(ragged, np.fmin(found, wide), found)


class _Tableau:
    """The tableau of some ladders: lists over columns j of arrays of shape (..., n)."""

    def __init__(
        self, values: Floats, levels: Sequence[int], p: Floats, q: Floats, floor: Floats
    ) -> None:
        self.levels, self.p, self.q = levels, p, q
        self.entries, self.noise = [values], [floor]
        self.changes = [_changes(values)]
        few = len(levels) == THREE
        self.agrees_alone = AGREES_OF_THREE if few else AGREES_ALONE
        self.safety_alone = SAFETY_OF_THREE if few else SAFETY_ALONE
        self.least_part = LEAST_PART_OF_THREE if few else LEAST_PART
        for j in range(1, min(len(levels) - 1, COLUMNS) + 1):
            self._extrapolate(j)

    def _extrapolate(self, j: int) -> None:
        """Add column j."""
        before, noise = self.entries[-1], self.noise[-1]
        entries, carried = np.full_like(before, np.nan), np.full_like(before, np.nan)
        for i in range(j, len(self.levels)):
            part = 1.0 / (self.fall(j - 1, i) - 1.0)
            entries[..., i] = before[..., i] + part * self.changes[-1][..., i]
            carried[..., i] = noise[..., i] + part * (noise[..., i] + noise[..., i - 1])
        self.entries.append(entries)
        self.noise.append(carried)
        self.changes.append(_changes(entries))

    def fall(self, j: int, i: int) -> Floats:
        """Return the factor by which the error of column j falls from row i - 1 to row i."""
        return gap_ratio(self.p + j * self.q, self.levels[i] - self.levels[i - 1])

    def _apart(self, j: int, i: int) -> Floats:
        """Return how far the ratio of the changes of column j at rows i - 1 and i is from that of its power."""
        wanted = target_ratio(self.p + j * self.q, self.levels[i - 2 : i + 1])
        return np.abs(self.changes[j][..., i - 1] / (self.changes[j][..., i] * wanted) - 1.0)

    def _agrees(self, j: int, i: int) -> Flags:
        """Say where the changes of column j up to row i have the ratio of its power."""
        if i < j + 2:
            return np.zeros(self.p.shape, dtype=bool)
        alone = i == j + 2
        agrees = self._apart(j, i) <= (self.agrees_alone if alone else AGREES)
        if not alone:
            agrees &= self._apart(j, i - 1) <= AGREED
        return np.asarray(agrees)

    def _error(self, j: int, i: int) -> Floats:
        """Return a bound of the error of the entry at row i and column j, j > 0, without round-off."""
        change, alone = np.abs(self.changes[j][..., i]), i == j + 1
        if alone:
            taken = np.abs(self.entries[j][..., i] - self.entries[j - 1][..., i])
            change = np.maximum(change, self.least_part * taken)
        else:
            change = np.maximum(change, np.abs(self.changes[j][..., i - 1]) / self.fall(j, i))
        error = (self.safety_alone if alone else SAFETY) * change
        error = np.where(self._agrees(j, i), error / (self.fall(j, i) - 1.0), error)
        for finer in range(i + 1, len(self.levels)):
            contradiction = np.abs(self.entries[j][..., i] - self.entries[j][..., finer])
            error = np.fmax(error, contradiction)
        return error

    def least(self, best: Limit) -> Limit:
        """Return the entry with the least bound, or what there is already."""
        for i in range(2, len(self.levels)):
            believed = np.ones(self.p.shape, dtype=bool)
            for j in range(1, min(i - 1, len(self.entries) - 1) + 1):
                believed = believed & self._agrees(j - 1, i)
                bound = self._error(j, i) + ROUND_OFF_SAFETY * self.noise[j][..., i]
                take = believed & (bound < best.bound)
                best = Limit(
                    np.where(take, self.entries[j][..., i], best.value),
                    np.where(take, bound, best.bound),
                    np.where(take, i - j, best.first),
                    np.where(take, i, best.last),
                )
        return best


def _changes(entries: Floats) -> Floats:
    """Return what every entry of a column differs by from the row before; NaN in the first row."""
    found = np.full_like(entries, np.nan)
    found[..., 1:] = np.diff(entries, axis=-1)
    return found
