"""The best value of a ladder and the error of its finest level, with bounds; whether the exact solution is missed."""

from __future__ import annotations

import numpy as np

from vibsim.convergence.error_model.hypotheses import times
from vibsim.convergence.error_model.posterior import Ladder, Posterior
from vibsim.convergence.thresholds import BEST_BOUND, MISSED, MISSED_SHARE
from vibsim.core.array_types import Flags, Floats
from vibsim.elementary import on_arrays


def best_value(
    ladder: Ladder, of_limit: Posterior, exact: Flags, factors: Floats
) -> dict[str, Floats]:
    """Return the best value, its bound, and the error of the finest level.

    Three levels have the extrapolation by their own order, more levels the mean over all hypotheses. Where levels
    differ by noise alone, the finest one is the best.
    """
    n = len(ladder.h)
    path = of_limit.path
    differences = ladder.gram[:, : n - 1, : n - 1]
    spread = _variance(ladder, of_limit)
    floor = ladder.floor[:, -1]
    if n == 3:
        p, ratio = of_limit.orders[:, 0], ladder.h[1] / ladder.h[2]
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            step = np.where(p > 0.0, -1.0 / (on_arrays.power(ratio, p) - 1.0), np.nan)
        other = np.stack([np.zeros_like(step), step], axis=-1) - path
        spread = spread + _square(other, differences)
        path = path + other
    path = np.where(exact[:, None], 0.0, path)
    spread = np.where(exact, differences[:, -1, -1], spread)
    weights = np.zeros((len(path), n))
    weights[:, -1] = 1.0
    weights[:, :-1] += path * factors
    weights[:, 1:] -= path * factors
    bound = BEST_BOUND * np.sqrt(spread + floor**2)
    if ladder.exact_known:
        error = np.sqrt(ladder.gram[:, -1, -1])
        largest = error + floor
    else:
        error = norm(path, differences)
        largest = error + bound
    return {"weights": weights, "best_bound": bound, "error": error, "error_bound": largest}


def is_missed(ladder: Ladder, of_limit: Posterior) -> Flags:
    """Say where the exact solution is far outside of the bound of the best value."""
    # the best value less the exact one, in the rows
    path = np.concatenate([of_limit.path, np.ones((len(of_limit.path), 1))], axis=-1)
    distance = norm(path, ladder.gram)
    bound = BEST_BOUND * np.sqrt(_variance(ladder, of_limit) + ladder.floor[:, -1] ** 2)
    error = norm(of_limit.path, ladder.gram[:, :-1, :-1])
    return np.asarray((distance > MISSED * bound) & (distance > MISSED_SHARE * error))


def _variance(ladder: Ladder, of_limit: Posterior) -> Floats:
    """Return the mean square distance of the limit from its mean over all hypotheses."""
    path, n = of_limit.path, len(ladder.h)
    differences = ladder.gram[:, : n - 1, : n - 1]
    return np.asarray(np.maximum(of_limit.path_squared - _square(path, differences), 0.0))


def norm(path: Floats, gram: Floats) -> Floats:
    """Return the norm of a combination of rows with this Gram matrix, shape (ladder,)."""
    return np.asarray(np.sqrt(np.maximum(_square(path, gram), 0.0)))


def _square(path: Floats, gram: Floats) -> Floats:
    """Return the square of the same norm."""
    return np.asarray(np.sum(path * times(gram, path), axis=-1))
