"""What the predicted noise of levels alone says of their differences."""

from __future__ import annotations

import numpy as np

from vibsim.convergence.error_model.posterior import Ladder
from vibsim.convergence.thresholds import NOISE_FACTOR
from vibsim.core.array_types import Flags, Floats


def is_only_noise(ladder: Ladder, factor: float) -> Flags:
    """Say where all levels differ by no more than the noise that is expected of them."""
    n = len(ladder.h)
    d = np.sqrt(np.diagonal(ladder.gram, axis1=1, axis2=2))[:, : n - 1]
    allowed = factor * (ladder.floor[:, :-1] + ladder.floor[:, 1:])
    return np.asarray(np.all(d <= allowed, axis=-1))


def is_away(ladder: Ladder, factor: float) -> Flags:
    """Say where the finest level is further from the exact solution than noise explains."""
    return np.asarray(np.sqrt(ladder.gram[:, -1, -1]) > factor * ladder.floor[:, -1])


def least_noise(ladder: Ladder) -> Floats:
    """Return the noise of every level if it grows no more than the finest differences show, shape (ladder, n).

    At the coarsest level it is as predicted, since storing numbers makes noise even where differences are 0.
    """
    finest = np.sqrt(np.max(np.diagonal(ladder.gram, axis1=1, axis2=2)[:, -2:], axis=-1))
    least = np.maximum(ladder.floor[:, :1], NOISE_FACTOR * finest[:, None])
    return np.asarray(np.minimum(ladder.floor, least))
