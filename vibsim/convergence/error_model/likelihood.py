"""Log evidence of the rows of ladders under hypotheses, shape (ladder, ...)."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np

from vibsim.convergence.error_model import priors
from vibsim.convergence.error_model.hypotheses import Table
from vibsim.convergence.error_model.kernel import (
    LIMIT,
    MEAN,
    RATIO,
    SQUARE,
    WEIGHT,
    compiled_kernel,
)
from vibsim.convergence.error_model.matrices import outer, packed
from vibsim.core.array_types import Floats, Integers
from vibsim.elementary import on_arrays

TINY = 1e-300
"""Smallest square used as a divisor or in a logarithm."""
LN_HALF = on_arrays.log(0.5)
LOG_OTHER_NOISE = on_arrays.log(priors.OTHER_NOISE_PRIOR) - priors.FREE_PENALTY
_NONE = np.empty((1, 0))


def log_gamma(n: Floats) -> Floats:
    """Return log Gamma(n/2) for positive whole n."""
    integers = n.astype(np.int64)
    return _log_gammas(256 * (1 + int(np.max(integers, initial=0)) // 256))[integers]


@lru_cache
def _log_gammas(count: int) -> Floats:
    result = np.array([math.inf, 0.5 * on_arrays.log(np.pi), *np.zeros(count - 2)])
    # log Gamma(x + 1) = log Gamma(x) + log x
    steps = on_arrays.log(0.5 * np.arange(1.0, count - 2.0))
    for start in (1, 2):
        result[start + 2 :: 2] = result[start] + np.cumsum(steps[start - 1 :: 2])
    return result


def scale_free(trace: Floats, log_det: Floats | float, points: Floats, rows: int) -> Floats:
    """Return the log evidence of rows of unknown scale; see `vibsim.convergence.error_model`."""
    n = points * rows
    return np.asarray(
        LN_HALF + log_gamma(n) - 0.5 * n * on_arrays.log(np.pi * trace) - 0.5 * points * log_det
    )


def log_sum_exp(logs: Floats) -> Floats:
    """Return the log of the sum of the exponentials along the last axis."""
    largest = np.max(logs, axis=-1)
    return np.asarray(
        largest + on_arrays.log(np.sum(on_arrays.exp(logs - largest[..., None]), axis=-1))
    )


class WindowRows(NamedTuple):
    """The data of a window that `kernel` reads; the first axis is that of ladders."""

    last_square: Floats  # square of the last row
    log_scale: Floats  # log evidence if ``root/tr(K^-1 G)``, with G over `last_square`, and ``1 + tr(B X)`` are 1
    # these are arguments of `vibsim.convergence.error_model.kernel.kernel`
    gram: Floats
    evidence_gram: Floats
    points: Integers
    exponents: Integers
    orthogonal: Floats
    orthogonal_squares: Floats  # squares orthogonal to the last row, over `last_square`


def window_rows(gram: Floats, points: Floats, *, split: bool) -> WindowRows:
    """Return the data of w rows; with `split`, in components parallel and orthogonal to the last row."""
    w, last, n = gram.shape[-1], _last_square(gram), points.astype(np.int64)
    relative = gram / last[:, None, None]
    if not split:
        log_scale, whole = scale_free(last, 0.0, points, w), packed(relative)
        exponents, none = np.stack([n * w, 0 * n], axis=-1), np.empty((len(gram), 0))
        return WindowRows(last, log_scale, whole, whole, n, exponents, none, none)
    # one dimension along the last row, of unknown direction; Student's t in the others, of which numbers have none
    others, one = (points - 1.0) * (w - 1), np.ones_like(points)
    log_t = on_arrays.LN_2 + 0.5 * on_arrays.log(last) + scale_free(last, 0.0, points, 1)
    log_t += log_gamma(others + priors.TAIL) - log_gamma(np.array(priors.TAIL))
    log_t -= 0.5 * others * on_arrays.log(np.pi * last / points)
    exponents = np.stack([one * w, (others + priors.TAIL) * (others > 0.0)], axis=-1)
    exponents = exponents.astype(np.int64)
    parallel = outer(relative[:, -1], relative[:, -1])
    read = np.where(points[:, None, None] > 1.0, parallel, relative)
    orthogonal = packed((relative - parallel)[:, :-1, :-1]) * points[:, None]
    relative_squares = np.diagonal(gram, axis1=1, axis2=2)[:, :-1] / last[:, None]
    squares = np.maximum(relative_squares - (gram[:, -1, :-1] / last[:, None]) ** 2, 0.0)
    log_scale = log_t + scale_free(last, 0.0, one, w)
    data = packed(relative), packed(read), n, exponents, orthogonal, squares
    return WindowRows(last, log_scale, *data)


def _last_square(gram: Floats) -> Floats:
    """Return the square of the last row."""
    return np.maximum(gram[:, -1, -1], TINY)


def log_bound(table: Table, rows: WindowRows) -> Floats:
    """Return an upper bound of the log evidence of a whole table, shape (ladder,)."""
    bound = rows.log_scale + np.where(rows.points > 1, *table.log_bound[::-1])
    if table.orthogonal_bounds is not None:
        bounds = np.min(table.orthogonal_bounds, axis=0)
        least_trace = np.sum(rows.orthogonal_squares * bounds, axis=-1) * rows.points
        bound -= 0.5 * rows.exponents[:, 1] * on_arrays.log1p(least_trace)
    return np.asarray(bound)


def weigh_table(
    table: Table, rows: WindowRows, finer: Floats, least: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Weigh the hypotheses of a table on the rows of a window.

    Parameters
    ----------
    finer
        See `vibsim.convergence.error_model.kernel.kernel`; relative to the square of the last row.
    least
        Hypotheses with less log evidence are skipped, shape (ladder,).

    Returns
    -------
    tuple
        The log of the total evidence including priors, shape (ladder,), and the means of the results of `kernel`: the
        probabilities of pairs of powers, shape (ladder, 3, pair); the limit as weights of the rows, shape (ladder, w);
        the squared distance to the limit, shape (ladder,).
    """
    count, w = len(rows.last_square), table.columns.shape[1] - LIMIT
    half = 0.5 * rows.exponents[:, 0]
    optional = table.orthogonal_forms, table.orthogonal_bounds
    orthogonal_forms, bounds = (_NONE if x is None else x for x in optional)
    pairs, size = int(table.pair[-1]) + 1, len(table.pair)
    result = np.empty((count, MEAN + w + 3 * pairs))
    threshold = on_arrays.exp(np.clip((least - rows.log_scale) / half, -600.0, 600.0))
    compiled_kernel()(
        rows.gram, rows.evidence_gram, rows.points, rows.exponents, threshold, rows.orthogonal, finer,
        table.forms, orthogonal_forms, bounds, table.columns, table.pair, table.groups, table.bounds, pairs,
        np.empty(size, dtype=np.int64), *np.empty((3, size)), result,
    )  # fmt: skip
    # rows far from every hypothesis have zero weight
    empty = result[:, WEIGHT] <= 0.0
    largest, total = (np.where(empty, 1.0, result[:, x]) for x in (RATIO, WEIGHT))
    log = np.where(
        empty, -np.inf, rows.log_scale + half * on_arrays.log(largest) + on_arrays.log(total)
    )
    result[:, SQUARE:] /= total[:, None]
    pair_weights = result[:, MEAN + w :].reshape(count, 3, pairs)
    return log, pair_weights, result[:, MEAN : MEAN + w], result[:, SQUARE] * rows.last_square


def single_power(
    sizes: Floats, powers: Floats, gram: Floats, points: Floats
) -> tuple[Floats, Floats, Floats]:
    """Weigh hypotheses of one power on the rows of a window.

    They equal those of two shapes without a second power. In terms of the errors of the levels the covariance
    ``a a^T + m diag(a^2)``, m the square of `MISFIT`, has a closed inverse.

    Parameters
    ----------
    sizes
        Step sizes relative to the finest level; 0 is appended if the last row is the error of that level.
    powers
        Powers to weigh for each ladder, shape (ladder, power).
    gram
        Gram matrices of the w rows, shape (ladder, w, w).

    Returns
    -------
    tuple
        Log evidence, shape (ladder, power); the finest level minus the limit as weights of the rows, shape (ladder,
        power, w); the mean square of that difference. The last two leave out the differences finer than the window,
        and are 0 if the error of the finest level is known.
    """
    w, known, m = gram.shape[-1], sizes[-1] == 0.0, priors.MISFIT**2
    every = range(w if known else w + 1)
    levels = len(every)
    products = np.zeros((len(gram), levels, levels))
    products[:, :w, :w] = gram[:, ::-1, ::-1].cumsum(axis=1).cumsum(axis=2)[:, ::-1, ::-1]
    # a and 1/a of each level
    a = [on_arrays.power(sizes[k], powers) for k in every]
    b = [1.0 / x for x in a]

    def square(x: list[Floats]) -> Floats:
        total = sum(products[:, k, k, None] * x[k] ** 2 for k in every)
        for j, k in combinations(every, 2):
            total = total + 2.0 * products[:, j, k, None] * (x[j] * x[k])
        return np.asarray(total)

    trace = (sum(products[:, k, k, None] * b[k] ** 2 for k in every) - square(b) / (m + levels)) / m
    product = np.prod(sizes[:levels])
    log_det = (
        levels * on_arrays.log(m)
        + on_arrays.log(1.0 + levels / m)
        + 2.0 * powers * on_arrays.log(product)
    )
    gains, squares = np.zeros((*powers.shape, w)), np.zeros_like(powers)
    if not known:
        # project the unknown limit out: K^-1 1, and its sum
        mean = sum(b) / (m + levels)
        column = [(x**2 - x * mean) / m for x in b]
        total = sum(column)
        trace = trace - square(column) / total
        log_det = log_det + on_arrays.log(total)
        per_level = [x / (m + levels) - y * mean / total for x, y in zip(b, column, strict=True)]
        gains = np.cumsum(np.stack(per_level[:w], axis=-1), axis=-1)
        left = m / (m + levels) + mean**2 / total
        squares = square(per_level) + trace / w * left
    # rounding must not make it less than the contribution of the last row alone
    signal, noise = (a[-1], a[-1] ** 2) if known else (a[-2] - a[-1], a[-2] ** 2 + a[-1] ** 2)
    trace = np.maximum(trace, _last_square(gram)[:, None] / (signal**2 + m * noise))
    return scale_free(trace, log_det, points, w), gains, squares


def free_row_evidence(gram: Floats, points: Floats) -> Floats:
    """Return the log evidence of each row given only the next finer row, shape (ladder, row)."""
    squares = np.diagonal(gram, axis1=1, axis2=2)
    orthogonal = squares[:, :-1] - np.diagonal(gram, 1, 1, 2) ** 2 / squares[:, 1:]
    n = points[:, None]
    logs = []
    for coherence in priors.COHERENCES:
        variance = coherence**2 * squares[:, :-1] / n
        log = -0.5 * (n - 1.0) * on_arrays.log(2.0 * np.pi * variance) - 0.5 * on_arrays.log(
            squares[:, :-1]
        )
        logs.append(log - np.where(n > 1.0, 0.5 * np.maximum(orthogonal, 0.0) / variance, 0.0))
    log = log_sum_exp(np.stack(logs, axis=-1)) + on_arrays.log(0.5 / len(logs))
    return np.concatenate([log, scale_free(squares[:, -1:], 0.0, n, 1)], axis=-1)


def noise_evidence(sizes: Floats, gram: Floats, points: Floats, floor: Floats) -> Floats:
    """Return the log evidence that the differences of these levels are noise, shape (ladder,).

    Noise within `PREDICTION_FACTOR` of its prediction is expected; other noise has the prior `OTHER_NOISE_PRIOR`.
    """
    count = gram.shape[-1]
    if not count:
        return np.zeros(len(gram))
    # Levels relative to the exact solution, which has no noise, or else to the coarsest level. Then ``tr(K^-1 G)`` is
    # the sum of their squared distances from the exact solution, or else from their weighted mean, over the variances.
    exact_known = len(sizes) == count
    levels = np.zeros((len(gram), count + 1, count + 1))
    if exact_known:
        levels[:, :count, :count] = gram[:, ::-1, ::-1].cumsum(axis=1).cumsum(axis=2)[:, ::-1, ::-1]
    else:
        levels[:, 1:, 1:] = gram.cumsum(axis=1).cumsum(axis=2)
    variance = on_arrays.power(sizes / sizes[-1], -2.0 * np.array(priors.GROWTHS)[:, None])
    weights, log_det = 1.0 / variance, np.sum(on_arrays.log(variance), axis=-1)
    values = levels[:, : len(sizes), : len(sizes)]
    # shape (growth, ladder)
    trace = np.sum(np.diagonal(values, axis1=1, axis2=2) * weights[:, None], axis=-1)
    if not exact_known:
        total = np.sum(weights, axis=-1)
        trace -= np.sum(values * outer(weights, weights)[:, None], axis=(-2, -1)) / total[:, None]
        log_det += on_arrays.log(total)
    trace = np.maximum(trace, TINY)
    size = 0.5 * on_arrays.log10(trace / count) - on_arrays.log10(np.maximum(floor[:, -1], TINY))
    decades = size / on_arrays.log10(priors.PREDICTION_FACTOR)
    ln_width = on_arrays.log(math.sqrt(2.0 * np.pi) * on_arrays.log(priors.PREDICTION_FACTOR))
    expected = -0.5 * decades**2 - ln_width
    unexpected = np.full_like(expected, LOG_OTHER_NOISE)
    size_prior = log_sum_exp(np.stack([expected, unexpected], axis=-1))
    log = scale_free(trace, log_det[:, None], points, count) + size_prior
    return np.asarray(log_sum_exp(np.stack(list(log), axis=-1)) - on_arrays.log(len(log)))


def finest_noise_log_priors(floor: Floats, last_square: Floats) -> tuple[Floats, Floats]:
    """Return the log priors of both entries of `FINEST_NOISE`, each of shape (ladder,).

    The second one has the prior ``floor/(FINEST_NOISE[1] e)``, between `OTHER_NOISE_PRIOR` and `MOST_NOISY`, where the
    error e of the finest level is `FINEST_ERROR` of the last difference (or of the error itself, if that is known and
    smaller). A window should not end with a difference below the predicted noise: that costs as much as other noise.
    """
    ratio = floor / np.sqrt(np.maximum(last_square, TINY))
    noisy = ratio / (priors.FINEST_ERROR * priors.FINEST_NOISE[1])
    noisy = np.clip(noisy, priors.OTHER_NOISE_PRIOR, priors.MOST_NOISY)
    penalty = np.where(ratio > 1.0, LOG_OTHER_NOISE, 0.0)
    return on_arrays.log(1.0 - noisy) + penalty, on_arrays.log(noisy) + penalty
