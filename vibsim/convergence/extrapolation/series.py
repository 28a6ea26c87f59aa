"""Extrapolation of a solution over time or space, with a bound that never decreases with time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from vibsim.convergence.differences import largest as absolute
from vibsim.convergence.differences import norm, safe_ratio
from vibsim.convergence.extrapolation.thresholds import SERIES_SAFETY
from vibsim.convergence.extrapolation.triangular_scheme import (
    Scheme,
    error_left,
    steps_of,
    triangular_scheme,
)
from vibsim.core.array_types import Flags, Floats


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
