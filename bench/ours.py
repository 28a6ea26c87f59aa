"""The engine, called as the benchmarks need it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibsim.engine import Trajectories, integrate
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES

Floats = NDArray[np.float64]


def step(
    theta: Floats,
    end: float,
    steps: int,
    *,
    arithmetic: str = "compensated",
    samples: int = 1,
    gather: bool = True,
    lane: str | None = None,
    threads: int = 1,
) -> Trajectories:
    """Step pendulums that are released at `theta`, with g = L = m = 1; `samples` intervals are stored."""
    scheme = SCHEMES["central"]
    options = {**scheme.defaults(), "arithmetic": arithmetic, "end_velocity": "kick"}
    members = len(theta)
    return integrate(
        MODELS["pendulum"],
        scheme,
        options,
        np.ones((members, len(MODELS["pendulum"].parameters))),
        np.stack([theta, np.zeros(members)], axis=-1),
        np.full(members, end / steps),
        steps,
        steps // samples,
        lane=lane,
        threads=threads,
        with_gathered=gather,
    )
