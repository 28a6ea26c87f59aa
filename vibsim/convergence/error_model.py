r"""The error model: what the differences of a ladder of levels say about its order, its limit and its error.

Levels with step sizes ``h_0 > h_1 > ... > h_L`` have the values ``u_k = u* + A h_k^p + B h_k^q + n_k`` on common points
of time or space, with unknown functions A and B and the noise n_k of level k. The *rows* are the differences
``d_k = u_k - u_(k+1)`` and, where the exact solution u is known, ``u_L - u``, which is the difference to a level of the
size 0. So a power p has the coefficient ``c_k(p) = h_k^p - h_(k+1)^p`` in row k, whatever the sizes are.

A *hypothesis* says which powers there are, how large the second one is, over which *window* of levels this holds, and
how levels deviate from it. Its functions A and B are Gaussian, with a few independent points (`POINTS`) and of any
size. They integrate out, and the rows X have the evidence

    log p(X) = log(1/2) + log Gamma(n/2) - n/2 log(pi tr(K^-1 G)) - N/2 log det K,   n = N w,

for w rows and N independent points, with the Gram matrix ``G_kl = <d_k, d_l>`` of the rows and the covariance K that
the hypothesis gives them. G is all that is read of the data. Three kinds of hypotheses compete:

- *two shapes*: A and B are unrelated. ``K = c(p) c(p)^T + s^2 c(q) c(q)^T + noise``;
- *one shape*: B is a multiple of A, and the error of every level is off by a factor of its own (`JITTERS`), as where
  events fall between grid points. K is one-dimensional, and the rows are parallel but for a small part (`MISFIT`);
- *no expansion*: every row has a size of its own, from the first to one behind which all rows are noise.

Rows before a window are coarse levels that the expansion does not reach: each has a size of its own, for the price
`PRICE`. Rows behind it are noise that grows as the steps shrink; noise as large as its prediction costs nothing more.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from vibsim.convergence.differences import order_of_ratio, safe_ratio
from vibsim.core.array_types import Flags, Floats, Integers

# Every number of the model. Their origin: [expansion] follows from expansions of errors; [arithmetic] from
# double precision; [chosen] is a prior that was written down; [calibrated] was set on seeds 1 and 3 of
# tests/analysis/synthetic.py, where no result depends on a factor of two in them.
POINTS = 2.0  # independent points of a series or field; a single number has one [calibrated]
POWERS = (*(0.5 * k for k in range(1, 11)), 6.0, 7.0, 8.0)  # that expansions have [expansion]
HIGHEST = 8.0  # power that is looked for [chosen]
BIN = 0.05  # distance of the powers among which such a power is counted [chosen]
OTHER_PRIOR = 0.1  # of a single power of any other value up to `HIGHEST` [chosen]
# It is looked for at these distances from the measured order. [chosen]
AROUND = np.array(
    [s * 3e-4 * 2.0**k for s, ks in ((-1, range(8, -1, -1)), (0, (0,)), (1, range(9))) for k in ks]
)
PROMISE = 0.5  # prior of the order that is promised, beside that of every power [chosen]
DISTANCES = (0.5, 1.0, 2.0)  # from the first power to the second [expansion]
PURE_PRIOR = 0.3  # that there is no second power in sight [chosen]
# Size of the second power over the first, at the finest level of a window. [chosen]
SHARES = tuple(10.0 ** (-4.25 + 0.5 * k) for k in range(15))
MISFIT = 3e-4  # of a level from its expansion, over its error [calibrated]
JITTERS, JITTER_PRIORS = (5e-3, 0.1), (0.7, 0.3)  # of errors of one shape [calibrated]
ONE_SHAPE_PRIOR = 0.1  # of ladders of one shape [calibrated]
FINEST_NOISE = (0.0, 0.1)  # noise of the finest level of a window, over its error [chosen]
UNEXPECTED = 0.03  # prior of noise that nothing predicts [chosen]
PREDICTION = 10.0  # noise is predicted within this factor [arithmetic]
GROWTHS = (0.0, 0.5, 1.0, 1.5)  # of round-off: N to this power [arithmetic]
COHERENCES = (3e-4, 3e-3, 3e-2, 0.3, 1.0)  # of a row that nothing is known of [chosen]
PRICE = 2.0  # of a row with a size of its own: log of the range that sizes may have [calibrated]
ALTERNATING = 0.02  # prior of errors that change their sign at every level [chosen]
ELSEWHERE = 0.02  # prior of a limit that is not the exact solution [chosen]
LONGEST_WINDOW = 5  # rows: more add nothing [chosen]
DOMINATES = 0.1  # a power dominates where no other one has more than this part of it [chosen]
TINY = 1e-300
LOG_GAMMA = np.array([math.inf, *(math.lgamma(0.5 * n) for n in range(1, 200))])  # of n/2
UNTHINKABLE = -1e6  # log evidence


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


@dataclass(frozen=True)
class Ladder:
    """The numbers of ladders that the model reads; n levels, m rows."""

    h: Floats  # step sizes, decreasing, shape (n,)
    # inner products (means over the points) of the n-1 differences and, where the exact solution is known, of the
    # finest level less that, shape (ladder, m, m)
    gram: Floats
    floor: Floats  # predicted noise of every level in the same norm, shape (ladder, n)
    numbers: Flags  # whether the values are single numbers, shape (ladder,)
    exact_known: bool

    @property
    def points(self) -> Floats:
        """Independent points, shape (ladder,)."""
        return np.where(self.numbers, 1.0, POINTS)


@dataclass
class Posterior:
    """What is believed of ladders: probabilities, of shape (ladder,) where no other is given."""

    powers: Floats  # the powers that are looked at, increasing, shape (power,)
    windows: list[tuple[int, int]]  # coarsest and finest level
    alone: Floats  # that this power dominates, shape (ladder, power)
    lowest: Floats  # that this is the lowest power of weight, shape (ladder, power)
    highest: Floats  # that this is the highest one, shape (ladder, power)
    window: Floats  # that the expansion holds in this window, shape (ladder, window)
    alternating: Floats  # that errors change their sign from level to level
    scattered: Floats  # that there is no expansion, and no noise either
    noise: Floats  # that all but some coarse levels are noise
    elsewhere: (
        Floats  # that the limit is another one than the exact solution; 0 where that is not known
    )
    # the limit less the finest level: the mean of its expression in the differences, shape (ladder, row), and its mean
    # square; given the expansion, and where the exact solution is not known
    path: Floats
    path_squared: Floats

    @property
    def expansion(self) -> Floats:
        """Return the probability of an expansion in one or two powers."""
        return np.asarray(np.sum(self.window, axis=-1))

    @property
    def mixed(self) -> Floats:
        """Return the probability that two powers are of one size."""
        return np.asarray(self.expansion - np.sum(self.alone, axis=-1))


@lru_cache
def two_powers(signs: tuple[float, ...], promised: float | None) -> Terms:
    """Return the hypotheses on the powers: one of `POWERS` with or without a second one."""
    rows = []
    usual = sorted({*POWERS} | ({promised} if promised and math.isfinite(promised) else set()))
    for p in usual:
        prior = (1.0 - OTHER_PRIOR) / len(usual)
        if promised in usual:
            prior = (1.0 - PROMISE) * prior + PROMISE * (p == promised) * (1.0 - OTHER_PRIOR)
        rows.append((p, p, 0.0, prior * PURE_PRIOR))
        each = prior * (1.0 - PURE_PRIOR) / (len(DISTANCES) * len(SHARES) * len(signs))
        rows += [(p, p + d, sign * s, each) for d in DISTANCES for s in SHARES for sign in signs]
    lower, higher, share, prior = np.array(rows).T
    return Terms(lower, higher, share, np.log(prior))


def _levels_to_rows(count: int) -> Floats:
    """Return the matrix that makes differences of the values of the levels."""
    return np.eye(count - 1, count) - np.eye(count - 1, count, 1)


def _errors(terms: Terms, sizes: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the error of each level by the first power, the second, and the square of both; (hypothesis, level).

    Sizes are over that of the finest level of the window; the share is that at the same level.
    """
    first = sizes ** terms.lower[:, None]
    second = np.where(terms.share[:, None] == 0.0, 0.0, sizes ** terms.higher[:, None])
    return first, second, first**2 + (terms.share[:, None] * second) ** 2


def _inverse(covariance: Floats) -> tuple[Floats, Floats]:
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
    rows, prior = _levels_to_rows(len(sizes)), _size_of_powers(terms)
    first, second, squares = _errors(terms, sizes)
    if alternating:
        first, second = (x * (-1.0) ** np.arange(len(sizes)) for x in (first, second))
    c = np.stack([first @ rows.T, second @ rows.T], axis=-1)
    signal = c @ prior @ np.swapaxes(c, -1, -2)
    finest = np.flatnonzero(sizes)[-1]
    for i, noise in enumerate(FINEST_NOISE):
        share = np.full(len(sizes), MISFIT**2)
        share[finest] += noise**2
        precision, log_det = _inverse(signal + (rows * (squares * share)[:, None]) @ rows.T)
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
    rows = _levels_to_rows(len(sizes))
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
    beside = off @ noise @ np.swapaxes(off, -1, -2) * (MISFIT / last[:, None, None]) ** 2
    across = _inverse(beside)
    signal = c[:, :, None] * c[:, None, :]
    for jitter, chance in zip(JITTERS, JITTER_PRIORS, strict=True):
        precision, log_det = _inverse(signal + jitter**2 * noise)
        yield (
            math.log(ONE_SHAPE_PRIOR * chance),
            _with_gains(terms, precision, log_det, powers, prior, across),
        )


class _Hypotheses(NamedTuple):
    """All hypotheses on the rows of a window."""

    two_shapes: list[tuple[int, Window]]
    one_shape: list[tuple[float, Window]]
    alternating: list[tuple[int, Window]]


@lru_cache(maxsize=64)
def _hypotheses(sizes: tuple[float, ...], promised: float | None) -> _Hypotheses:
    """Return the hypotheses for levels of these sizes; windows of ladders of one ratio share them."""
    relative = np.array(sizes)
    return _Hypotheses(
        list(_window(relative, two_powers((1.0,), promised))),
        list(_one_shape(relative, two_powers((1.0, -1.0), promised))),
        list(_window(relative, _pure(POWERS), alternating=True)),
    )


def _form(matrices: Floats, gram: Floats) -> Floats:
    """Return ``tr(M G)`` for every ladder and hypothesis, shape (ladder, hypothesis); never negative."""
    count, w = len(matrices), gram.shape[-1]
    return np.maximum(gram.reshape(len(gram), w * w) @ matrices.reshape(count, w * w).T, TINY)


def _square(gains: Floats, gram: Floats) -> Floats:
    """Return the mean square of what the gains make of the rows, shape (ladder, hypothesis)."""
    return _form(gains[:, :, None] * gains[:, None, :], gram)


def _scale_free(trace: Floats, log_det: Floats | float, points: Floats, rows: int) -> Floats:
    """Return the evidence of rows of any size; see the head of this module."""
    n = points * rows
    return np.asarray(
        math.log(0.5)
        + LOG_GAMMA[np.asarray(n, dtype=np.int64)]
        - 0.5 * n * np.log(np.pi * trace)
        - 0.5 * points * log_det
    )


def _evidence(window: Window, gram: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Return the log evidence of the rows of a window, and the square of their scale, shape (ladder, hypothesis)."""
    w, n = gram.shape[-1], points[:, None]
    if window.across is None:
        trace = _form(window.precision, gram)
        return _scale_free(trace, window.log_det, n, w), trace / w
    # one dimension along the last row, the others across it
    last = np.maximum(gram[:, -1, -1], TINY)[:, None]
    along = gram[:, -1, :, None] * gram[:, -1, None, :] / last[..., None]
    trace = _form(window.precision, along)
    log = _scale_free(trace, window.log_det, np.ones(1), w)
    # the last row has any direction
    log += math.log(2.0) + 0.5 * np.log(last) + _scale_free(last, 0.0, n, 1)
    precision, log_det = window.across
    rest = np.maximum(
        (gram - along)[:, :-1, :-1].reshape(len(gram), -1)
        @ precision.reshape(len(precision), -1).T,
        0.0,
    )
    log -= 0.5 * (n - 1.0) * ((w - 1) * np.log(2.0 * np.pi * last / n) + log_det)
    log -= np.where(n > 1.0, 0.5 * n * rest / last, 0.0)
    return log, trace / w


def _any_size(gram: Floats, points: Floats) -> Floats:
    """Return the evidence of every difference of which nothing is known but the next one, shape (ladder, row)."""
    own = np.diagonal(gram, axis1=1, axis2=2)
    across = own[:, :-1] - np.diagonal(gram, 1, 1, 2) ** 2 / own[:, 1:]
    n = points[:, None]
    found = []
    for part in COHERENCES:
        variance = part**2 * own[:, :-1] / n
        log = -0.5 * (n - 1.0) * np.log(2.0 * np.pi * variance) - 0.5 * np.log(own[:, :-1])
        found.append(log - np.where(n > 1.0, 0.5 * np.maximum(across, 0.0) / variance, 0.0))
    log = _log_mean(np.stack(found, axis=-1)) + math.log(0.5)
    return np.concatenate([log, _scale_free(own[:, -1:], 0.0, n, 1)], axis=-1)


def _log_mean(logs: Floats) -> Floats:
    """Return the log of the mean of exponentials over the last axis."""
    largest = np.max(logs, axis=-1, keepdims=True)
    return np.asarray(
        (largest + np.log(np.mean(np.exp(logs - largest), axis=-1, keepdims=True)))[..., 0]
    )


def _noise(sizes: Floats, gram: Floats, points: Floats, floor: Floats) -> Floats:
    """Return the evidence that the differences between these levels are noise, shape (ladder,).

    Noise of the predicted size, within `PREDICTION`, is expected; other noise costs a price.
    """
    count = gram.shape[-1]
    if not count:
        return np.zeros(len(gram))
    # the exact solution, if it is known, is a level more, which has no noise
    rows = _levels_to_rows(count + 1)
    found = []
    for growth in GROWTHS:
        noise = np.zeros(count + 1)
        noise[: len(sizes)] = (sizes / sizes[-1]) ** (-2.0 * growth)
        precision, log_det = _inverse((rows * noise) @ rows.T)
        trace = _form(precision[None], gram)[:, 0]
        decades = np.log10(
            np.sqrt(trace / len(rows)) / np.maximum(floor[:, -1], TINY)
        ) / math.log10(PREDICTION)
        expected = -0.5 * decades**2 - math.log(math.sqrt(2.0 * np.pi) * math.log(PREDICTION))
        size = np.logaddexp(expected, math.log(UNEXPECTED) - PRICE)
        found.append(_scale_free(trace, log_det, points, len(rows)) + size)
    return _log_mean(np.stack(found, axis=-1))


def _noise_of_finest(floor: Floats, last: Floats) -> tuple[Floats, Floats]:
    """Return the log prior of the two of `FINEST_NOISE`, shape (ladder,).

    A window does not end with a difference that is predicted to be noise.
    """
    share = floor / np.sqrt(np.maximum(last, TINY))
    noisy = np.clip(share / (0.3 * FINEST_NOISE[1]), UNEXPECTED, 0.999)
    drowned = np.where(share > 1.0, -20.0, 0.0)
    return np.log(1.0 - noisy) + drowned, np.log(noisy) + drowned


def local_orders(ladder: Ladder) -> Floats:
    """Return the order of every three successive levels, shape (ladder, n-2); NaN where there is none.

    It solves ``(h_0^p - h_1^p)/(h_1^p - h_2^p) = d_0/d_1``. Differences that turn their sign have none.
    """
    n = len(ladder.h)
    sizes = np.sqrt(np.diagonal(ladder.gram, axis1=1, axis2=2))[:, : n - 1]
    exponents = -np.log2(ladder.h)
    found = []
    for i in range(n - 2):
        same = ladder.gram[:, i, i + 1] > 0.0
        ratio = np.where(same, safe_ratio(sizes[:, i], sizes[:, i + 1]), np.nan)
        found.append(order_of_ratio(ratio, list(exponents[i : i + 3])))
    return np.stack(found, axis=-1)


class _Sums:
    """Sums over hypotheses, scaled by the largest evidence so far."""

    def __init__(self, ladders: int) -> None:
        self.top = np.full(ladders, -np.inf)
        self.values: dict[str, Floats] = {}

    def add(self, log: Floats) -> Floats:
        """Return the weights of hypotheses, shape (ladder, hypothesis), and scale down what was summed before."""
        top = np.maximum(self.top, np.max(log, axis=-1))
        factor = np.exp(self.top - top)
        for name, value in self.values.items():
            self.values[name] = value * factor.reshape(-1, *[1] * (value.ndim - 1))
        self.top = top
        return np.asarray(np.exp(log - top[:, None]))

    def put(self, name: str, value: Floats) -> None:
        self.values[name] = self.values[name] + value if name in self.values else value


class _Fit:
    """The posterior in the making: hypotheses are added window by window."""

    def __init__(self, ladder: Ladder, promised: float | None) -> None:
        self.ladder, self.points, self.promised = ladder, ladder.points, promised
        terms = two_powers((1.0,), promised)
        usual = np.concatenate([terms.lower, terms.higher])
        self.powers = np.unique(np.concatenate([usual, np.arange(BIN, HIGHEST, BIN)]))
        self.orders = local_orders(ladder)
        n = len(ladder.h)
        self.windows = [
            (last - rows, last)
            for last in range(2, n)
            for rows in range(2, min(LONGEST_WINDOW, last) + 1)
        ]
        # rounding is part of every row
        self.rounding = 0.1 * ladder.floor**2
        self.differences = self.rows(0, n - 1)
        self.alone_rows = _any_size(self.differences, self.points) - PRICE
        self.sums = _Sums(len(ladder.gram))

    def add_window(self, index: int) -> None:
        """Add the hypotheses that the expansion holds between two levels."""
        start, end = self.windows[index]
        ladder = self.ladder
        rest = np.sum(self.alone_rows[:, :start], axis=-1)
        rest += _noise(
            ladder.h[end:], self.differences[:, end:, end:], self.points, ladder.floor[:, end:]
        )
        smallest = self.differences[:, end - 1, end - 1]
        if ladder.exact_known:
            smallest = np.minimum(smallest, self.rows(end, end, with_exact=True)[:, 0, 0])
        noisy = _noise_of_finest(ladder.floor[:, end], smallest)
        sizes = ladder.h[start : end + 1] / ladder.h[end]
        inside = self.rows(start, end)
        relative = sizes
        of_window = _hypotheses(tuple(sizes), self.promised)
        if ladder.exact_known:
            apart = rest + self.error_of(end) + math.log(ELSEWHERE)
            for i, window in of_window.two_shapes:
                log, _ = _evidence(window, inside, self.points)
                weights = self.sums.add(log + window.terms.log_prior + (apart + noisy[i])[:, None])
                self.sums.put("elsewhere", np.sum(weights, axis=-1))
            inside = self.rows(start, end, with_exact=True)
            relative = np.append(sizes, 0.0)
            of_window = _hypotheses(tuple(relative), self.promised)
        self.add_any_power(index, relative, inside, rest + noisy[0])
        for i, window in of_window.two_shapes:
            self.add_hypotheses(index, window, inside, (rest + noisy[i])[:, None])
        for log_prior, window in of_window.one_shape:
            self.add_hypotheses(index, window, inside, (rest + noisy[0] + log_prior)[:, None])
        for i, window in of_window.alternating:
            log, _ = _evidence(window, inside, self.points)
            log += window.terms.log_prior + (rest + noisy[i])[:, None] + math.log(ALTERNATING)
            self.sums.put("alternating", np.sum(self.sums.add(log), axis=-1))

    def rows(self, start: int, end: int, *, with_exact: bool = False) -> Floats:
        """Return the Gram matrix of the differences between two levels, and of the true error of the second one."""
        picked = np.zeros((end - start + with_exact, self.ladder.gram.shape[-1]))
        picked[np.arange(end - start), np.arange(start, end)] = 1.0
        if with_exact:
            picked[-1, end:] = 1.0
        levels = _levels_to_rows(end - start + 2)[: len(picked), : end - start + 1]
        noise = (levels * self.rounding[:, None, start : end + 1]) @ levels.T
        return np.asarray(picked @ self.ladder.gram @ picked.T + noise)

    def error_of(self, level: int) -> Floats:
        """Return the evidence of the true error of a level, if that may have any size."""
        squared = self.rows(level, level, with_exact=True)[:, 0, 0]
        return _scale_free(np.maximum(squared, TINY), 0.0, self.points, 1) - PRICE

    def add_hypotheses(self, index: int, window: Window, inside: Floats, rest: Floats) -> None:
        """Add hypotheses on the rows of a window, with the evidence of all other rows."""
        terms, ladder, put = window.terms, self.ladder, self.sums.put
        (start, end), n = self.windows[index], len(self.ladder.h)
        log, scale = _evidence(window, inside, self.points)
        weights = self.sums.add(log + terms.log_prior + rest)
        first, second = (
            _square(window.gains[:, i], inside) + scale * window.left[:, i, i] for i in range(2)
        )
        share = np.sqrt(second / np.maximum(first, TINY)) * (terms.share != 0.0)
        for name, part in (
            ("pairs", weights),
            ("first_alone", weights * (share < DOMINATES)),
            ("second_alone", weights * (share > 1.0 / DOMINATES)),
        ):
            put(name, np.add.reduceat(part, terms.starts, axis=-1))
        all_windows = np.zeros((len(weights), len(self.windows)))
        all_windows[:, index] = np.sum(weights, axis=-1)
        put("window", all_windows)
        if not ladder.exact_known:
            path = np.zeros((len(terms.lower), n - 1))
            path[:, start:end] = -np.sum(window.gains, axis=1)
            path[:, end:] = 1.0
            squared = _square(path, self.differences) + scale * np.sum(window.left, axis=(1, 2))
            put("path", weights @ path)
            put("path_squared", np.sum(weights * squared, axis=-1))

    def add_any_power(self, index: int, sizes: Floats, inside: Floats, rest: Floats) -> None:
        """Add the hypotheses of one power of any value, close to that of the finest differences of the window."""
        rows = _levels_to_rows(len(sizes))
        (start, end), n = self.windows[index], len(self.ladder.h)
        order = self.orders[:, end - 2]
        usable = (order > 0.0) & (order < HIGHEST)
        powers = np.maximum(np.where(usable, order, 1.0)[:, None] + AROUND, TINY)
        errors = sizes ** powers[..., None]
        c = errors @ rows.T
        noise = (rows * (MISFIT * errors[..., None, :]) ** 2) @ rows.T
        precision, log_det = _inverse(c[..., :, None] * c[..., None, :] + noise)
        trace = np.maximum(np.einsum("cpij,cij->cp", precision, inside), TINY)
        log = _scale_free(trace, log_det, self.points[:, None], len(rows)) + rest[:, None]
        log += np.log(OTHER_PRIOR / HIGHEST * np.gradient(AROUND))
        weights = self.sums.add(np.where(usable[:, None], log, UNTHINKABLE))
        mass = np.sum(weights, axis=-1)
        nearest = np.argmin(np.abs(np.where(usable, order, 1.0)[:, None] - self.powers), axis=-1)
        self.sums.put(
            "any_power", mass[:, None] * (np.arange(len(self.powers)) == nearest[:, None])
        )
        self.sums.put("window", mass[:, None] * (np.arange(len(self.windows)) == index))
        if not self.ladder.exact_known:
            gains = np.einsum("cpi,cpij->cpj", c, precision)
            path = np.zeros((*powers.shape, n - 1))
            path[..., start:end] = -gains
            path[..., end:] = 1.0
            squared = np.einsum("cpi,cij,cpj->cp", path, self.differences, path)
            squared += trace / len(rows) * (1.0 - np.sum(gains * c, axis=-1))
            self.sums.put("path", np.einsum("cp,cpi->ci", weights, path))
            self.sums.put("path_squared", np.sum(weights * squared, axis=-1))

    def add_no_expansion(self) -> None:
        """Add the hypotheses without an expansion: rows of any size, behind which all may be noise."""
        ladder, n = self.ladder, len(self.ladder.h)
        scattered = np.sum(self.alone_rows, axis=-1)
        if ladder.exact_known:
            scattered = scattered + self.error_of(0)
        self.sums.put("scattered", self.sums.add(scattered[:, None])[:, 0])
        for k in range(n - 1):
            log = np.sum(self.alone_rows[:, :k], axis=-1)
            log += _noise(
                ladder.h[k:],
                self.rows(k, n - 1, with_exact=ladder.exact_known),
                self.points,
                ladder.floor[:, k:],
            )
            self.sums.put("noise", self.sums.add(log[:, None])[:, 0])

    def posterior(self) -> Posterior:
        """Return what is believed, after all hypotheses were added."""
        values = self.sums.values
        values.setdefault("elsewhere", np.zeros(len(self.points)))
        names = ("alternating", "scattered", "noise", "elsewhere")
        expansion = np.maximum(np.sum(values["window"], axis=-1), TINY)
        total = expansion + sum(values[name] for name in names)
        pairs, first, second, any_power = (
            values.pop(name) / total[:, None]
            for name in ("pairs", "first_alone", "second_alone", "any_power")
        )
        terms = two_powers((1.0,), self.promised)
        lower, higher = (
            (p[terms.starts, None] == self.powers).astype(np.float64)
            for p in (terms.lower, terms.higher)
        )
        for name in (*names, "window"):
            values[name] = values[name] / total.reshape(-1, *[1] * (values[name].ndim - 1))
        if self.ladder.exact_known:
            values["path"], values["path_squared"] = self.alone_rows * np.nan, total * np.nan
        else:
            values["path"] /= expansion[:, None]
            values["path_squared"] /= expansion
        return Posterior(
            powers=self.powers,
            windows=self.windows,
            alone=any_power + first @ lower + second @ higher,
            lowest=any_power + (pairs - second) @ lower + second @ higher,
            highest=any_power + first @ lower + (pairs - first) @ higher,
            **values,
        )


def posterior(ladder: Ladder, promised: float | None = None) -> Posterior:
    """Return what is believed of ladders of three levels and more, all of whose numbers are finite."""
    fit = _Fit(ladder, promised)
    for index in range(len(fit.windows)):
        fit.add_window(index)
    fit.add_no_expansion()
    return fit.posterior()


def _pure(powers: tuple[float, ...]) -> Terms:
    """Return the hypotheses of one power."""
    p = np.array(powers)
    return Terms(p, p, np.zeros(len(p)), np.full(len(p), -math.log(len(p))))
