"""Tables of all hypotheses about the rows of a window: their covariances, priors and estimates."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from vibsim.convergence.error_model import priors
from vibsim.convergence.error_model.matrices import (
    form,
    inverse,
    level_differences,
    matvec,
    noise_of_rows,
    outer,
)
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.elementary import on_arrays

SHARES_PER_GROUP = 5
"""Number of successive shares of the second power that one bound covers."""


@dataclass(frozen=True)
class Terms:
    """Hypotheses about the powers of an expansion; arrays of shape (hypothesis,).

    With a logarithm the second term is h^p (1 + log h), h relative to the finest level of the window, and q is p.
    """

    lower: Floats  # p
    higher: Floats  # q; equal to p if there is no second power
    share: Floats  # signed size of the second power relative to the first, at the finest level of the window
    log_prior: Floats
    has_logarithm: Flags

    @property
    def first_of_pairs(self) -> Integers:
        """Index of the first hypothesis of each pair of powers."""
        differs = (np.diff(self.lower) != 0.0) | (np.diff(self.higher) != 0.0)
        return np.flatnonzero(np.concatenate([[True], differs]))


@dataclass(frozen=True)
class Table:
    """Hypotheses about the w rows of a window, laid out for `kernel`.

    Up to a factor common to all hypotheses on w rows, the evidence of rows with N points is
    ``(root/tr(K^-1 G))^(N w/2)`` with ``root = (prior/det(K)^(N/2))^(2/(N w))``. For one shape see `_table`.
    """

    # Forms of the precision K^-1 and of the squares of the estimated first power, second power and limit (without the
    # differences finer than the window); shape (hypothesis, 4, packed).
    forms: Floats
    # Root for N = 1 and N = 2; posterior variances of the first power, the second power and the limit, in units of the
    # squared scale; limit minus finest level as weights of the rows; shape (hypothesis, 5 + w).
    columns: Floats
    pair: Integers  # index of the pair of powers, shape (hypothesis,)
    groups: Integers  # start of each group, and the end of the last one, shape (group + 1,)
    # The evidence of a group is at most ``(root/tr(M G))^(N w/2)``: roots for N = 1, 2, form of M; (2 + packed, group).
    bounds: Floats
    # Upper bound of the log evidence of the table for N = 1 and N = 2, if the last row has the square 1.
    log_bound: Floats
    # For one shape: form of the precision of the components orthogonal to the last row, divided by `TAIL`.
    orthogonal_forms: Floats | None = None
    # Lower bound of these forms in each group, as weights of the squared norms, shape (group, w - 1).
    orthogonal_bounds: Floats | None = None


class ExpectedOrder(NamedTuple):
    """The order that a user expects or that theory promises."""

    order: float
    by_theory: bool = False  # theory, not a user, expects it: that restricts other powers


@lru_cache
def two_powers(signs: tuple[float, ...], expected: ExpectedOrder | None) -> Terms:
    """Return the hypotheses about powers: each of `POWERS` alone, and with each second power."""
    order, by_theory = expected or (math.nan, False)
    powers = sorted({*priors.POWERS, *(p for p in [order] if 0.0 < p < math.inf)})
    # a user may expect a fractional order, but few methods have one
    own_prior = priors.THEORY_PRIOR if by_theory else priors.EXPECTED_PRIOR * (order % 1.0 == 0.0)
    own_prior *= order in powers

    def relative_prior(p: float) -> float:
        return priors.FRACTIONAL_FACTOR if by_theory and (p - order) % 1.0 else 1.0

    total, entries = sum(map(relative_prior, powers)), []
    for p in powers:
        prior = (1.0 - own_prior) * relative_prior(p) / total + own_prior * (p == order)
        prior *= 1.0 - priors.ANY_POWER_PRIOR
        entries.append((p, p, 0.0, prior * priors.PURE_PRIOR, 0.0))
        second_prior = prior * (1.0 - priors.PURE_PRIOR) / len(signs)
        seconds = {q: relative_prior(order + q - p) for q in _second_powers(p)}
        pair_prior = second_prior / sum(seconds.values()) / len(priors.SHARES)
        entries += [
            (p, q, sign * share, pair_prior * seconds[q], 0.0)
            for q, share, sign in product(seconds, priors.SHARES, signs)
        ]
        second_prior *= priors.LOGARITHM_PRIOR * (priors.FRACTIONAL_FACTOR if by_theory else 1.0)
        entries += [
            (p, p, sign * share, second_prior / len(priors.LOGARITHM_SHARES), 1.0)
            for share, sign in product(priors.LOGARITHM_SHARES, signs)
        ]
    lower, higher, share, prior, has_logarithm = np.array(entries).T
    return Terms(lower, higher, share, on_arrays.log(prior), has_logarithm > 0.0)


def _second_powers(p: float) -> list[float]:
    """Return the powers that may stand beside a first power p.

    A power of a singularity, such as 4/3, stands beside twice itself, and beside the whole powers of what is smooth.
    """
    usual = [p + distance for distance in priors.DISTANCES]
    if 2.0 * p % 1.0 == 0.0:
        return usual
    return sorted({*usual, 2.0 * p, math.floor(p) + 1.0, math.floor(p) + 2.0})


def single_powers(powers: tuple[float, ...]) -> Terms:
    """Return one hypothesis for each power, with equal priors."""
    p = np.array(powers)
    none = np.zeros(len(p))
    return Terms(p, p, none, np.full(len(p), -on_arrays.log(len(p))), none > 0.0)


def _level_errors(terms: Terms, sizes: Floats) -> tuple[Floats, Floats, Floats]:
    """Return both powers of the step sizes, and the expected square of the error, each of shape (hypothesis, level).

    Step sizes are relative to the finest level of the window.
    """
    first = on_arrays.power(sizes, terms.lower[:, None])
    second = np.where(
        terms.share[:, None] == 0.0, 0.0, on_arrays.power(sizes, terms.higher[:, None])
    )
    logarithm = on_arrays.log(np.where(sizes > 0.0, sizes, 1.0))
    second *= 1.0 + np.where(terms.has_logarithm[:, None], logarithm, 0.0)
    return first, second, first**2 + (terms.share[:, None] * second) ** 2


def _table(
    terms: Terms,
    signal: Floats,
    variance: Floats,
    c: tuple[Floats, Floats],
    variances: tuple[Floats, Floats, Floats],
    orthogonal: Floats | None = None,
) -> Table:
    """Return the table of these hypotheses.

    Parameters
    ----------
    signal
        Covariance of the rows due to both powers, shape (hypothesis, row, row).
    variance
        Noise variance of each level, shape (hypothesis, level).
    c
        Coefficients c_k(p) and c_k(q) of the two powers, each of shape (hypothesis, row).
    variances
        Variance of the first power, covariance of both, variance of the second, each of shape (hypothesis,).
    orthogonal
        For one shape: covariance of the components orthogonal to the last row, shape (hypothesis, w - 1, w - 1).
    """
    precision, log_det = inverse(signal + noise_of_rows(variance))
    finest = np.flatnonzero(variance[0])[-1]
    finest_noise = variance[:, finest]
    w = precision.shape[-1]
    var_first, cov, var_second = (x[:, None] for x in variances)
    rows = (var_first * c[0] + cov * c[1], cov * c[0] + var_second * c[1])
    gains = [matvec(precision, row) for row in rows]
    left = [
        np.maximum(x - np.sum(gain * row, axis=-1), 0.0)
        for x, gain, row in zip(variances[::2], gains, rows, strict=True)
    ]
    # the finest level differs from the limit by both powers and by its noise
    to_limit = rows[0] + rows[1]
    to_limit[:, finest - 1] -= finest_noise
    limit = -matvec(precision, to_limit)
    limit_variance = variances[0] + 2.0 * variances[1] + variances[2] + finest_noise
    limit_left = np.maximum(limit_variance + np.sum(limit * to_limit, axis=-1), 0.0)
    squares = [outer(g, g) for g in (*gains, limit)]
    forms = np.stack([form(x) for x in (precision, *squares)], axis=1)
    t_precision, t_log_det = (None, 0.0) if orthogonal is None else inverse(orthogonal)
    # for one shape, one dimension is parallel to the last row, and all others are orthogonal to it
    dimensions = [(n, n if orthogonal is None else 1) for n in (1, 2)]
    roots = np.stack(
        [
            on_arrays.exp((2.0 / d * terms.log_prior - log_det - (n - d) * t_log_det) / w)
            for n, d in dimensions
        ]
    )
    columns = np.stack([*roots, *left, limit_left, *limit.T], axis=1)
    pair = np.searchsorted(terms.first_of_pairs, np.arange(len(terms.lower)), side="right") - 1
    groups = _groups(pair, terms.share)
    exponents = np.array([[0.5 * d * w] for _, d in dimensions])
    bounds = _bounds(
        groups, terms.share, variance, c, roots, exponents, 1.0 if orthogonal is None else 2.0
    )
    # tr(K^-1 G) is at least the square of the last row over its variance
    last = signal[:, -1, -1] + np.sum(variance[:, -2:], axis=-1)
    log_bound = on_arrays.log(np.sum(on_arrays.power(roots * last, exponents), axis=1))
    table = Table(np.ascontiguousarray(forms), columns, pair, groups, bounds, log_bound)
    if orthogonal is None or t_precision is None:
        return table
    # w - 1 times its diagonal exceeds a covariance of w - 1 rows
    diagonal = np.diagonal(orthogonal, axis1=1, axis2=2) * (w - 1)
    return replace(
        table,
        orthogonal_forms=np.ascontiguousarray(form(t_precision)),
        orthogonal_bounds=1.0 / np.maximum.reduceat(diagonal, groups[:-1], axis=0),
    )


def _groups(pair: Integers, share: Floats) -> Integers:
    """Return `Table.groups`: a group has one pair of powers and up to `SHARES_PER_GROUP` successive shares."""
    size = np.abs(share)
    changes = np.concatenate([[True], (np.diff(size) != 0.0) | (np.diff(pair) != 0)])
    share_index = np.cumsum(changes) - 1
    first = np.concatenate([[True], np.diff(pair) != 0])
    within = share_index - np.maximum.accumulate(np.where(first, share_index, 0))
    return np.append(np.flatnonzero(changes & (within % SHARES_PER_GROUP == 0)), len(pair))


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

    If C exceeds ``K/t`` for all hypotheses of a group, ``tr(K^-1 G) >= tr(C^-1 G)/t``. Here ``t = 1 + share^2``, and C
    is built from the largest variances over t in the group. Correlation enlarges the signal by at most `factor`.
    """
    start, t = groups[:-1], 1.0 + share**2
    squares = [np.maximum.reduceat(square / t, start) for square in (np.ones_like(t), share**2)]
    signal = sum(
        factor * square[:, None, None] * outer(row[start], row[start])
        for square, row in zip(squares, c, strict=True)
    )
    noise = noise_of_rows(np.maximum.reduceat(variance / t[:, None], start, axis=0))
    precision, _ = inverse(signal + noise)
    root = np.add.reduceat(on_arrays.power(roots * t, exponents), start, axis=1)
    root = on_arrays.power(root, 1.0 / exponents)
    return np.ascontiguousarray(np.concatenate([root, form(precision).T]))


def _independent(
    terms: Terms, c: tuple[Floats, Floats]
) -> tuple[Floats, tuple[Floats, Floats, Floats]]:
    """Return `signal` and `variances` of `_table` for two powers with uncorrelated coefficients."""
    square = terms.share**2
    signal = outer(c[0], c[0]) + square[:, None, None] * outer(c[1], c[1])
    return signal, (np.ones_like(square), np.zeros_like(square), square)


def _two_shapes(sizes: Floats, terms: Terms, *, alternating: bool = False) -> list[Table]:
    """Return the tables of two shapes for levels of these step sizes, one for each of `FINEST_NOISE`."""
    first, second, squares = _level_errors(terms, sizes)
    if alternating:
        first, second = (x * (-1.0) ** np.arange(len(sizes)) for x in (first, second))
    c = level_differences(first), level_differences(second)
    signal, variances = _independent(terms, c)
    finest = np.flatnonzero(sizes)[-1]
    tables = []
    for noise in priors.FINEST_NOISE:
        misfit = np.full(len(sizes), priors.MISFIT**2)
        misfit[finest] += noise**2
        tables.append(_table(terms, signal, squares * misfit, c, variances))
    return tables


def _off_by_factors(
    sizes: Floats, terms: Terms, jitter: float, *, own_shape: bool = False
) -> Table:
    """Return the table of levels whose errors are each off by a factor, with standard deviation `jitter` around 1.

    The second power is a multiple of the first; with `own_shape` it also has an equally large part of another shape.
    """
    first, second, squares = _level_errors(terms, sizes)
    powers = level_differences(first), level_differences(second)
    c = powers[0] + terms.share[:, None] * powers[1]
    ratio, covariance = _orthogonal_to_last(c, squares)
    if own_shape:
        own_part = terms.share[:, None] * (powers[1][:, :-1] - ratio * powers[1][:, -1:])
        covariance = covariance + outer(own_part, own_part)
    orthogonal = priors.TAIL * covariance / c[:, -1, None, None] ** 2
    ones = np.ones_like(terms.share)
    variances = ones, terms.share, terms.share**2
    return _table(terms, outer(c, c), jitter**2 * squares, powers, variances, orthogonal)


def _one_shape(sizes: Floats, terms: Terms) -> Table:
    """Return the table of one shape: the second power is a multiple of the first, of random sign and size `share`."""
    first, second, squares = _level_errors(terms, sizes)
    c = level_differences(first), level_differences(second)
    signal, variances = _independent(terms, c)
    size = np.sqrt(c[0] ** 2 + variances[2][:, None] * c[1] ** 2)
    _, covariance = _orthogonal_to_last(size, squares)
    orthogonal = priors.TAIL * covariance / size[:, -1, None, None] ** 2
    return _table(terms, signal, priors.MISFIT**2 * squares, c, variances, orthogonal)


def _orthogonal_to_last(c: Floats, squares: Floats) -> tuple[Floats, Floats]:
    """Return the sizes of the other rows relative to the last one, and the covariance of their orthogonal components.

    If all rows have one shape and the sizes `c`, only the misfit makes such components.
    """
    noise = noise_of_rows(squares)
    ratio = c[:, :-1] / c[:, -1:]
    covariance = noise[:, :-1, :-1] + outer(ratio, ratio) * noise[:, -1:, -1:]
    mixed = outer(ratio, noise[:, -1, :-1])
    return ratio, priors.MISFIT**2 * (covariance - mixed - np.swapaxes(mixed, 1, 2))


class Hypotheses(NamedTuple):
    """All hypotheses about the rows of a window."""

    two_shapes: list[Table]  # for each of `FINEST_NOISE`
    one_shape: Table
    factors: list[Table]  # levels off by factors, for each of `JITTERS`
    factors_with_shape: Table  # the same, and the second power also has a shape of its own
    alternating: list[Table]  # for each of `FINEST_NOISE`
    any_power_log_bound: Floats  # `Table.log_bound` of a single power of any value

    def of_one_shape(self, points: Floats, log_prior: Floats) -> list[tuple[Table, Floats]]:
        """Return the tables of errors with one shape, with their log priors, for ladders of this log prior."""
        # numbers have no shape
        has_shape = points > 1.0
        own_shape = np.where(has_shape, priors.OWN_SHAPE_PRIOR, 0.0)
        with np.errstate(divide="ignore"):
            multiple, with_shape = (
                log_prior + on_arrays.log(priors.JITTER_PRIOR * x)
                for x in (1.0 - own_shape, own_shape)
            )
            one_shape = log_prior + on_arrays.log(priors.ONE_SHAPE_PRIOR * has_shape)
        by_jitter = zip(self.factors, priors.JITTER_PRIORS, strict=True)
        return [
            *((table, multiple + on_arrays.log(p)) for table, p in by_jitter),
            (self.factors_with_shape, with_shape),
            (self.one_shape, one_shape),
        ]


@lru_cache(maxsize=48)
def hypotheses_of(sizes: tuple[float, ...], expected: ExpectedOrder | None) -> Hypotheses:
    """Return the hypotheses for levels of these step sizes, relative to the finest one; 0 is the exact solution."""
    relative = np.array(sizes)
    unsigned, signed = two_powers((1.0,), expected), two_powers((1.0, -1.0), expected)
    return Hypotheses(
        _two_shapes(relative, unsigned),
        _one_shape(relative, unsigned),
        [_off_by_factors(relative, signed, jitter) for jitter in priors.JITTERS],
        _off_by_factors(relative, signed, priors.OWN_SHAPE_JITTER, own_shape=True),
        _two_shapes(relative, single_powers(priors.POWERS), alternating=True),
        _any_power_log_bound(relative),
    )


def _any_power_log_bound(sizes: Floats) -> Floats:
    """Return `Hypotheses.any_power_log_bound`, from closely spaced powers."""
    powers = np.arange(priors.SPACING, priors.MAX_POWER + priors.OFFSETS[-1], priors.SPACING)
    errors = on_arrays.power(sizes, powers[:, None])
    c = level_differences(errors)
    covariance = outer(c, c) + noise_of_rows((priors.MISFIT * errors) ** 2)
    _, log_det = inverse(covariance)
    largest = np.max(c.shape[-1] * on_arrays.log(covariance[:, -1, -1]) - log_det)
    prior = priors.ANY_POWER_PRIOR / priors.MAX_POWER * np.sum(np.gradient(priors.OFFSETS))
    return np.array([on_arrays.log(2.0 * prior) + 0.5 * n * largest for n in (1, 2)])
