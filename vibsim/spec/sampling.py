"""Which steps of a level are stored."""

from __future__ import annotations

SMALL = 200_000
"""Samples of one variable up to which ``samples: auto`` keeps every step of a level."""


def stride(samples: int | str, coarsest: int, steps: int, trajectories: int) -> int:
    """Return n where every n-th step of a level is stored.

    ``auto``, ``common`` and ``all`` keep the times of the coarsest level. Every n-th step of each level is as it says:
    what the levels then have in common is what is stored of the coarsest.

    Parameters
    ----------
    samples
        What the file asks for: ``auto``, ``common``, ``all``, or n, which divides `coarsest`, for every n-th step.
    coarsest
        Number of steps of the coarsest level.
    steps
        Number of steps of this level.
    trajectories
        Number of schemes times number of members.
    """
    if isinstance(samples, int):
        return samples
    if samples == "all" or (samples == "auto" and trajectories * (steps + 1) <= SMALL):
        return 1
    return steps // coarsest
