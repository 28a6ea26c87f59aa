"""Step all members of one scheme: choose the lane, run the kernel, name what it gathered."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibsim.engine import blocks, gather
from vibsim.engine.kernel import carried, kernel, observer
from vibsim.models import Model
from vibsim.schemes import Scheme
from vibsim.schemes.base import END_RULES, Options, Stepper
from vibsim.spec.cost import PLAIN_MEMBER_STEPS

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

TASK = 16 * blocks.LANES
"""Members that a thread takes at a time."""


@dataclass(frozen=True)
class Gathered:
    """What one scheme had at every step of every member; arrays of shape (case,) unless stated."""

    position_range: Floats
    """Least and largest position, shape (case, 2)."""
    velocity_range: Floats
    position_norms: Floats
    """``dt sum |u|`` and ``sqrt(dt sum u^2)`` over every point, shape (case, 2)."""
    velocity_norms: Floats
    deviation: Floats
    """Largest absolute energy deviation."""
    deviation_interior: Floats
    """The same without the last point."""
    period: Floats
    """Mean time between peaks, or of a turn for a member that goes over the top; NaN below one period."""
    period_grid: Floats
    """Mean time between peaks at grid points; NaN where there are none."""
    period_count: Integers
    first_peak: Floats
    last_peak: Floats
    last_trough: Floats


@dataclass(frozen=True)
class Trajectories:
    """What one scheme computed for every member."""

    position: Floats
    """Shape (case, n_samples); NaN from where a member failed."""
    velocity: Floats
    last_step: Integers
    """Last step with finite values, shape (case,): the number of steps where nothing failed."""
    gathered: Gathered | None
    """None where nothing was to be gathered."""


def lane_for(members: int, steps: int) -> str:
    """Choose the lane from the size of the work; the bits are the same in every lane."""
    if members * steps <= PLAIN_MEMBER_STEPS:
        return "plain"
    return "blocks" if members > 1 else "scalar"


def integrate(
    model: Model,
    scheme: Scheme,
    options: Options,
    parameters: Floats,
    initial: Floats,
    dt: Floats,
    steps: int,
    every: int,
    *,
    lane: str | None = None,
    threads: int = 1,
    with_gathered: bool = True,
) -> Trajectories:
    """Step every member from t = 0.

    Parameters
    ----------
    parameters
        In the order of `model.parameters`, shape (case, n_parameters).
    initial
        Position and velocity, shape (case, 2).
    dt
        Step of each member, shape (case,).
    steps, every
        Number of steps N, and the stride of the samples, a divisor of N.
    lane
        One of `LANES`; chosen by `lane_for` where None.
    threads
        How many threads share the members.
    with_gathered
        Whether extrema, norms, peaks, turns and energies are gathered at every step.

    Raises
    ------
    SimulationError
        Where the kernel cannot be compiled.
    """
    members = len(dt)
    stepper = scheme.stepper(options)
    lane = lane or lane_for(members, steps)
    run = kernel(model, stepper, lane, with_gathered)
    samples = np.full((2, members, steps // every + 1), np.nan)
    rows = gather.N_STATS if with_gathered else 0
    stats = np.full((members, rows), np.nan)
    counts = np.zeros((members, gather.N_COUNTS), dtype=np.int64)
    parameters = _scaled(model, stepper, parameters, dt)
    numbers = [np.ascontiguousarray(array, dtype=float) for array in (parameters, initial, dt)]
    scratch = blocks.n_rows(carried(stepper, model), parameters.shape[1]) * blocks.LANES
    scratch = scratch if lane == "blocks" else 0
    end_rule, turn = END_RULES.index(stepper.end), model.turn or 0.0

    def task(first: int) -> None:
        stop = min(first + (TASK if threads > 1 else members), members)
        run(*numbers, first, stop, steps, every, stepper.variant, end_rule, turn, samples, stats, counts, _aligned(scratch))  # fmt: skip # noqa: E501

    _share(task, range(0, members, TASK) if threads > 1 else range(1), threads)
    gathered = _name(stats, counts) if with_gathered else None
    return Trajectories(samples[0], samples[1], counts[:, gather.LAST_STEP], gathered)


def _scaled(model: Model, stepper: Stepper, parameters: Floats, dt: Floats) -> Floats:
    """Put the factors of `Stepper.scaling` behind the parameters of every member."""
    if stepper.scaling is None:
        return parameters
    named = {row.name: parameters[:, i] for i, row in enumerate(model.parameters)}
    factors = stepper.scaling(np.broadcast_to(model.natural_frequency(named), dt.shape) * dt)
    return np.column_stack([parameters, *factors])


_NOTHING = np.empty(0)


def _aligned(size: int) -> Floats:
    """Return an array that begins with a cache line: a vector that lies across two of them costs twice."""
    if size == 0:
        return _NOTHING
    room = np.empty(size + 8)
    first = -room.__array_interface__["data"][0] % 64 // 8
    return room[first : first + size]


def _share(task: Callable[[int], None], firsts: Iterable[int], threads: int) -> None:
    """Do every task, on several threads where that is asked for; kernels let go of the interpreter."""
    if threads == 1:
        for first in firsts:
            task(first)
        return
    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(task, firsts):
            pass


def energies(
    model: Model,
    parameters: Floats,
    dt: Floats,
    every: int,
    position: Floats,
    velocity: Floats,
    *,
    lane: str,
) -> tuple[Floats, Floats]:
    """Return kinetic and potential energy at the samples of `integrate`, shape (case, n_samples).

    Raises
    ------
    SimulationError
        Where the kernel cannot be compiled.
    """
    samples = np.stack([position, velocity])
    found = np.empty(samples.shape)
    numbers = (np.ascontiguousarray(array, dtype=float) for array in (parameters, dt))
    observer(model, "plain" if lane == "plain" else "scalar")(*numbers, every, 0, samples, found)
    return found[0], found[1]


def _name(stats: Floats, counts: Integers) -> Gathered:
    peaks, turns = counts[:, gather.PEAKS] - 1, counts[:, gather.TURNS] - 1
    spinning = turns > 0
    swinging = (peaks > 0) & ~spinning

    def mean_time(first: int, last: int, intervals: Integers) -> Floats:
        span = np.where(intervals > 0, stats[:, last] - stats[:, first], np.nan)
        return np.asarray(span / np.maximum(intervals, 1))

    of_turn = mean_time(gather.FIRST_TURN_TIME, gather.LAST_TURN_TIME, turns)
    of_peak = mean_time(gather.FIRST_PEAK_TIME, gather.LAST_PEAK_TIME, peaks)
    on_grid = mean_time(gather.FIRST_PEAK_TIME_GRID, gather.LAST_PEAK_TIME_GRID, peaks)
    return Gathered(
        position_range=stats[:, [gather.POSITION_MIN, gather.POSITION_MAX]],
        velocity_range=stats[:, [gather.VELOCITY_MIN, gather.VELOCITY_MAX]],
        position_norms=stats[:, [gather.POSITION_L1, gather.POSITION_L2]],
        velocity_norms=stats[:, [gather.VELOCITY_L1, gather.VELOCITY_L2]],
        deviation=stats[:, gather.DEVIATION],
        deviation_interior=stats[:, gather.DEVIATION_INTERIOR],
        period=np.where(spinning, of_turn, of_peak),
        period_grid=np.where(swinging, on_grid, np.nan),
        period_count=np.where(spinning, turns, np.where(swinging, peaks, 0)),
        first_peak=stats[:, gather.FIRST_PEAK],
        last_peak=stats[:, gather.LAST_PEAK],
        last_trough=stats[:, gather.LAST_TROUGH],
    )
