"""Extrapolation to a vanishing step, with a bound for its own error.

With ``u_l = u + a h_l^p + b h_l^q``, one extrapolation of two levels removes the power p, a second one of three levels
the next power q. Source: L. F. Richardson (1911); pendulum lecture, section 2.5; E. Hairer, S. P. Norsett and
G. Wanner, Solving Ordinary Differential Equations I, section II.9.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vibsim.convergence.differences import gap_ratio, norm, safe_ratio
from vibsim.convergence.differences import largest as absolute

Floats = NDArray[np.float64]

SAFETY = 1.25
"""Factor on a bound that rests on a fall seen once; the usual one of grid convergence indices (P. J. Roache, 1994)."""


def extrapolate(
    series: Sequence[Floats],
    levels: Sequence[int],
    order: Floats,
    even: NDArray[np.bool_],
    largest: bool = False,
) -> tuple[Floats, Floats]:
    """Extrapolate a ladder of solutions.

    Parameters
    ----------
    series
        The solution at every level, each of shape (scheme, case, t).
    levels
        Their levels, strictly increasing.
    order
        Formal order p, shape (scheme, case or 1).
    even
        Whether the next power is p + 2 rather than p + 1, shape (scheme, case or 1); from four levels on the data
        decide.
    largest
        Whether the largest bound is enough.

    Returns
    -------
    value
        Extrapolated solution, shape (scheme, case, t): of the finest three levels, or of as many as there are.
    bound
        Bound of its error without round-off, which never falls with time; of shape (scheme, case, 1) where the largest
        is enough. With three levels and more it is the change between the last two first
        extrapolations, as large as it has been so far; `SAFETY` times that over K - 1 where four levels show that the
        change falls by the factor K, taken for no more than the next power gives. It is honest for a solution of a
        lower order than p, too. With two levels it is the estimated error of the finer one; with one level NaN.
    """
    p, so_far = order[..., None], _at_most if largest else _so_far
    if len(series) == 1:
        return series[0], so_far(np.full_like(series[0], np.nan))
    with np.errstate(over="ignore", invalid="ignore"):
        first = [
            fine + (fine - coarse) / (gap_ratio(p, levels[i + 1] - levels[i]) - 1)
            for i, (coarse, fine) in list(enumerate(pairwise(series)))[-3:]
        ]
        if len(series) == 2:
            return first[-1], so_far(first[-1] - series[-1])
        change = first[-1] - first[-2]
        if len(series) == 3:
            return _second(first[-1], change, levels[-3:], p, even[..., None]), so_far(change)
        before = first[-2] - first[-3]
        seen = _seen_fall(before, change)
        quick = _fall(levels[-4:], order, order + 2)
        slow = _fall(levels[-4:], order, order + 1)
        is_even = np.nan_to_num(seen, nan=2.0) > np.sqrt(quick * slow)
        value = _second(first[-1], change, levels[-3:], p, is_even[..., None])
        most = np.where(even, quick, slow)
        factor = np.clip(np.nan_to_num(seen, nan=2.0), 2.0, np.maximum(most, 2.0))
        # a change that fell faster than any term falls is one that happens to vanish here: trust the one before it
        expected = so_far(before) / np.maximum(slow, 2.0)[..., None]
        vanishing = seen > most * SAFETY
        size = np.maximum(so_far(change), np.where(vanishing[..., None], expected, 0.0))
        factor = np.where(vanishing, np.minimum(factor, np.maximum(slow, 2.0)), factor)
        return value, SAFETY * size / (factor[..., None] - 1)


def _at_most(change: Floats) -> Floats:
    """Return the largest absolute value, shape (scheme, case, 1)."""
    return absolute(change)[..., None]


def _so_far(change: Floats) -> Floats:
    """Return the largest absolute value up to each time: a zero crossing of an estimate is no small error."""
    return np.asarray(np.maximum.accumulate(np.abs(change), axis=-1))


def _seen_fall(before: Floats, change: Floats) -> Floats:
    """Return the factor by which the change fell, shape (scheme, case): the least of several norms.

    One bad point, such as an end formula, falls more slowly than the rest and weighs differently in each norm.
    """
    one = np.ones(1)
    falls = [
        safe_ratio(norm(before, kind, one), norm(change, kind, one)) for kind in ("l2", "linf")
    ]
    return np.asarray(np.minimum(*falls))


def _rest(coarse: int, fine: int, p: Floats, q: Floats) -> Floats:
    """Return what extrapolating the power p leaves of an error h^q, for ``h = 2^-level``."""
    fall = (gap_ratio(q, fine - coarse) - 1) / (gap_ratio(p, fine - coarse) - 1)
    return np.asarray(np.exp2(-q * fine) * (1 - fall))


def _fall(levels: Sequence[int], p: Floats, q: Floats) -> Floats:
    """Return the factor by which the change of first extrapolations falls, for an error h^q; four levels."""
    rest = [_rest(levels[i], levels[i + 1], p, q) for i in range(3)]
    return np.asarray((rest[0] - rest[1]) / (rest[1] - rest[2]))


def _second(
    first: Floats, change: Floats, levels: Sequence[int], p: Floats, even: NDArray[np.bool_]
) -> Floats:
    """Remove the next power as well; three levels."""
    q = p + np.where(even, 2, 1)
    coarse, fine = (_rest(levels[i], levels[i + 1], p, q) for i in range(2))
    return np.asarray(first + change * fine / (coarse - fine))
