"""How likely the rows of ladders are under a hypothesis: logarithms of evidence, shape (ladder, hypothesis)."""

from __future__ import annotations

import math

import numpy as np

from vibsim.convergence.error_model import priors
from vibsim.convergence.error_model.hypotheses import Window, inverse, levels_to_rows
from vibsim.core.array_types import Floats

TINY = 1e-300
"""Less is nothing."""
LOG_GAMMA = np.array([math.inf, *(math.lgamma(0.5 * n) for n in range(1, 200))])
"""The logarithm of Gamma(n/2), by n."""


def sum_of_products(matrices: Floats, gram: Floats) -> Floats:
    """Return ``tr(M G)`` for every ladder and hypothesis, shape (ladder, hypothesis); never negative."""
    count, w = len(matrices), gram.shape[-1]
    return np.maximum(gram.reshape(len(gram), w * w) @ matrices.reshape(count, w * w).T, TINY)


def mean_square(gains: Floats, gram: Floats) -> Floats:
    """Return the mean square of what the gains make of the rows, shape (ladder, hypothesis)."""
    return sum_of_products(gains[:, :, None] * gains[:, None, :], gram)


def scale_free(trace: Floats, log_det: Floats | float, points: Floats, rows: int) -> Floats:
    """Return the evidence of rows of any size; see the head of this module."""
    n = points * rows
    return np.asarray(
        math.log(0.5)
        + LOG_GAMMA[np.asarray(n, dtype=np.int64)]
        - 0.5 * n * np.log(np.pi * trace)
        - 0.5 * points * log_det
    )


def evidence(window: Window, gram: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Return the log evidence of the rows of a window, and the square of their scale, shape (ladder, hypothesis)."""
    w, n = gram.shape[-1], points[:, None]
    if window.across is None:
        trace = sum_of_products(window.precision, gram)
        return scale_free(trace, window.log_det, n, w), trace / w
    # one dimension along the last row, the others across it
    last = np.maximum(gram[:, -1, -1], TINY)[:, None]
    along = gram[:, -1, :, None] * gram[:, -1, None, :] / last[..., None]
    trace = sum_of_products(window.precision, along)
    log = scale_free(trace, window.log_det, np.ones(1), w)
    # the last row has any direction
    log += math.log(2.0) + 0.5 * np.log(last) + scale_free(last, 0.0, n, 1)
    precision, log_det = window.across
    rest = np.maximum(
        (gram - along)[:, :-1, :-1].reshape(len(gram), -1)
        @ precision.reshape(len(precision), -1).T,
        0.0,
    )
    log -= 0.5 * (n - 1.0) * ((w - 1) * np.log(2.0 * np.pi * last / n) + log_det)
    with np.errstate(over="ignore"):
        log -= np.where(n > 1.0, 0.5 * n * rest / last, 0.0)
    return log, trace / w


def any_size(gram: Floats, points: Floats) -> Floats:
    """Return the evidence of every difference of which nothing is known but the next one, shape (ladder, row)."""
    own = np.diagonal(gram, axis1=1, axis2=2)
    across = own[:, :-1] - np.diagonal(gram, 1, 1, 2) ** 2 / own[:, 1:]
    n = points[:, None]
    found = []
    for part in priors.COHERENCES:
        variance = part**2 * own[:, :-1] / n
        log = -0.5 * (n - 1.0) * np.log(2.0 * np.pi * variance) - 0.5 * np.log(own[:, :-1])
        found.append(log - np.where(n > 1.0, 0.5 * np.maximum(across, 0.0) / variance, 0.0))
    log = _log_mean(np.stack(found, axis=-1)) + math.log(0.5)
    return np.concatenate([log, scale_free(own[:, -1:], 0.0, n, 1)], axis=-1)


def _log_mean(logs: Floats) -> Floats:
    """Return the log of the mean of exponentials over the last axis."""
    largest = np.max(logs, axis=-1, keepdims=True)
    return np.asarray(
        (largest + np.log(np.mean(np.exp(logs - largest), axis=-1, keepdims=True)))[..., 0]
    )


def noise(sizes: Floats, gram: Floats, points: Floats, floor: Floats) -> Floats:
    """Return the evidence that the differences between these levels are noise, shape (ladder,).

    Noise of the predicted size, within `PREDICTION`, is expected; other noise costs a price.
    """
    count = gram.shape[-1]
    if not count:
        return np.zeros(len(gram))
    # the exact solution, if it is known, is a level more, which has no noise
    rows = levels_to_rows(count + 1)
    found = []
    for growth in priors.GROWTHS:
        of_level = np.zeros(count + 1)
        of_level[: len(sizes)] = (sizes / sizes[-1]) ** (-2.0 * growth)
        precision, log_det = inverse((rows * of_level) @ rows.T)
        trace = sum_of_products(precision[None], gram)[:, 0]
        size = 0.5 * np.log10(trace / len(rows)) - np.log10(np.maximum(floor[:, -1], TINY))
        decades = size / math.log10(priors.PREDICTION)
        expected = -0.5 * decades**2 - math.log(
            math.sqrt(2.0 * np.pi) * math.log(priors.PREDICTION)
        )
        of_size = np.logaddexp(expected, math.log(priors.UNEXPECTED) - priors.PRICE)
        found.append(scale_free(trace, log_det, points, len(rows)) + of_size)
    return _log_mean(np.stack(found, axis=-1))


def noise_of_finest(floor: Floats, last: Floats) -> tuple[Floats, Floats]:
    """Return the log prior of the two of `FINEST_NOISE`, shape (ladder,).

    A window does not end with a difference that is predicted to be noise.
    """
    share = floor / np.sqrt(np.maximum(last, TINY))
    noisy = np.clip(share / (0.3 * priors.FINEST_NOISE[1]), priors.UNEXPECTED, 0.999)
    drowned = np.where(share > 1.0, -20.0, 0.0)
    return np.log(1.0 - noisy) + drowned, np.log(noisy) + drowned
