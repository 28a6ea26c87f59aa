"""How large the error of the finest level is, and how far that is known.

Where the exact solution is known it is the true error, known to round-off. Elsewhere it is the distance to the
extrapolated solution, known to the bound of that. Extrapolation removes the promised power: where the levels show
another one, p, the error is that of the last difference, ``|d|/(2^p - 1)``, known as well as p. How far all of this can
be trusted, the verdict on the order says.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibsim.apriori.roundoff_floor import norm_of_floor
from vibsim.comparison.order_evidence import judgement
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.convergence import differences
from vibsim.convergence.reasons import is_one_of
from vibsim.convergence.thresholds import ROUND_OFF_SAFETY
from vibsim.core.array_types import Flags, Floats
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.elementary import on_arrays


class FinestError(NamedTuple):
    """The error of the finest level in the L2 norm over time; arrays of shape (scheme, case), NaN where unknown."""

    error: Floats
    bound: Floats
    """It is no larger than that."""
    size: Floats
    """The same norm of the solution: the exact one where it is known, else that of the finest level."""
    is_true: Flags
    """Whether it is the difference from the exact solution."""
    round_off: Floats
    """What round-off may make of it."""


def error_of_finest(q: Comparison) -> FinestError:
    """Measure or estimate the error of the finest level of a quantity that is compared between levels."""
    grid, shape, finest = q.block.grid, q.block.shape, q.values[-1]

    def size_of(series: Floats) -> Floats:
        return differences.norm(series, TYPICAL_NORM, grid.spacing, grid.end_included)

    def of_noise(noise: Floats) -> Floats:
        return norm_of_floor(noise, TYPICAL_NORM, len(grid.t), grid.spacing)

    error = q.in_norm(TYPICAL_NORM).error[..., -1]
    round_off = of_noise(ROUND_OFF_SAFETY * q.floor[..., -1] + q.blur[..., -1])
    is_true, bound = np.isfinite(error), error + round_off
    size = np.full(shape, np.nan)
    if q.exact is not None:
        size = np.broadcast_to(size_of(q.exact), shape)
    if not np.all(is_true):
        # the bound of a series never falls with time, so the largest bounds it at every time
        with np.errstate(over="ignore", invalid="ignore"):
            distance = size_of(finest - q.extrapolation[0])
        farthest = distance + of_noise(q.largest_bound + q.blur[..., -1])
        distance, farthest = _of_other_order(q, distance, farthest)
        error = np.where(is_true, error, distance)
        bound = np.where(is_true, bound, farthest)
        size = np.where(is_true, size, size_of(finest))
    return FinestError(error, bound, size, is_true, round_off)


def _of_other_order(q: Comparison, error: Floats, bound: Floats) -> tuple[Floats, Floats]:
    """Return an error and its bound by the order that was measured, where that is another one than the promised."""
    judged = judgement(q, TYPICAL_NORM)
    is_other = is_one_of(judged.reason, "order_low", "order_high")
    if not np.any(is_other):
        return error, bound
    levels, change = q.block.grid.levels, q.in_norm(TYPICAL_NORM).difference[..., -1]
    order, orders = judged.order, judged.orders[..., -2:]
    # the second power, which the difference has as well, shows in how the orders still change
    known_to = np.fmax(
        order - judged.low, np.fmax.reduce(np.abs(orders - order[..., None]), axis=-1)
    )
    known_to = np.fmax(known_to, np.abs(orders[..., -1] - orders[..., 0]))
    with np.errstate(all="ignore"):
        measured, most = (
            change
            / on_arrays.expm1(np.maximum(p, 0.0) * ((levels[-1] - levels[-2]) * on_arrays.LN_2))
            for p in (order, order - known_to)
        )
    return (
        np.where(is_other, measured, error),
        np.where(is_other, np.fmin(np.fmax(bound, measured), most), bound),
    )
