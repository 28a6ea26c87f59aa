"""How likely the rows of ladders are under hypotheses: logarithms of evidence, shape (ladder, ...)."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np

from vibsim.convergence.error_model import priors
from vibsim.convergence.error_model.hypotheses import Table, outer, packed
from vibsim.convergence.error_model.kernel import weigh
from vibsim.core.array_types import Floats, Integers
from vibsim.elementary import on_arrays

TINY = 1e-300
"""Less is nothing."""
LN_HALF = on_arrays.log(0.5)
_NONE = np.empty((1, 0))


def log_gamma(n: Floats) -> Floats:
    """Return the logarithm of Gamma(n/2) for positive whole n."""
    whole = n.astype(np.int64)
    return _log_gammas(256 * (1 + int(np.max(whole, initial=0)) // 256))[whole]


@lru_cache
def _log_gammas(count: int) -> Floats:
    found = np.array([math.inf, 0.5 * on_arrays.log(np.pi), *np.zeros(count - 2)])
    # log Gamma(x + 1) = log Gamma(x) + log x
    steps = on_arrays.log(0.5 * np.arange(1.0, count - 2.0))
    for start in (1, 2):
        found[start + 2 :: 2] = found[start] + np.cumsum(steps[start - 1 :: 2])
    return found


def scale_free(trace: Floats, log_det: Floats | float, points: Floats, rows: int) -> Floats:
    """Return the evidence of rows of any size; see `vibsim.convergence.error_model`."""
    n = points * rows
    return np.asarray(
        LN_HALF + log_gamma(n) - 0.5 * n * on_arrays.log(np.pi * trace) - 0.5 * points * log_det
    )


def log_sum(logs: Floats) -> Floats:
    """Return the log of the sum of exponentials over the last axis."""
    largest = np.max(logs, axis=-1)
    return np.asarray(
        largest + on_arrays.log(np.sum(on_arrays.exp(logs - largest[..., None]), axis=-1))
    )


class WindowRows(NamedTuple):
    """What all tables of a kind read of the rows of a window; the first axis is that of ladders."""

    last: Floats  # square of the last row
    whole: Floats  # log evidence of rows for which root over trace is that square, and 1
    # see `vibsim.convergence.error_model.kernel.kernel`
    gram: Floats
    read: Floats
    points: Integers
    powers: Integers
    across: Floats
    squares: Floats  # of what each row has across the last one, over that of the last one


def window_rows(gram: Floats, points: Floats, *, split: bool) -> WindowRows:
    """Return what tables read of Gram matrices of w rows: all at once, or `split` what is along and across the last."""
    w, last, number = gram.shape[-1], _last(gram), points.astype(np.int64)
    relative = gram / last[:, None, None]
    if not split:
        whole, all_ = scale_free(last, 0.0, points, w), packed(relative)
        powers, none = np.stack([number * w, 0 * number], axis=-1), np.empty((len(gram), 0))
        return WindowRows(last, whole, all_, all_, number, powers, none, none)
    # one dimension along the last row, which may have any direction, and the others across it, of a Student's t, of
    # which numbers have nothing
    free, one = (points - 1.0) * (w - 1), np.ones_like(points)
    rest = on_arrays.LN_2 + 0.5 * on_arrays.log(last) + scale_free(last, 0.0, points, 1)
    rest += log_gamma(free + priors.TAIL) - log_gamma(np.array(priors.TAIL))
    rest -= 0.5 * free * on_arrays.log(np.pi * last / points)
    powers = np.stack([one * w, (free + priors.TAIL) * (free > 0.0)], axis=-1).astype(np.int64)
    along = outer(relative[:, -1], relative[:, -1])
    read = np.where(points[:, None, None] > 1.0, along, relative)
    across = packed((relative - along)[:, :-1, :-1]) * points[:, None]
    own = np.diagonal(gram, axis1=1, axis2=2)[:, :-1] / last[:, None]
    squares = np.maximum(own - (gram[:, -1, :-1] / last[:, None]) ** 2, 0.0)
    whole = rest + scale_free(last, 0.0, one, w)
    return WindowRows(last, whole, packed(relative), packed(read), number, powers, across, squares)


def _last(gram: Floats) -> Floats:
    """Return the square of the last row."""
    return np.maximum(gram[:, -1, -1], TINY)


def highest(table: Table, read: WindowRows) -> Floats:
    """Return what the log evidence of all hypotheses of a table on some rows is at most, shape (ladder,)."""
    found = read.whole + np.where(read.points > 1, *table.limit[::-1])
    if table.beside_bounds is not None:
        bounds = np.min(table.beside_bounds, axis=0)
        least = np.sum(read.squares * bounds, axis=-1) * read.points
        found -= 0.5 * read.powers[:, 1] * on_arrays.log1p(least)
    return np.asarray(found)


def weights(
    table: Table, read: WindowRows, behind: Floats, least: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Weigh the hypotheses of a table on the rows of a window.

    Parameters
    ----------
    behind
        See `vibsim.convergence.error_model.kernel.kernel`; over the square of the last row.
    least
        Log of what does not matter: hypotheses with less evidence are left out, shape (ladder,).

    Returns
    -------
    tuple
        The log of their evidence, with priors, summed up, shape (ladder,), and the means of what `kernel` finds: of
        pairs of powers, shape (ladder, 3, pair), of the limit in the rows, shape (ladder, w), and of its square.
    """
    count, w, half = len(read.last), table.columns.shape[1] - 5, 0.5 * read.powers[:, 0]
    beside, bounds = (_NONE if x is None else x for x in (table.beside, table.beside_bounds))
    pairs, size = int(table.pair[-1]) + 1, len(table.pair)
    found = np.empty((count, 3 + w + 3 * pairs))
    smallest = on_arrays.exp(np.clip((least - read.whole) / half, -600.0, 600.0))
    weigh()(
        read.gram, read.read, read.points, read.powers, smallest, read.across, behind,
        table.forms, beside, bounds, table.columns, table.pair, table.groups, table.bounds, pairs,
        np.empty(size, dtype=np.int64), *np.empty((3, size)), found,
    )  # fmt: skip
    # rows that are nowhere near any hypothesis have no weight at all
    none = found[:, 1] <= 0.0
    top, total = np.where(none, 1.0, found[:, 0]), np.where(none, 1.0, found[:, 1])
    log = np.where(none, -np.inf, read.whole + half * on_arrays.log(top) + on_arrays.log(total))
    found[:, 2:] /= total[:, None]
    pair_weights = found[:, 3 + w :].reshape(count, 3, pairs)
    return log, pair_weights, found[:, 3 : 3 + w], found[:, 2] * read.last


def single_power(
    sizes: Floats, powers: Floats, gram: Floats, points: Floats
) -> tuple[Floats, Floats, Floats]:
    """Weigh hypotheses of one power on the rows of a window.

    They are those of two shapes without a second power, in terms of the errors of the levels, whose covariance
    ``a a^T + m^2 diag(a^2)`` has an inverse of few terms.

    Parameters
    ----------
    sizes
        Of the levels, over that of the finest one; 0 last, if the last row is the error of that.
    powers
        Those of each ladder, shape (ladder, power).
    gram
        Of the w rows, shape (ladder, w, w).

    Returns
    -------
    tuple
        Log evidence, shape (ladder, power); the limit, with the opposite sign, as weights of the rows, shape (ladder,
        power, w), and its mean square, both without the differences behind the window, and only where the error of
        the finest level is not known.
    """
    w, known, m = gram.shape[-1], sizes[-1] == 0.0, priors.MISFIT**2
    every = range(w if known else w + 1)
    levels = len(every)
    squares = np.zeros((len(gram), levels, levels))
    squares[:, :w, :w] = gram[:, ::-1, ::-1].cumsum(axis=1).cumsum(axis=2)[:, ::-1, ::-1]
    # a and 1/a, a level each
    a = [on_arrays.power(sizes[k], powers) for k in every]
    b = [1.0 / x for x in a]

    def square(x: list[Floats]) -> Floats:
        found = sum(squares[:, k, k, None] * x[k] ** 2 for k in every)
        for j, k in combinations(every, 2):
            found = found + 2.0 * squares[:, j, k, None] * (x[j] * x[k])
        return np.asarray(found)

    trace = (sum(squares[:, k, k, None] * b[k] ** 2 for k in every) - square(b) / (m + levels)) / m
    product = np.prod(sizes[:levels])
    log_det = (
        levels * on_arrays.log(m)
        + on_arrays.log(1.0 + levels / m)
        + 2.0 * powers * on_arrays.log(product)
    )
    gains, spread = np.zeros((*powers.shape, w)), np.zeros_like(powers)
    if not known:
        # any limit will do: K^-1 1, and its sum
        mean = sum(b) / (m + levels)
        of_limit = [(x**2 - x * mean) / m for x in b]
        whole = sum(of_limit)
        trace = trace - square(of_limit) / whole
        log_det = log_det + on_arrays.log(whole)
        of_levels = [x / (m + levels) - y * mean / whole for x, y in zip(b, of_limit, strict=True)]
        gains = np.cumsum(np.stack(of_levels[:w], axis=-1), axis=-1)
        left = m / (m + levels) + mean**2 / whole
        spread = square(of_levels) + trace / w * left
    # rounding leaves no less than the last row alone
    c, noise_of_last = (a[-1], a[-1] ** 2) if known else (a[-2] - a[-1], a[-2] ** 2 + a[-1] ** 2)
    trace = np.maximum(trace, _last(gram)[:, None] / (c**2 + m * noise_of_last))
    return scale_free(trace, log_det, points, w), gains, spread


def any_size(gram: Floats, points: Floats) -> Floats:
    """Return the evidence of every difference of which nothing is known but the next one, shape (ladder, row)."""
    own = np.diagonal(gram, axis1=1, axis2=2)
    across = own[:, :-1] - np.diagonal(gram, 1, 1, 2) ** 2 / own[:, 1:]
    n = points[:, None]
    found = []
    for part in priors.COHERENCES:
        variance = part**2 * own[:, :-1] / n
        log = -0.5 * (n - 1.0) * on_arrays.log(2.0 * np.pi * variance) - 0.5 * on_arrays.log(
            own[:, :-1]
        )
        found.append(log - np.where(n > 1.0, 0.5 * np.maximum(across, 0.0) / variance, 0.0))
    log = log_sum(np.stack(found, axis=-1)) + on_arrays.log(0.5 / len(found))
    return np.concatenate([log, scale_free(own[:, -1:], 0.0, n, 1)], axis=-1)


def noise(sizes: Floats, gram: Floats, points: Floats, floor: Floats) -> Floats:
    """Return the evidence that the differences between these levels are noise, shape (ladder,).

    Noise of the predicted size, within `PREDICTION`, is expected; other noise costs a price.
    """
    count = gram.shape[-1]
    if not count:
        return np.zeros(len(gram))
    # Values of levels, over that of the exact solution, which has no noise, or else of the coarsest level; of these
    # differences ``tr(K^-1 G)`` is the sum of squared distances from the weighted mean, over the variances
    known = len(sizes) == count
    levels = np.zeros((len(gram), count + 1, count + 1))
    if known:
        levels[:, :count, :count] = gram[:, ::-1, ::-1].cumsum(axis=1).cumsum(axis=2)[:, ::-1, ::-1]
    else:
        levels[:, 1:, 1:] = gram.cumsum(axis=1).cumsum(axis=2)
    variance = on_arrays.power(sizes / sizes[-1], -2.0 * np.array(priors.GROWTHS)[:, None])
    weights, log_det = 1.0 / variance, np.sum(on_arrays.log(variance), axis=-1)
    own = levels[:, : len(sizes), : len(sizes)]
    # of every growth and ladder
    trace = np.sum(np.diagonal(own, axis1=1, axis2=2) * weights[:, None], axis=-1)
    if not known:
        whole = np.sum(weights, axis=-1)
        trace -= np.sum(own * outer(weights, weights)[:, None], axis=(-2, -1)) / whole[:, None]
        log_det += on_arrays.log(whole)
    trace = np.maximum(trace, TINY)
    size = 0.5 * on_arrays.log10(trace / count) - on_arrays.log10(np.maximum(floor[:, -1], TINY))
    decades = size / on_arrays.log10(priors.PREDICTION)
    ln_width = on_arrays.log(math.sqrt(2.0 * np.pi) * on_arrays.log(priors.PREDICTION))
    expected = -0.5 * decades**2 - ln_width
    unexpected = np.full_like(expected, on_arrays.log(priors.UNEXPECTED) - priors.PRICE)
    of_size = log_sum(np.stack([expected, unexpected], axis=-1))
    found = scale_free(trace, log_det[:, None], points, count) + of_size
    return np.asarray(log_sum(np.stack(list(found), axis=-1)) - on_arrays.log(len(found)))


def noise_of_finest(floor: Floats, last: Floats) -> tuple[Floats, Floats]:
    """Return the log prior of the two of `FINEST_NOISE`, shape (ladder,).

    A window does not end with a difference that is predicted to be noise.
    """
    share = floor / np.sqrt(np.maximum(last, TINY))
    noisy = np.clip(share / (0.3 * priors.FINEST_NOISE[1]), priors.UNEXPECTED, 0.999)
    drowned = np.where(share > 1.0, on_arrays.log(priors.UNEXPECTED) - priors.PRICE, 0.0)
    return on_arrays.log(1.0 - noisy) + drowned, on_arrays.log(noisy) + drowned
