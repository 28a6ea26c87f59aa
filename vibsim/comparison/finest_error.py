"""The error of the finest level, and an upper bound of it.

If the exact solution is known, this is the true error, accurate to round-off. Otherwise it is the distance to the
extrapolated solution, accurate to the bound of that. Extrapolation eliminates the promised power; if the levels show
another power p, the error is estimated from the last difference by ``|d|/(2^p - 1)``, with the uncertainty of p. The
verdict on the order tells how reliable the estimate is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibsim.apriori.roundoff_floor import norm_of_floor
from vibsim.comparison.order_verdict import judgement
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
    """Upper bound of the error."""
    size: Floats
    """Norm of the exact solution, or of the finest level if that is unknown."""
    is_true: Flags
    """Whether the error is the difference from the exact solution."""
    round_off: Floats
    """Upper bound of round-off in the error."""


def error_of_finest(q: Comparison) -> FinestError:
    """Measure or estimate the error of the finest level of a quantity."""
    grid, shape, finest = q.block.grid, q.block.shape, q.values[-1]

    def size_of(series: Floats) -> Floats:
        return differences.norm(series, TYPICAL_NORM, grid.spacing)

    def norm_of_noise(noise: Floats) -> Floats:
        return norm_of_floor(noise, TYPICAL_NORM, q.points, grid.spacing)

    error = q.in_norm(TYPICAL_NORM).error[..., -1]
    round_off = norm_of_noise(ROUND_OFF_SAFETY * q.floor[..., -1] + q.blur[..., -1])
    is_true, bound = np.isfinite(error), error + round_off
    size = np.full(shape, np.nan)
    if q.exact is not None:
        size = np.broadcast_to(size_of(q.exact), shape)
    if not np.all(is_true):
        # the bound of a series never decreases with time, so the largest bound holds at all times
        with np.errstate(over="ignore", invalid="ignore"):
            distance = size_of(finest - q.extrapolation[0])
        farthest = distance + norm_of_noise(q.largest_bound + q.blur[..., -1])
        distance, farthest = _by_measured_order(q, distance, farthest)
        error = np.where(is_true, error, distance)
        bound = np.where(is_true, bound, farthest)
        size = np.where(is_true, size, size_of(finest))
    return FinestError(error, bound, size, is_true, round_off)


def _by_measured_order(q: Comparison, error: Floats, bound: Floats) -> tuple[Floats, Floats]:
    """Return an error and its bound, estimated by the measured order where that differs from the promised one."""
    judged = judgement(q, TYPICAL_NORM)
    is_other = is_one_of(judged.reason, "order_low", "order_high")
    if not np.any(is_other):
        return error, bound
    levels, change = q.block.grid.levels, q.in_norm(TYPICAL_NORM).difference[..., -1]
    order, orders = judged.order, judged.orders[..., -2:]
    # the second power of the difference shows in how much the orders still change
    uncertainty = np.fmax(
        order - judged.low, np.fmax.reduce(np.abs(orders - order[..., None]), axis=-1)
    )
    uncertainty = np.fmax(uncertainty, np.abs(orders[..., -1] - orders[..., 0]))
    with np.errstate(all="ignore"):
        measured, largest = (
            change
            / on_arrays.expm1(np.maximum(p, 0.0) * ((levels[-1] - levels[-2]) * on_arrays.LN_2))
            for p in (order, order - uncertainty)
        )
    return (
        np.where(is_other, measured, error),
        np.where(is_other, np.fmin(np.fmax(bound, measured), largest), bound),
    )
