"""What hypotheses on the error expect of the rows of a window of levels: their covariance, for all at once."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from vibsim.convergence.error_model import priors
from vibsim.core.array_types import Floats, Integers


@dataclass(frozen=True)
class Terms:
    """Hypotheses on the powers of an expansion; arrays of shape (hypothesis,)."""

    lower: Floats  # p
    higher: Floats  # q; p where there is none
    share: Floats  # size of the second power over the first at the finest level of the window, with its sign
    log_prior: Floats

    @cached_property
    def starts(self) -> Integers:
        """First hypothesis of every pair of powers."""
        new = (np.diff(self.lower) != 0.0) | (np.diff(self.higher) != 0.0)
        return np.flatnonzero(np.concatenate([[True], new]))


@dataclass(frozen=True)
class Window:
    """What hypotheses say about the w rows of a window; arrays of shape (hypothesis, ...)."""

    terms: Terms
    precision: Floats  # K^-1, shape (hypothesis, w, w)
    log_det: Floats  # log det K
    gains: Floats  # the first and second power, from the rows, shape (hypothesis, 2, w)
    left: Floats  # their covariance that the rows leave, over the scale, shape (hypothesis, 2, 2)
    # of one shape: precision and log determinant of what the rows but the last are off the last one
    across: tuple[Floats, Floats] | None = None


@lru_cache
def two_powers(signs: tuple[float, ...], promised: float | None) -> Terms:
    """Return the hypotheses on the powers: one of `POWERS` with or without a second one."""
    rows = []
    usual = sorted({*priors.POWERS, *(p for p in [promised] if p and 0.0 < p < math.inf)})
    of_promise = priors.PROMISE if promised in usual else 0.0
    seconds = list(product(priors.DISTANCES, priors.SHARES, signs))
    for p in usual:
        prior = (1.0 - of_promise) / len(usual) + of_promise * (p == promised)
        prior *= 1.0 - priors.OTHER_PRIOR
        rows.append((p, p, 0.0, prior * priors.PURE_PRIOR))
        each = prior * (1.0 - priors.PURE_PRIOR) / len(seconds)
        rows += [(p, p + distance, sign * share, each) for distance, share, sign in seconds]
    lower, higher, share, prior = np.array(rows).T
    return Terms(lower, higher, share, np.log(prior))


def levels_to_rows(count: int) -> Floats:
    """Return the matrix that makes differences of the values of the levels."""
    return np.eye(count - 1, count) - np.eye(count - 1, count, 1)


def _errors(terms: Terms, sizes: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the error of each level by the first power, the second, and the square of both; (hypothesis, level).

    Sizes are over that of the finest level of the window; the share is that at the same level.
    """
    first = sizes ** terms.lower[:, None]
    second = np.where(terms.share[:, None] == 0.0, 0.0, sizes ** terms.higher[:, None])
    return first, second, first**2 + (terms.share[:, None] * second) ** 2


def inverse(covariance: Floats) -> tuple[Floats, Floats]:
    """Return inverse and log determinant of covariances, scaled so that sizes of rows do not matter."""
    scale = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    both = scale[..., :, None] * scale[..., None, :]
    scaled = covariance / both
    return np.linalg.inv(scaled) / both, np.linalg.slogdet(scaled)[1] + 2.0 * np.sum(
        np.log(scale), axis=-1
    )


def _window(
    sizes: Floats, terms: Terms, *, alternating: bool = False
) -> Iterator[tuple[int, Window]]:
    """Yield position in `FINEST_NOISE` and the hypotheses of two shapes on the rows between levels of these sizes."""
    rows, prior = levels_to_rows(len(sizes)), _size_of_powers(terms)
    first, second, squares = _errors(terms, sizes)
    if alternating:
        first, second = (x * (-1.0) ** np.arange(len(sizes)) for x in (first, second))
    c = np.stack([first @ rows.T, second @ rows.T], axis=-1)
    signal = c @ prior @ np.swapaxes(c, -1, -2)
    finest = np.flatnonzero(sizes)[-1]
    for i, noise in enumerate(priors.FINEST_NOISE):
        share = np.full(len(sizes), priors.MISFIT**2)
        share[finest] += noise**2
        precision, log_det = inverse(signal + (rows * (squares * share)[:, None]) @ rows.T)
        yield i, _with_gains(terms, precision, log_det, c, prior)


def _size_of_powers(terms: Terms) -> Floats:
    """Return the prior covariance of unrelated A and B over the square of the size of A, shape (hypothesis, 2, 2)."""
    prior = np.zeros((len(terms.share), 2, 2))
    prior[:, 0, 0], prior[:, 1, 1] = 1.0, terms.share**2
    return prior


def _with_gains(
    terms: Terms,
    precision: Floats,
    log_det: Floats,
    c: Floats,
    prior: Floats,
    across: tuple[Floats, Floats] | None = None,
) -> Window:
    gains = prior @ np.swapaxes(c, -1, -2) @ precision
    left = prior - gains @ c @ prior
    return Window(terms, precision, log_det, gains, left, across)


def _one_shape(sizes: Floats, terms: Terms) -> Iterator[tuple[float, Window]]:
    """Yield the log prior and the hypotheses of one shape, whose sizes are off by chance, for each of `JITTERS`."""
    rows = levels_to_rows(len(sizes))
    first, second, squares = _errors(terms, sizes)
    share = terms.share[:, None]
    c = (first + share * second) @ rows.T
    both = np.stack([np.ones_like(terms.share), terms.share], axis=-1)[:, :, None]
    prior = both @ np.swapaxes(both, -1, -2)
    powers = np.stack([first @ rows.T, second @ rows.T], axis=-1)
    noise = (rows * squares[:, None]) @ rows.T
    # what the other rows are off a multiple of the last one
    last = c[:, -1]
    off = np.zeros((len(c), len(rows) - 1, len(rows)))
    off[:, np.arange(len(rows) - 1), np.arange(len(rows) - 1)] = 1.0
    off[:, :, -1] = -c[:, :-1] / last[:, None]
    beside = off @ noise @ np.swapaxes(off, -1, -2) * (priors.MISFIT / last[:, None, None]) ** 2
    across = inverse(beside)
    signal = c[:, :, None] * c[:, None, :]
    for jitter, chance in zip(priors.JITTERS, priors.JITTER_PRIORS, strict=True):
        precision, log_det = inverse(signal + jitter**2 * noise)
        yield (
            math.log(priors.ONE_SHAPE_PRIOR * chance),
            _with_gains(terms, precision, log_det, powers, prior, across),
        )


class Hypotheses(NamedTuple):
    """All hypotheses on the rows of a window."""

    two_shapes: list[tuple[int, Window]]
    one_shape: list[tuple[float, Window]]
    alternating: list[tuple[int, Window]]


@lru_cache(maxsize=24)
def hypotheses_of(sizes: tuple[float, ...], promised: float | None) -> Hypotheses:
    """Return the hypotheses for levels of these sizes; windows of ladders of one ratio share them."""
    relative = np.array(sizes)
    return Hypotheses(
        list(_window(relative, two_powers((1.0,), promised))),
        list(_one_shape(relative, two_powers((1.0, -1.0), promised))),
        list(_window(relative, _pure(priors.POWERS), alternating=True)),
    )


def _pure(powers: tuple[float, ...]) -> Terms:
    """Return the hypotheses of one power."""
    p = np.array(powers)
    return Terms(p, p, np.zeros(len(p)), np.full(len(p), -math.log(len(p))))
