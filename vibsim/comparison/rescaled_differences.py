"""Differences as estimates of errors: rescaled by the powers of an order, and how far they then coincide."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vibsim.comparison.thresholds import ZERO_CROSSING
from vibsim.convergence.differences import length, safe_ratio, target_ratio, total, unit
from vibsim.convergence.thresholds import ROUND_OFF_SAFETY
from vibsim.core.array_types import Floats
from vibsim.elementary import on_arrays


def error_factor(order: Floats | float, gap: int) -> Floats:
    """Return ``-R/(R - 1)``, the ratio of the error of the coarser level to the difference."""
    return np.asarray(
        1.0 / on_arrays.expm1(-np.asarray(order, dtype=np.float64) * gap * on_arrays.LN_2)
    )


def rescaling(order: Floats | float, levels: Sequence[int]) -> Floats:
    """Return the ratio of the first to the last difference of `levels`, for an error of one power.

    It is ``(2^p)^k`` for successive levels (A, section 2.5), and the product of the target ratios in general.
    """
    factor = np.ones_like(np.asarray(order, dtype=np.float64))
    for i in range(len(levels) - 2):
        factor = factor * target_ratio(order, levels[i : i + 3])
    return factor


def local_scale(series: Floats) -> Floats:
    """Return the size of a series around each point, shape (..., t).

    This is the smaller of the largest value up to the point and the largest value from it on. It follows growing and
    decaying errors, and does not vanish at a zero crossing between two humps.
    """
    size = np.nan_to_num(np.abs(series), nan=0.0, posinf=0.0)
    before = np.maximum.accumulate(size, axis=-1)
    after = np.maximum.accumulate(size[..., ::-1], axis=-1)[..., ::-1]
    return np.asarray(np.minimum(before, after))


def masked_ratio(first: Floats, second: Floats, floor: Floats | float = 0.0) -> Floats:
    """Return the ratio of successive differences as a function of time.

    It is NaN at zero crossings of either difference, where it is below `ZERO_CROSSING` times its `local_scale` or
    changes its sign, and where the finer difference is below `ROUND_OFF_SAFETY` times its `floor`, of shape (..., 1).
    """
    keep = np.abs(second) > ROUND_OFF_SAFETY * np.asarray(floor)
    for series in (first, second):
        keep &= np.abs(series) > ZERO_CROSSING * local_scale(series)
        crossing = np.sign(series[..., 1:]) * np.sign(series[..., :-1]) < 0
        keep[..., 1:] &= ~crossing
        keep[..., :-1] &= ~crossing
    return np.where(keep, safe_ratio(first, second), np.nan)


def proportionality(first: Floats, second: Floats) -> Floats:
    """Return the least-squares factor ``r = <d, d'>/<d', d'>`` of ``d = r d'``, shape (...)."""
    sizes = length(first), length(second)
    cosine = total(unit(first, sizes[0]) * unit(second, sizes[1]))
    return cosine * safe_ratio(*sizes)


def coincidence(first: Floats, second: Floats, ratio: Floats) -> Floats:
    """Return ``||d - R d'|| / ||d||`` in the L2 norm, shape (...): 0 if the rescaled curves coincide.

    R is the `target_ratio` of the order. The result is 0 if both differences vanish, and NaN if only d does.
    """
    size = length(first)
    with np.errstate(over="ignore", invalid="ignore"):
        residual = length(first - np.asarray(ratio)[..., None] * second)
    return np.where((size == 0) & (residual == 0), 0.0, safe_ratio(residual, size))
