"""Which steps of a level are stored."""

from __future__ import annotations

import math

SMALL = 200_000
"""Samples of one variable up to which ``samples: auto`` keeps every step of a level."""


def stride(samples: int | str, coarsest: int, steps: int, trajectories: int) -> int:
    """Return n where every n-th step of a level is stored; the times of the coarsest level always are.

    Parameters
    ----------
    samples
        What the file asks for: ``auto``, ``common``, ``all``, or n for every n-th step.
    coarsest
        Number of steps of the coarsest level.
    steps
        Number of steps of this level.
    trajectories
        Number of schemes times number of members.
    """
    common = steps // coarsest
    if samples == "all":
        return 1
    if samples == "auto":
        return 1 if trajectories * (steps + 1) <= SMALL else common
    # every 3rd step of this level need not meet the coarsest level's times; their common divisor does
    return math.gcd(samples, common) if isinstance(samples, int) else common
