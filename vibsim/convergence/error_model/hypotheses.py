"""What hypotheses on errors expect of the rows of a window of levels, for all hypotheses at once."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from vibsim.convergence.error_model import priors
from vibsim.core.array_types import Floats, Integers
from vibsim.elementary import on_arrays


@dataclass(frozen=True)
class Terms:
    """Hypotheses on the powers of an expansion; arrays of shape (hypothesis,)."""

    lower: Floats  # p
    higher: Floats  # q; p where there is none
    share: Floats  # size of the second power over the first at the finest level of the window, with its sign
    log_prior: Floats

    @property
    def first_of_pairs(self) -> Integers:
        """First hypothesis of every pair of powers."""
        differs = (np.diff(self.lower) != 0.0) | (np.diff(self.higher) != 0.0)
        return np.flatnonzero(np.concatenate([[True], differs]))


@dataclass(frozen=True)
class Table:
    """What the hypotheses on the w rows of a window say, laid out for `kernel`.

    The evidence of rows with N points is ``(root/tr(K^-1 G))^(N w/2)`` with ``root = (prior/det(K)^(N/2))^(2/(N w))``,
    but for factors that all hypotheses on w rows share; of one shape see `_table`.
    """

    # forms of the precision K^-1, of the square of the first power, of the second, and of the limit without the
    # differences behind the window; shape (hypothesis, 4, packed)
    forms: Floats
    # root for one point and for two; variances over the scale that the rows leave to the first power, the second, and
    # the limit; the limit less the finest level, as weights of the rows; shape (hypothesis, 5 + w)
    columns: Floats
    pair: Integers  # position of its pair of powers, shape (hypothesis,)
    # first hypothesis of every group, and the end of the last one, shape (group + 1,)
    groups: Integers
    # The evidence of a group is at most ``(root/tr(M G))^(N w/2)``: its root for one point and for two, and the form of
    # M; shape (2 + packed, group).
    bounds: Floats
    # log of the evidence of all hypotheses at most, for one point and for two, where the last row has the square 1
    limit: Floats
    # of one shape: form of the precision of what the other rows are beside multiples of the last one, over `TAIL`
    beside: Floats | None = None
    # the same for whole groups: what is less than the forms of all, of the squares of the rows, shape (group, w - 1)
    beside_bounds: Floats | None = None


class Promise(NamedTuple):
    """An order that is expected."""

    order: float
    # whether theory promises it, and so knows the other powers too, or a user expects it
    by_theory: bool = False


@lru_cache
def two_powers(signs: tuple[float, ...], promise: Promise | None) -> Terms:
    """Return the hypotheses on the powers: one of `POWERS` with or without a second one."""
    order, by_theory = promise or (math.nan, False)
    usual = sorted({*priors.POWERS, *(p for p in [order] if 0.0 < p < math.inf)})
    # no method has most of the orders between whole numbers that a user may expect
    of_promise = priors.THEORY if by_theory else priors.EXPECTED * (order % 1.0 == 0.0)
    of_promise *= order in usual

    def chance(p: float) -> float:
        return priors.BETWEEN if by_theory and (p - order) % 1.0 else 1.0

    whole, rows = sum(map(chance, usual)), []
    distances = {distance: chance(order + distance) for distance in priors.DISTANCES}
    for p in usual:
        prior = (1.0 - of_promise) * chance(p) / whole + of_promise * (p == order)
        prior *= 1.0 - priors.OTHER_PRIOR
        rows.append((p, p, 0.0, prior * priors.PURE_PRIOR))
        each = prior * (1.0 - priors.PURE_PRIOR) / sum(distances.values())
        each /= len(priors.SHARES) * len(signs)
        rows += [
            (p, p + distance, sign * share, each * distances[distance])
            for distance, share, sign in product(distances, priors.SHARES, signs)
        ]
    lower, higher, share, log_prior = np.array(rows).T
    return Terms(lower, higher, share, on_arrays.log(log_prior))


def pure(powers: tuple[float, ...]) -> Terms:
    """Return the hypotheses of one power."""
    p = np.array(powers)
    return Terms(p, p, np.zeros(len(p)), np.full(len(p), -on_arrays.log(len(p))))


def between(levels: Floats) -> Floats:
    """Return the differences of what belongs to levels, along the last axis."""
    return np.asarray(levels[..., :-1] - levels[..., 1:])


def noise_of_rows(variance: Floats) -> Floats:
    """Return the covariance of the differences of levels with independent noise, shape (..., row, row)."""
    count = variance.shape[-1] - 1
    found = np.zeros((*variance.shape[:-1], count, count))
    every = np.arange(count)
    found[..., every, every] = variance[..., :-1] + variance[..., 1:]
    found[..., every[1:], every[:-1]] = found[..., every[:-1], every[1:]] = -variance[..., 1:-1]
    return found


def outer(one: Floats, other: Floats) -> Floats:
    """Return the outer products of the vectors along the last axis."""
    return np.asarray(one[..., :, None] * other[..., None, :])


def packed(matrices: Floats) -> Floats:
    """Return the entries (i, j), i <= j, of symmetric matrices, shape (..., packed)."""
    i, j = _upper(matrices.shape[-1])
    return np.ascontiguousarray(matrices[..., i, j])


@lru_cache
def _upper(size: int) -> tuple[Integers, Integers]:
    i, j = np.triu_indices(size)
    return i, j


def form(matrices: Floats) -> Floats:
    """Return what to multiply packed Gram matrices with, and sum up, for ``tr(M G)``."""
    i, j = _upper(matrices.shape[-1])
    return np.where(i == j, 1.0, 2.0) * packed(matrices)


def times(matrices: Floats, vectors: Floats) -> Floats:
    """Return products of matrices and vectors, shape (..., i), added up in the order of the columns."""
    found = matrices[..., 0] * vectors[..., None, 0]
    for k in range(1, vectors.shape[-1]):
        found = found + matrices[..., k] * vectors[..., None, k]
    return np.asarray(found)


def inverse(covariance: Floats) -> tuple[Floats, Floats]:
    """Return inverse and log determinant of covariances, entry by entry, which gives the same bits everywhere."""
    # By Cholesky, L L^T, of matrices scaled so that sizes of rows do not matter. Entries are arrays of all matrices.
    scale = np.sqrt(np.moveaxis(np.diagonal(covariance, axis1=-2, axis2=-1), -1, 0))
    size = outer(np.moveaxis(scale, 0, -1), np.moveaxis(scale, 0, -1))
    a = np.ascontiguousarray(np.moveaxis(covariance / size, (-2, -1), (0, 1)))
    w = len(a)
    # of L^-1: row i is (e_i - sum_j L_ij row_j)/L_ii
    lower, inverted = np.zeros_like(a), np.zeros_like(a)
    log_det = np.zeros_like(scale[0])
    for i in range(w):
        inverted[i, i] = 1.0
        rest = a[i, i]
        for j in range(i):
            entry = a[i, j]
            for k in range(j):
                entry = entry - lower[i, k] * lower[j, k]
            lower[i, j] = entry / lower[j, j]
            rest = rest - lower[i, j] ** 2
            inverted[i, : j + 1] -= lower[i, j] * inverted[j, : j + 1]
        lower[i, i] = np.sqrt(np.maximum(rest, ROUNDED))
        inverted[i, : i + 1] /= lower[i, i]
        log_det = log_det + 2.0 * on_arrays.log(lower[i, i] * scale[i])
    precision = np.zeros_like(a)
    for i in range(w):
        own = inverted[i, : i + 1]
        precision[: i + 1, : i + 1] += own[:, None] * own[None]
    return np.moveaxis(precision, (0, 1), (-2, -1)) / size, log_det


ROUNDED = 1e-16
"""What rounding leaves of a variance of 1 at least."""


def _sizes(terms: Terms, sizes: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the error of each level by the first power, the second, and the sum of their squares; (hypothesis, level).

    Sizes are over that of the finest level of the window; the share is that at the same level.
    """
    first = on_arrays.power(sizes, terms.lower[:, None])
    second = np.where(
        terms.share[:, None] == 0.0, 0.0, on_arrays.power(sizes, terms.higher[:, None])
    )
    return first, second, first**2 + (terms.share[:, None] * second) ** 2


def _table(
    terms: Terms,
    signal: Floats,
    variance: Floats,
    c: tuple[Floats, Floats],
    prior: tuple[Floats, Floats, Floats],
    beside: Floats | None = None,
) -> Table:
    """Lay hypotheses out.

    Parameters
    ----------
    signal
        Covariance that both powers give the rows, shape (hypothesis, row, row).
    variance
        That of the noise of each level, shape (hypothesis, level).
    c
        Both powers in the rows, at size 1, each of shape (hypothesis, row).
    prior
        Variance of the first power, covariance, and variance of the second, each of shape (hypothesis,).
    beside
        Of one shape: covariance of what the other rows are beside multiples of the last one, shape (hypothesis, w - 1,
        w - 1).
    """
    precision, log_det = inverse(signal + noise_of_rows(variance))
    finest = np.flatnonzero(variance[0])[-1]
    own_noise = variance[:, finest]
    w = precision.shape[-1]
    one, both, other = (x[:, None] for x in prior)
    rows = (one * c[0] + both * c[1], both * c[0] + other * c[1])
    gains = [times(precision, row) for row in rows]
    left = [
        np.maximum(x - np.sum(gain * row, axis=-1), 0.0)
        for x, gain, row in zip(prior[::2], gains, rows, strict=True)
    ]
    # the limit is off the finest level by both powers there, and by its noise
    to_limit = rows[0] + rows[1]
    to_limit[:, finest - 1] -= own_noise
    path = -times(precision, to_limit)
    whole = prior[0] + 2.0 * prior[1] + prior[2] + own_noise
    left_whole = np.maximum(whole + np.sum(path * to_limit, axis=-1), 0.0)
    forms = np.stack([form(x) for x in (precision, *(outer(g, g) for g in (*gains, path)))], axis=1)
    precision_beside, log_det_beside = (None, 0.0) if beside is None else inverse(beside)
    # of one shape there is one dimension along the last row, all others are across it
    dimensions = [(n, n if beside is None else 1) for n in (1, 2)]
    roots = np.stack(
        [
            on_arrays.exp((2.0 / d * terms.log_prior - log_det - (n - d) * log_det_beside) / w)
            for n, d in dimensions
        ]
    )
    columns = np.stack([*roots, *left, left_whole, *path.T], axis=1)
    pair = np.searchsorted(terms.first_of_pairs, np.arange(len(terms.lower)), side="right") - 1
    groups = _groups(pair, terms.share)
    exponents = np.array([[0.5 * d * w] for _, d in dimensions])
    bounds = _bounds(
        groups, terms.share, variance, c, roots, exponents, 1.0 if beside is None else 2.0
    )
    # tr(K^-1 G) is at least the square of the last row over its variance
    last = signal[:, -1, -1] + np.sum(variance[:, -2:], axis=-1)
    limit = on_arrays.log(np.sum(on_arrays.power(roots * last, exponents), axis=1))
    table = Table(np.ascontiguousarray(forms), columns, pair, groups, bounds, limit)
    if beside is None or precision_beside is None:
        return table
    # a covariance is exceeded by its diagonal times its size
    diagonal = np.diagonal(beside, axis1=1, axis2=2) * (w - 1)
    return replace(
        table,
        beside=np.ascontiguousarray(form(precision_beside)),
        beside_bounds=1.0 / np.maximum.reduceat(diagonal, groups[:-1], axis=0),
    )


def _groups(pair: Integers, share: Floats) -> Integers:
    """Return where groups begin: hypotheses on one pair of powers, with up to `TOGETHER` successive shares."""
    size = np.abs(share)
    differs = np.concatenate([[True], (np.diff(size) != 0.0) | (np.diff(pair) != 0)])
    of_share = np.cumsum(differs) - 1
    first = np.concatenate([[True], np.diff(pair) != 0])
    within = of_share - np.maximum.accumulate(np.where(first, of_share, 0))
    return np.append(np.flatnonzero(differs & (within % TOGETHER == 0)), len(pair))


def _bounds(
    groups: Integers,
    share: Floats,
    variance: Floats,
    c: tuple[Floats, Floats],
    roots: Floats,
    exponents: Floats,
    factor: float,
) -> Floats:
    """Return `Table.bounds`.

    Where a matrix C exceeds ``K/t`` for all hypotheses of a group, ``tr(K^-1 G) >= tr(C^-1 G)/t``. C has the largest
    variances over t of the group, with ``t = 1 + share^2``; what is correlated is at most `factor` of what is not.
    """
    start, t = groups[:-1], 1.0 + share**2
    parts = [np.maximum.reduceat(part / t, start) for part in (np.ones_like(t), share**2)]
    signal = sum(
        factor * part[:, None, None] * outer(row[start], row[start])
        for part, row in zip(parts, c, strict=True)
    )
    noise = noise_of_rows(np.maximum.reduceat(variance / t[:, None], start, axis=0))
    precision, _ = inverse(signal + noise)
    root = np.add.reduceat(on_arrays.power(roots * t, exponents), start, axis=1)
    root = on_arrays.power(root, 1.0 / exponents)
    return np.ascontiguousarray(np.concatenate([root, form(precision).T]))


TOGETHER = 5
"""So many shares of the second power have a bound together."""


def _independent(
    terms: Terms, c: tuple[Floats, Floats]
) -> tuple[Floats, tuple[Floats, Floats, Floats]]:
    """Return `signal` and `prior` of `_table` for two powers whose sizes have nothing to do with each other."""
    square = terms.share**2
    signal = outer(c[0], c[0]) + square[:, None, None] * outer(c[1], c[1])
    return signal, (np.ones_like(square), np.zeros_like(square), square)


def _two_shapes(sizes: Floats, terms: Terms, *, alternating: bool = False) -> list[Table]:
    """Return the hypotheses of two shapes on the rows between levels of these sizes, for each of `FINEST_NOISE`."""
    first, second, squares = _sizes(terms, sizes)
    if alternating:
        first, second = (x * (-1.0) ** np.arange(len(sizes)) for x in (first, second))
    c = between(first), between(second)
    signal, prior = _independent(terms, c)
    finest = np.flatnonzero(sizes)[-1]
    found = []
    for noise in priors.FINEST_NOISE:
        part = np.full(len(sizes), priors.MISFIT**2)
        part[finest] += noise**2
        found.append(_table(terms, signal, squares * part, c, prior))
    return found


def _off_by_factors(
    sizes: Floats, terms: Terms, jitter: float, *, own_shape: bool = False
) -> Table:
    """Return the hypotheses of levels whose errors are off by a factor each, which is 1 but for a `jitter`.

    The second power is a multiple of the first, or has beside that as large a part of an `own_shape`.
    """
    first, second, squares = _sizes(terms, sizes)
    powers = between(first), between(second)
    c = powers[0] + terms.share[:, None] * powers[1]
    part, across = _beside_last(c, squares)
    if own_shape:
        beside_last = terms.share[:, None] * (powers[1][:, :-1] - part * powers[1][:, -1:])
        across = across + outer(beside_last, beside_last)
    beside = priors.TAIL * across / c[:, -1, None, None] ** 2
    ones = np.ones_like(terms.share)
    prior = ones, terms.share, terms.share**2
    return _table(terms, outer(c, c), jitter**2 * squares, powers, prior, beside)


def _one_shape(sizes: Floats, terms: Terms) -> Table:
    """Return the hypotheses that both powers have one shape: the second is any multiple of the first, of its share."""
    first, second, squares = _sizes(terms, sizes)
    c = between(first), between(second)
    signal, prior = _independent(terms, c)
    size = np.sqrt(c[0] ** 2 + prior[2][:, None] * c[1] ** 2)
    _, across = _beside_last(size, squares)
    beside = priors.TAIL * across / size[:, -1, None, None] ** 2
    return _table(terms, signal, priors.MISFIT**2 * squares, c, prior, beside)


def _beside_last(c: Floats, squares: Floats) -> tuple[Floats, Floats]:
    """Return the size of the other rows over that of the last one, and the covariance of what they are beside it.

    That is what the misfit leaves beside multiples of the last row, if all have one shape and the sizes `c`.
    """
    noise = noise_of_rows(squares)
    part = c[:, :-1] / c[:, -1:]
    across = noise[:, :-1, :-1] + outer(part, part) * noise[:, -1:, -1:]
    mixed = outer(part, noise[:, -1, :-1])
    return part, priors.MISFIT**2 * (across - mixed - np.swapaxes(mixed, 1, 2))


class Hypotheses(NamedTuple):
    """All hypotheses on the rows of a window."""

    two_shapes: list[Table]
    one_shape: Table
    # levels are off by factors: the second power is a multiple of the first, or has a shape of its own as well
    factors: list[Table]
    factors_with_shape: Table
    alternating: list[Table]
    any_power: Floats  # of a single power of any value, the same as `Table.limit`


@lru_cache(maxsize=48)
def hypotheses_of(sizes: tuple[float, ...], promise: Promise | None) -> Hypotheses:
    """Return the hypotheses for levels of these sizes; windows of ladders of one ratio share them."""
    relative = np.array(sizes)
    of_any_sign, terms = two_powers((1.0,), promise), two_powers((1.0, -1.0), promise)
    return Hypotheses(
        _two_shapes(relative, of_any_sign),
        _one_shape(relative, of_any_sign),
        [_off_by_factors(relative, terms, jitter) for jitter in priors.JITTERS],
        _off_by_factors(relative, terms, priors.JITTER_OF_SHAPES, own_shape=True),
        _two_shapes(relative, pure(priors.POWERS), alternating=True),
        _limit_of_any_power(relative),
    )


def _limit_of_any_power(sizes: Floats) -> Floats:
    """Return `Hypotheses.any_power`, read off closely spaced powers."""
    powers = np.arange(priors.BIN, priors.HIGHEST + priors.AROUND[-1], priors.BIN)
    errors = on_arrays.power(sizes, powers[:, None])
    c = between(errors)
    covariance = outer(c, c) + noise_of_rows((priors.MISFIT * errors) ** 2)
    _, log_det = inverse(covariance)
    largest = np.max(c.shape[-1] * on_arrays.log(covariance[:, -1, -1]) - log_det)
    prior = priors.OTHER_PRIOR / priors.HIGHEST * np.sum(np.gradient(priors.AROUND))
    return np.array([on_arrays.log(2.0 * prior) + 0.5 * n * largest for n in (1, 2)])
