"""How likely the rows of ladders are under hypotheses: logarithms of evidence, shape (ladder, ...)."""

from __future__ import annotations

import math

import numpy as np

from vibsim.convergence.error_model import priors
from vibsim.convergence.error_model.hypotheses import (
    Table,
    outer,
    packed,
)
from vibsim.convergence.error_model.kernel import weigh
from vibsim.core.array_types import Floats

TINY = 1e-300
"""Less is nothing."""
UNTHINKABLE = -1e6
"""Log evidence of what cannot be."""


def log_gamma(n: Floats) -> Floats:
    """Return the logarithm of Gamma(n/2) for positive whole n."""
    values, place = np.unique(n, return_inverse=True)
    return np.array([math.lgamma(0.5 * x) for x in values])[place].reshape(n.shape)


def scale_free(trace: Floats, log_det: Floats | float, points: Floats, rows: int) -> Floats:
    """Return the evidence of rows of any size; see the head of this module."""
    n = points * rows
    return np.asarray(
        math.log(0.5) + log_gamma(n) - 0.5 * n * np.log(np.pi * trace) - 0.5 * points * log_det
    )


def log_sum(logs: Floats) -> Floats:
    """Return the log of the sum of exponentials over the last axis."""
    largest = np.max(logs, axis=-1)
    return np.asarray(largest + np.log(np.sum(np.exp(logs - largest[..., None]), axis=-1)))


def weights(
    table: Table, gram: Floats, points: Floats, behind: Floats
) -> tuple[Floats, dict[str, Floats]]:
    """Weigh the hypotheses of a table on the rows of a window.

    Parameters
    ----------
    gram
        Of the w rows, shape (ladder, w, w).
    points
        N, shape (ladder,).
    behind
        See `vibsim.convergence.error_model.kernel.kernel`; over the square of the last row.

    Returns
    -------
    tuple
        The log of their evidence, with priors, summed up, shape (ladder,), and the means of what `kernel` finds.
    """
    count, w = len(gram), gram.shape[-1]
    last = np.maximum(gram[:, -1, -1], TINY)
    relative = gram / last[:, None, None]
    read, dimensions, rest = relative, points, np.zeros(count)
    beside, across = np.empty((0, len(table.pair))), np.empty((count, 0))
    powers = np.stack([points * w, np.zeros(count)], axis=-1)
    if table.beside is not None:
        # one dimension along the last row, which may have any direction, and the others across it, of a Student's t
        along = outer(relative[:, -1], relative[:, -1])
        beside, across = table.beside, packed((relative - along)[:, :-1, :-1])
        # numbers have nothing across
        read, dimensions = np.where(points[:, None, None] > 1.0, along, relative), np.ones(count)
        free = (points - 1.0) * (w - 1)
        powers = np.stack([dimensions * w, (free + priors.TAIL) * (free > 0.0)], axis=-1)
        rest = math.log(2.0) + 0.5 * np.log(last) + scale_free(last, 0.0, points, 1)
        rest += log_gamma(free + priors.TAIL) - math.lgamma(0.5 * priors.TAIL)
        rest -= 0.5 * free * np.log(np.pi * last / points)
        across = across * points[:, None]
    pairs = int(table.pair[-1]) + 1
    found = np.empty((count, 3 + w + 3 * pairs))
    weigh()(
        packed(relative), packed(read), points.astype(np.int64), powers.astype(np.int64), across, behind,
        table.forms, beside, table.columns, table.pair, pairs, np.empty((2, len(table.pair))), found,
    )  # fmt: skip
    # rows that are nowhere near any hypothesis have no weight at all
    top, total = np.maximum(found[:, 0], TINY), np.maximum(found[:, 1], TINY)
    log = rest + scale_free(last / top, 0.0, dimensions, w) + np.log(total)
    found[:, 2:] /= total[:, None]
    path, pair = found[:, 3 : 3 + w], found[:, 3 + w :].reshape(count, 3, pairs)
    names = ("pairs", "first_alone", "second_alone")
    means = {"path": path, "path_squared": found[:, 2] * last}
    return log, means | {name: pair[:, i] for i, name in enumerate(names)}


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
    log = log_sum(np.stack(found, axis=-1)) + math.log(0.5 / len(found))
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
    found = []
    for growth in priors.GROWTHS:
        variance = (sizes / sizes[-1]) ** (-2.0 * growth)
        weights, log_det = 1.0 / variance, np.sum(np.log(variance))
        own = levels[:, : len(sizes), : len(sizes)]
        trace = np.sum(np.diagonal(own, axis1=1, axis2=2) * weights, axis=-1)
        if not known:
            trace -= np.sum(own * outer(weights, weights), axis=(1, 2)) / np.sum(weights)
            log_det += np.log(np.sum(weights))
        trace = np.maximum(trace, TINY)
        size = 0.5 * np.log10(trace / count) - np.log10(np.maximum(floor[:, -1], TINY))
        decades = size / math.log10(priors.PREDICTION)
        expected = -0.5 * decades**2 - math.log(
            math.sqrt(2.0 * np.pi) * math.log(priors.PREDICTION)
        )
        of_size = np.logaddexp(expected, math.log(priors.UNEXPECTED) - priors.PRICE)
        found.append(scale_free(trace, log_det, points, count) + of_size)
    return log_sum(np.stack(found, axis=-1)) - math.log(len(found))


def noise_of_finest(floor: Floats, last: Floats) -> tuple[Floats, Floats]:
    """Return the log prior of the two of `FINEST_NOISE`, shape (ladder,).

    A window does not end with a difference that is predicted to be noise.
    """
    share = floor / np.sqrt(np.maximum(last, TINY))
    noisy = np.clip(share / (0.3 * priors.FINEST_NOISE[1]), priors.UNEXPECTED, 0.999)
    drowned = np.where(share > 1.0, math.log(priors.UNEXPECTED) - priors.PRICE, 0.0)
    return np.log(1.0 - noisy) + drowned, np.log(noisy) + drowned
