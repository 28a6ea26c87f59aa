"""The best value of a ladder and the error of its finest level, with bounds; whether the exact solution is missed."""

from __future__ import annotations

import numpy as np

from vibsim.convergence.error_model.ladder import Ladder
from vibsim.convergence.error_model.matrices import matvec
from vibsim.convergence.error_model.posterior import Posterior
from vibsim.convergence.thresholds import BEST_BOUND, MISSED, MISSED_SHARE
from vibsim.core.array_types import Flags, Floats
from vibsim.elementary import on_arrays


def best_value(
    ladder: Ladder, posterior: Posterior, only_noise: Flags, factors: Floats
) -> dict[str, Floats]:
    """Return the best value and the error of the finest level, with bounds; see `assessment.Assessment`.

    Three levels are extrapolated by their own order; more levels have the mean over likely expansions. Where levels
    differ by noise alone, the finest level is the best value. `factors` are those of `ladder_blocks`.
    """
    n = len(ladder.h)
    limit = posterior.limit_weights
    differences = ladder.gram[:, : n - 1, : n - 1]
    variance = _variance(ladder, posterior)
    floor = ladder.floor[:, -1]
    if n == 3:
        p, ratio = posterior.orders[:, 0], ladder.h[1] / ladder.h[2]
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            step = np.where(p > 0.0, -1.0 / (on_arrays.power(ratio, p) - 1.0), np.nan)
        shift = np.stack([np.zeros_like(step), step], axis=-1) - limit
        variance = variance + _square(shift, differences)
        limit = limit + shift
    limit = np.where(only_noise[:, None], 0.0, limit)
    variance = np.where(only_noise, differences[:, -1, -1], variance)
    weights = np.zeros((len(limit), n))
    weights[:, -1] = 1.0
    weights[:, :-1] += limit * factors
    weights[:, 1:] -= limit * factors
    bound = BEST_BOUND * np.sqrt(variance + floor**2)
    if ladder.exact_known:
        error = np.sqrt(ladder.gram[:, -1, -1])
        largest = error + floor
    else:
        error = norm(limit, differences)
        largest = error + bound
    return {"weights": weights, "best_bound": bound, "error": error, "error_bound": largest}


def is_missed(ladder: Ladder, posterior: Posterior) -> Flags:
    """Say where the exact solution is far outside the bound of the best value."""
    # best value minus exact solution, as weights of the rows
    limit = posterior.limit_weights
    weights = np.concatenate([limit, np.ones((len(limit), 1))], axis=-1)
    distance = norm(weights, ladder.gram)
    bound = BEST_BOUND * np.sqrt(_variance(ladder, posterior) + ladder.floor[:, -1] ** 2)
    error = norm(limit, ladder.gram[:, :-1, :-1])
    return np.asarray((distance > MISSED * bound) & (distance > MISSED_SHARE * error))


def _variance(ladder: Ladder, posterior: Posterior) -> Floats:
    """Return the posterior variance of the limit: its mean squared distance from its mean."""
    n = len(ladder.h)
    differences = ladder.gram[:, : n - 1, : n - 1]
    square = _square(posterior.limit_weights, differences)
    return np.asarray(np.maximum(posterior.limit_square - square, 0.0))


def norm(weights: Floats, gram: Floats) -> Floats:
    """Return the norm of the weighted sum of rows with this Gram matrix, shape (ladder,)."""
    return np.asarray(np.sqrt(np.maximum(_square(weights, gram), 0.0)))


def _square(weights: Floats, gram: Floats) -> Floats:
    """Return the square of that norm."""
    return np.asarray(np.sum(weights * matvec(gram, weights), axis=-1))
