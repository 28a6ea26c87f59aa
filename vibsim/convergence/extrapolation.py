r"""Extrapolation over the levels of a ladder: one triangular scheme and one rule for error bars.

A level with step h has ``u_h = u + c_1 h^p + c_2 h^(p+q) + c_3 h^(p+2q) + ...``. Column 0 of the scheme holds the
levels. An entry of column j combines j + 1 successive levels so that the first j powers cancel,

    T[i][j] = T[i][j-1] + f (T[i][j-1] - T[i-1][j-1]),         f = 1/(K - 1),

where K is the factor by which the error of column j - 1 falls from row i - 1 to row i. Richardson extrapolation is
column 1, Romberg's method all columns. Levels may be skipped: f is computed in exact fractions.

If the entries of a column change by c from one row to the next, and these changes fall by the factor K per row, the
remaining error of the finer entry is

    c/(K - 1),         times a safety factor.

All error bars have this form (`error_left`). They differ in how well K is known, and so in the safety factor:

- *grid convergence index* (`vibsim.convergence.gci`): column 0, and the observed order if it is the promised one;
- *series* (`extrapolate_series`): columns 1 and 2. A curve over time has a shape, and K is measured in norms;
- *numbers* (`vibsim.convergence.number_extrapolation`): all columns. A number has no shape, so the levels must show
  each power;
- *states* (`vibsim.convergence.state_extrapolation`): all columns, at each time independently. The powers are those of
  the scheme and round-off is measured; entries that fall differently are trusted less.

Source: L. F. Richardson (1911); W. Romberg (1955); C. Brezinski's E-algorithm for unequal gaps; E. Hairer,
S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, section II.9; pendulum lecture, section 2.5.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from vibsim.convergence.differences import largest as absolute
from vibsim.convergence.differences import norm, safe_ratio
from vibsim.convergence.thresholds import SERIES_SAFETY
from vibsim.core.array_types import Flags, Floats
from vibsim.elementary.exponential import power


@dataclass(frozen=True)
class Entry:
    """The coefficients of one entry ``T[i][j]``, j > 0, which depend only on the steps of the levels."""

    factor: float  # f of the recursion
    fall: float  # factor K by which the error of column j - 1 falls from row i - 1 to row i
    # factor by which the changes of column j - 1 fall from row i - 1 to row i; 0 if row i - 1 has no change
    change_fall: float
    coarser: float  # step ratio of the two coarsest levels to the power q: the cost of including the coarsest one
    weights: tuple[float, ...]  # absolute weights of the levels i - j to i in the combination

    def round_off(self, floors: Sequence[Any]) -> Any:
        """Return an upper bound of the round-off of the entry, from that of the levels i - j to i."""
        return sum(w * r for w, r in zip(self.weights, floors, strict=True))


Scheme = tuple[tuple[Entry, ...], ...]
"""Row i holds the entries j = 1, ..., i, up to the largest column."""


@lru_cache(maxsize=1024)
def triangular_scheme(
    steps: tuple[int, ...], p: float, q: int, columns: int | None = None
) -> Scheme:
    """Return the scheme of a ladder whose error expands in the powers p, p + q, p + 2 q, ... of the time step, p > 0.

    The numbers of steps increase; only their ratios matter. At most `columns` powers are eliminated.
    """
    n = len(steps)
    depth = n - 1 if columns is None else min(columns, n - 1)
    h = [Fraction(steps[0], count) for count in steps]
    left = [[_power(x, p + k * q) for k in range(depth)] for x in h]
    weights = [[Fraction(int(k == i)) for k in range(n)] for i in range(n)]
    rows: list[tuple[Entry, ...]] = [() for _ in steps]
    for j in range(1, depth + 1):
        size = [row[j - 1] for row in left]
        factors = {i: size[i] / (size[i - 1] - size[i]) for i in range(j, n)}
        combined = {i: _combined(weights, i, f) for i, f in factors.items()}
        for i, f in factors.items():
            changes = [size[k - 1] - size[k] for k in (i - 1, i) if k >= j]
            rows[i] += (
                Entry(
                    factor=float(f),
                    fall=float(1 + 1 / f),
                    change_fall=float(changes[0] / changes[1]) if len(changes) == 2 else 0.0,
                    coarser=float(Fraction(steps[i - j + 1], steps[i - j]) ** q),
                    weights=tuple(abs(float(w)) for w in combined[i][i - j : i + 1]),
                ),
            )
        left = [_combined(left, i, factors[i]) if i >= j else left[i] for i in range(n)]
        weights = [combined.get(i, weights[i]) for i in range(n)]
    return tuple(rows)


def _power(h: Fraction, p: float) -> Fraction:
    """Return h^p: exact for an integer p, correctly rounded for a half-integer."""
    if float(p).is_integer():
        return Fraction(h ** int(p))
    if float(2 * p).is_integer():
        return Fraction(math.sqrt(h ** int(2 * p)))
    return Fraction(power(float(h), p))


def _combined(rows: Sequence[Sequence[Fraction]], i: int, f: Fraction) -> list[Fraction]:
    return [x + f * (x - y) for x, y in zip(rows[i], rows[i - 1], strict=True)]


def next_row(
    entries: Sequence[Entry], level: Any, previous: Sequence[Any]
) -> tuple[list[Any], list[Any]]:
    """Return the row of a level, and its differences from the previous row.

    `level` is the value of the level, a float or an array; `entries` is the row of the `Scheme`.
    """
    row, changes = [level], []
    for j, coarse in enumerate(previous):
        change = row[j] - coarse
        changes.append(change)
        if j < len(entries):
            row.append(row[j] + entries[j].factor * change)
    return row, changes


def error_left(change: Any, fall: Any) -> Any:
    """Return the error of the finer of two entries that differ by `change`, if errors fall by `fall` per row."""
    return change / (fall - 1.0)


def steps_of(levels: Sequence[int]) -> tuple[int, ...]:
    """Return the numbers of steps of levels relative to the coarsest one; each level halves the step."""
    return tuple(1 << (level - levels[0]) for level in levels)


def of_orders(
    levels: Sequence[int], order: Floats, q: int, number: Callable[[Scheme], float]
) -> Floats:
    """Return a number of the scheme of each order, in the shape of `order`; NaN for an unknown order."""
    result = np.full(order.shape, np.nan)
    for p in np.unique(order[np.isfinite(order) & (order > 0)]).tolist():
        result[order == p] = number(triangular_scheme(steps_of(levels), p, q))
    return result


def extrapolate_series(
    series: Sequence[Floats],
    levels: Sequence[int],
    order: Floats,
    even: Flags,
    largest: bool = False,
) -> tuple[Floats, Floats]:
    """Extrapolate a ladder of solutions.

    Parameters
    ----------
    series
        The solution at each level, each of shape (scheme, case, t).
    order, even
        Formal order p, and whether the next power is p + 2 rather than p + 1, shape (scheme, case or 1); with four or
        more levels the data decide between the two.
    largest
        Whether to return only the largest bound.

    Returns
    -------
    value
        Solution extrapolated from the finest three levels, or from all if there are fewer, shape (scheme, case, t).
    bound
        Bound of its error without round-off, which never decreases with time; of shape (scheme, case, 1) if `largest`.
        With three levels it is the largest change so far between the last two entries of column 1. Four levels show how
        fast this change falls: the bound is then its `error_left` times `SERIES_SAFETY`, with a fall no faster than the
        next power gives. It also holds for a solution of a lower order than p. With two levels it is the estimated
        error of the finer one; with one level it is NaN.
    """

    def so_far(change: Floats) -> Floats:
        if largest:
            return absolute(change)[..., None]
        # an estimate that crosses zero does not mean a small error
        return np.asarray(np.maximum.accumulate(np.abs(change), axis=-1))

    if len(series) == 1:
        return series[0], so_far(np.full_like(series[0], np.nan))
    series, levels = series[-4:], levels[-4:]
    n = len(series)

    def column(j: int, i: int, q: int) -> Floats:
        return of_orders(levels, order, q, lambda scheme: scheme[i][j - 1].factor)

    with np.errstate(over="ignore", invalid="ignore"):
        first = [
            fine + column(1, i, 1)[..., None] * (fine - coarse)
            for i, (coarse, fine) in enumerate(pairwise(series), start=1)
        ]
        if n == 2:
            return first[-1], so_far(first[-1] - series[-1])
        change = first[-1] - first[-2]
        odd, even_factor = column(2, n - 1, 1), column(2, n - 1, 2)
        if n == 3:
            return first[-1] + np.where(even, even_factor, odd)[..., None] * change, so_far(change)
        previous = first[-2] - first[-3]
        observed_fall = _observed_fall(previous, change)
        slow, fast = (of_orders(levels, order, q, lambda s: s[3][1].change_fall) for q in (1, 2))
        is_even = np.nan_to_num(observed_fall, nan=2.0) > np.sqrt(fast * slow)
        value = first[-1] + np.where(is_even, even_factor, odd)[..., None] * change
        most = np.where(even, fast, slow)
        fall = np.clip(np.nan_to_num(observed_fall, nan=2.0), 2.0, np.maximum(most, 2.0))
        # a change that fell faster than any power happens to vanish here: predict it from the previous one
        expected = so_far(previous) / np.maximum(slow, 2.0)[..., None]
        vanishing = observed_fall > most * SERIES_SAFETY
        size = np.maximum(so_far(change), np.where(vanishing[..., None], expected, 0.0))
        fall = np.where(vanishing, np.minimum(fall, np.maximum(slow, 2.0)), fall)
        return value, np.asarray(error_left(SERIES_SAFETY * size, fall[..., None]))


def _observed_fall(previous: Floats, change: Floats) -> Floats:
    """Return the factor by which the change fell, shape (scheme, case): the least of two norms.

    A single bad point, such as that of an end formula, falls more slowly and has another weight in each norm.
    """
    one = np.ones(1)
    falls = [
        safe_ratio(norm(previous, kind, one), norm(change, kind, one)) for kind in ("l2", "linf")
    ]
    return np.asarray(np.minimum(*falls))
