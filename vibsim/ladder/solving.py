"""A ladder as a solver: arrays in, arrays out, with little overhead besides the stepping itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from vibsim.comparison.extrapolate_members import (
    Extrapolated,
    Method,
    Start,
    extrapolate_members,
    inverse_power,
    level_at,
    noise_of,
    rate_of,
)
from vibsim.convergence.extrapolation.states import FLOATS, Circumstances, Pair, best_entry
from vibsim.convergence.extrapolation.thresholds import KNOWN_DIGIT
from vibsim.core.array_types import Floats

LEAST_TIMES = 16
"""Fewest times at which the coarsest level is stored to measure its rounding error, where its steps allow."""


def solve(
    method: Method,
    start: Start,
    steps: tuple[int, ...],
    points: int = 1,
    *,
    threads: int = 1,
    lane: str | None = None,
) -> Extrapolated:
    """Run the levels of a ladder and extrapolate the solution, with as little overhead as possible.

    Parameters
    ----------
    method
        A scheme with its options on a model. Make it once, because it caches its derived data.
    start
        Parameters and initial values of the members.
    steps
        Number of steps of every level, strictly increasing, multiples of `points`.
    points
        Number of equidistant times of the solution, the last of which is the end.
    threads
        Number of threads that share the members; no result depends on it.
    lane
        Lane of the engine. With None, small problems run without a compiled kernel; ``scalar`` pays for frequent calls.

    Returns
    -------
    Extrapolated
        Arrays of shape (points, case), with the bounds of their errors; levels are counted from 0.

    Raises
    ------
    ValueError
        Where the steps of a level are not a multiple of `points`.
    """
    if points == 1 and len(start.end) == 1 and method.has_one_expansion:
        return _single_end(method, start, steps, lane)
    fields = vars(climb(method, start, steps, points, threads=threads, lane=lane))
    return Extrapolated(**{name: values[1:] for name, values in fields.items()})


def climb(
    method: Method,
    start: Start,
    steps: tuple[int, ...],
    points: int,
    *,
    threads: int = 1,
    lane: str | None = None,
) -> Extrapolated:
    """Do the same as `solve`, but return the time t = 0 as well: arrays of shape (1 + points, case)."""
    if any(n % points for n in steps):
        raise ValueError(f"{points} equal times are no samples of levels with {steps} steps")
    run = partial(level_at, threads=threads, lane=lane)
    levels, noise = _levels(method, start, steps, points, run)
    t = (np.arange(points + 1) / points)[:, None]
    return extrapolate_members(method, start, steps, t, levels, noise)


def _levels(
    method: Method, start: Start, steps: tuple[int, ...], points: int, run: Callable[..., Pair]
) -> tuple[list[Pair], Floats | None]:
    """Return every level at `points` equidistant times and t = 0, and the measured noise, of shape (t, case)."""
    refinement = 1
    while points * refinement < LEAST_TIMES and steps[0] % (2 * points * refinement) == 0:
        refinement *= 2
    every = [n // points for n in steps]
    every[0] //= refinement
    levels = [run(method, start, n, stride) for n, stride in zip(steps, every, strict=True)]
    noise = noise_of(method, start, steps, every, levels, run)
    u, v = levels[0]
    levels[0] = u[::refinement], v[::refinement]
    return levels, noise


def _single_end(
    method: Method, start: Start, steps: tuple[int, ...], lane: str | None
) -> Extrapolated:
    """Return the last values of `climb` for a single member, with Python floats: ten times faster than numpy here."""
    levels, noise = _levels(method, start, steps, 1, partial(level_at, lane=lane))
    pairs = [(float(u[-1, 0]), float(v[-1, 0])) for u, v in levels]
    rate, end = float(rate_of(start)[0]), float(start.end[0])
    (u, v), (x, y), larger = start.initial[0].tolist(), pairs[-1], FLOATS.larger
    size = larger(larger(abs(u), abs(v) / rate), larger(abs(x), abs(y) / rate))
    measured = math.nan if noise is None else float(noise[-1, 0])
    phase, p = rate * end, method.position_powers[0]
    known = Circumstances(
        rate=rate,
        size=size,
        limit=KNOWN_DIGIT * min(size, 0.25 * (method.model.turn or math.inf)),
        phase=phase,
        response=0.0 if method.model.linear else inverse_power(phase, p),
        noise=larger(measured, size),
        spread=larger(phase, 1.0) if measured == measured else 1.0,
    )
    best = best_entry(method.tableau(steps, method.position_powers), pairs, known, FLOATS)
    row, column = divmod(best.entry, len(steps))
    numbers = (best.position, best.velocity, best.error, best.error * rate)
    used = (-1, -1) if best.entry < 0 else (row - column, row)
    return Extrapolated(*(np.array([[number]]) for number in (*numbers, *used)))
