"""Which steps of a level are stored, and whether storage is bounded to what a large sweep can afford."""

from __future__ import annotations

SMALL = 200_000
"""Samples of one variable up to which ``samples: auto`` keeps every step of a level."""
LARGE = 2**17
"""Samples of one variable above which ``samples: auto`` keeps fewer than the times of the coarsest level."""
FEWEST = 16
"""Intervals between the samples of a member that ``samples: auto`` always keeps."""
LEAN = 2**18
"""Samples of one variable on the coarsest level above which an experiment is lean."""


def stride(samples: int | str, coarsest: int, steps: int, trajectories: int) -> int:
    """Return n where every n-th step of a level is stored.

    ``auto``, ``common`` and ``all`` keep times of the coarsest level: all of them, but where ``auto`` would keep too
    many. Every n-th step of each level is as it says: what the levels then have in common is what is stored of the
    coarsest.

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
    thinning = _thinning(coarsest, trajectories) if samples == "auto" else 1
    return steps // coarsest * thinning


def _thinning(coarsest: int, trajectories: int) -> int:
    """Return the least power of two that brings the samples down to `LARGE`, as far as the steps divide."""
    thinning = 1
    while (
        trajectories * (coarsest // thinning + 1) > LARGE
        and coarsest % (2 * thinning) == 0
        and coarsest // (2 * thinning) >= FEWEST
    ):
        thinning *= 2
    return thinning


def is_lean(samples: int | str, coarsest: int, trajectories: int) -> bool:
    """Tell whether levels keep of the series only the states and the energy's deviation.

    Parameters
    ----------
    samples, coarsest, trajectories
        As for `stride`. Who asks for every step, or for every n-th, gets every series.
    """
    return samples in ("auto", "common") and trajectories * (coarsest + 1) > LEAN
