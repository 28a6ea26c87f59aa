r"""Formulas for series: norms, differences of levels, ratios, orders, angles.

With ``u_l = u - h_l^p e_p + ...`` and ``h_l = 2^-l``, two levels differ by ``d = u_l - u_next = -(1 - 1/R) h_l^p e_p``,
``R = 2^(p (next - l))``. So ``-R/(R - 1) d`` estimates the error ``exact - u_l`` (-4/3 for neighbours and p = 2), and
successive differences of equally spaced levels have the ratio R.

Source: pendulum lecture, section 2.5. Series have the shape (..., t); time is the last axis throughout.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from vibsim.convergence.thresholds import PEAKS, STEEPEST
from vibsim.core.array_types import Floats
from vibsim.elementary import on_arrays
from vibsim.elementary.exact import whole_power

SAFE_SQUARES = 1e140
"""Sums of squares of numbers between this and its inverse neither overflow nor underflow."""
NEWTON_STEPS = 8
"""After so many, the error is rounding alone, even if one gap is 1000 times the other."""


def laid_out(values: Floats) -> Floats:
    """Return the same array with time outermost in memory: operations over time then run over all members at once."""
    return np.moveaxis(np.ascontiguousarray(np.moveaxis(values, -1, 0), dtype=np.float64), 0, -1)


def total(values: Floats) -> Floats:
    """Return the sum over time, shape (...), by adding halves to halves.

    The order of the additions depends only on the number of points, so a member has the same bits alone and in a batch.
    """
    while (n := values.shape[-1]) > 1:
        half = n // 2
        folded = values[..., :half] + values[..., half : 2 * half]
        if n % 2:
            folded[..., 0] += values[..., -1]
        values = folded
    return values[..., 0]


def largest(values: Floats) -> Floats:
    """Return the largest absolute value over time, shape (...); NaN if any value is NaN."""
    return np.asarray(np.maximum(np.max(values, axis=-1), -np.min(values, axis=-1)))


def norm(error: Floats, kind: str, spacing: Floats, end_included: int = 1) -> Floats:
    """Return a norm over time.

    ``l1 = dt sum |e|``, ``l2 = sqrt(dt sum e^2)``, ``linf = max |e|``; ``linf_interior`` excludes the end. A vector has
    its coordinates one after the other at each time, so that sums and maxima are over all of them.

    Parameters
    ----------
    error
        Shape (..., case, t); the norm has the shape (..., case), and is NaN if the series contains NaN.
    spacing
        Distance between the points, shape (case,) or (1,).
    end_included
        How many of the last numbers belong to the end of the time interval, 0 if it is not there.
    """
    if kind == "linf_interior" and end_included:
        error = error[..., :-end_included]
    if kind in {"linf", "linf_interior"}:
        return largest(error)
    with np.errstate(over="ignore", invalid="ignore"):
        if kind == "l1":
            return np.asarray(spacing * total(np.abs(error)))
        return _root_of_squares(error, spacing)


def _root_of_squares(error: Floats, spacing: Floats) -> Floats:
    """Return ``sqrt(dt sum e^2)``, scaled if squares would overflow or underflow.

    The scale is a power of two and changes no bit, so it is left out if no member needs it.
    """
    size = largest(error)
    trivial = (size == 0) | ~np.isfinite(size)
    if np.all(trivial | ((size < SAFE_SQUARES) & (size > 1 / SAFE_SQUARES))):
        return np.asarray(np.sqrt(spacing * total(error * error)))
    scale = np.ldexp(1.0, np.frexp(np.where(trivial, 1.0, size))[1] - 1)
    scaled = error / scale[..., None]
    return np.asarray(scale * np.sqrt(spacing * total(scaled * scaled)))


def gap_ratio(order: Floats | float, gap: int) -> Floats:
    """Return ``R = 2^(p gap)``, the factor by which an error of order p falls over `gap` levels."""
    return np.asarray(on_arrays.power(2.0, np.asarray(order, dtype=np.float64) * gap))


def target_ratio(order: Floats | float, levels: Sequence[float]) -> Floats:
    """Return the ratio of the two differences of three levels, for an error of one power.

    ``(2^(p a) - 1)/(1 - 2^(-p b))`` for the gaps a and b: 2^p if both are 1, and a/b at p = 0.
    """
    first, second, third = levels
    p = np.asarray(order, dtype=np.float64) * on_arrays.LN_2
    flat = np.abs(p) < 1e-290
    safe = np.where(flat, 1.0, p)
    ratio = on_arrays.expm1(safe * (second - first)) / -on_arrays.expm1(-safe * (third - second))
    return np.asarray(np.where(flat, (second - first) / (third - second), ratio))


def order_of_ratio(ratio: Floats, levels: Sequence[float]) -> Floats:
    """Solve `target_ratio` for the order; NaN if it exceeds `STEEPEST`, or if the ratio is not positive and finite."""
    first, second, third = levels
    a, b = second - first, third - second
    ratio = np.asarray(ratio, dtype=np.float64)
    usable = np.isfinite(ratio) & (ratio > 0)
    safe = np.where(usable, ratio, 1.0)
    order = on_arrays.log2(safe) / a if a == b else _order_of_ratio(safe, a, b)
    return np.asarray(np.where(usable & (np.abs(order) <= STEEPEST), order, np.nan))


def _order_of_ratio(ratio: Floats, a: float, b: float) -> Floats:
    """Return the order of positive ratios for unequal gaps.

    The slope of the logarithm of the ratio is monotonic and lies between the gaps, so Newton's method converges from 0.
    """
    log = on_arrays.log(ratio)
    x = (log - on_arrays.log(a / b)) / (0.5 * (a + b))
    for _ in range(NEWTON_STEPS):
        size = np.maximum(np.abs(x), 1e-290)
        lost_a, lost_b = on_arrays.expm1(-a * size), on_arrays.expm1(-b * size)
        value = np.where(x > 0.0, a, b) * x + on_arrays.log(lost_a / lost_b)
        bend = b * (1.0 + lost_b) / lost_b - a * (1.0 + lost_a) / lost_a
        slope = np.where(x > 0.0, a + bend, b - bend)
        # rounding near 0 spoils the slope
        x = x - (value - log) / np.clip(slope, min(a, b), max(a, b))
    return np.asarray(x / on_arrays.LN_2)


def local_orders(ratios: Floats, levels: Sequence[float]) -> Floats:
    """Return the order of each three successive of n levels, shape (..., n-2), from the ratios of the differences."""
    triples = [levels[i : i + 3] for i in range(len(levels) - 2)]
    if len({b - a for a, b in pairwise(levels)}) == 1 and triples:
        return order_of_ratio(ratios, triples[0])
    orders = [order_of_ratio(ratios[..., i], triple) for i, triple in enumerate(triples)]
    return np.stack(orders, axis=-1) if orders else np.empty((*ratios.shape[:-1], 0))


def orders_of_steps(ratios: Floats, h: Floats) -> Floats:
    """Return `local_orders` for levels with the step sizes `h`, shape (n,)."""
    return local_orders(ratios, (-on_arrays.log2(h)).tolist())


def safe_ratio(top: Floats, bottom: Floats) -> Floats:
    """Return ``top/bottom``; NaN if the bottom is zero or either is not finite."""
    usable = np.isfinite(top) & np.isfinite(bottom) & (bottom != 0)
    with np.errstate(over="ignore"):
        return np.asarray(np.where(usable, top, np.nan) / np.where(usable, bottom, 1.0))


def last_change(numbers: Floats) -> Floats:
    """Return by how much the finest levels still change a number, shape (...); NaN for one level.

    It is at least half of the previous change, since one change may be small by chance.
    """
    if numbers.shape[-1] < 2:
        return np.full(numbers.shape[:-1], np.nan)
    with np.errstate(all="ignore"):
        change = np.abs(np.diff(numbers[..., -3:], axis=-1))
        change[..., :-1] *= 0.5
        return np.asarray(np.max(change, axis=-1))


def length(series: Floats) -> Floats:
    """Return the root of the sum of squares, shape (...)."""
    return norm(series, "l2", np.ones(1))


def unit(series: Floats, size: Floats) -> Floats:
    """Return a series divided by its size; NaN if that is zero or not finite."""
    usable = np.isfinite(size) & (size != 0)
    return np.asarray(series / np.where(usable, size, np.nan)[..., None])


def cosines(rows: Sequence[Floats], kind: str, end_included: int = 1) -> Floats:
    """Return the cosines of the angles between series, shape (..., row, row); 0 if one of them vanishes.

    They fit the norm: for ``linf`` points are weighted by how large the series are there (`PEAKS`), and
    ``linf_interior`` excludes the end.
    """
    if kind == "linf_interior" and end_included:
        rows = [series[..., :-end_included] for series in rows]
    if kind in {"linf", "linf_interior"}:
        sizes = [np.abs(np.nan_to_num(unit(series, largest(series)))) for series in rows]
        weight = whole_power(np.maximum.reduce(sizes), PEAKS)
        rows = [np.nan_to_num(unit(series, largest(series))) * weight for series in rows]
    units = [np.nan_to_num(unit(series, length(series))) for series in rows]
    result = np.empty((*units[0].shape[:-1], len(units), len(units)))
    for i, first in enumerate(units):
        for j, second in enumerate(units[: i + 1]):
            result[..., i, j] = result[..., j, i] = total(first * second)
    return result
