"""A ladder as a solver: arrays in, arrays out, and little around the stepping itself."""

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
from vibsim.convergence.state_extrapolation import FLOATS, Circumstances, Pair, best_entry
from vibsim.convergence.thresholds import KNOWN_DIGIT
from vibsim.core.array_types import Floats

LEAST_LOOKS = 16
"""The coarsest level is looked at so many times at least, where rounding errors are measured."""


def solve(
    method: Method,
    start: Start,
    steps: tuple[int, ...],
    points: int = 1,
    *,
    threads: int = 1,
    lane: str | None = None,
) -> Extrapolated:
    """Run a ladder and extrapolate it, with as little around the stepping as can be.

    Parameters
    ----------
    method
        A scheme with its options on a model. Make it once: it keeps what it has worked out about itself.
    start
        The numbers of the members.
    steps
        Number of steps of every level, strictly increasing, multiples of `points`.
    points
        The solution is wanted at so many equal times, the last of which is the end.
    threads
        How many threads share the members; no number depends on it.
    lane
        Of the engine. Little work is done without a compiler where it is None; ``scalar`` is worth it for who calls
        often.

    Returns
    -------
    Extrapolated
        Arrays of shape (points, case), with the bounds of their errors; places of levels count from 0.

    Raises
    ------
    ValueError
        Where a level cannot be sampled at these times.
    """
    if points == 1 and len(start.end) == 1 and method.has_one_expansion:
        return _end_of_one(method, start, steps, lane)
    found = vars(climb(method, start, steps, points, threads=threads, lane=lane))
    return Extrapolated(**{name: values[1:] for name, values in found.items()})


def climb(
    method: Method,
    start: Start,
    steps: tuple[int, ...],
    points: int,
    *,
    threads: int = 1,
    lane: str | None = None,
) -> Extrapolated:
    """Do the same as `solve`, with t = 0 before the other times."""
    if any(n % points for n in steps):
        raise ValueError(f"{points} equal times are no samples of levels with {steps} steps")
    run = partial(level_at, threads=threads, lane=lane)
    levels, noise = _levels(method, start, steps, points, run)
    t = (np.arange(points + 1) / points)[:, None]
    return extrapolate_members(method, start, steps, t, levels, noise)


def _levels(
    method: Method, start: Start, steps: tuple[int, ...], points: int, run: Callable[..., Pair]
) -> tuple[list[Pair], Floats | None]:
    """Return every level at `points` equal times and t = 0, and the measured noise, of shape (t, case)."""
    finer = 1
    while points * finer < LEAST_LOOKS and steps[0] % (2 * points * finer) == 0:
        finer *= 2
    every = [n // points for n in steps]
    every[0] //= finer
    levels = [run(method, start, n, stride) for n, stride in zip(steps, every, strict=True)]
    noise = noise_of(method, start, steps, every, levels, run)
    u, v = levels[0]
    levels[0] = u[::finer], v[::finer]
    return levels, noise


def _end_of_one(
    method: Method, start: Start, steps: tuple[int, ...], lane: str | None
) -> Extrapolated:
    """Return the end of one member: the numbers of `climb` from floats, for which numpy would take ten times longer."""
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
    places = (-1, -1) if best.entry < 0 else (row - column, row)
    return Extrapolated(*(np.array([[number]]) for number in (*numbers, *places)))
