"""Step all members of one scheme: choose the lane, run the kernel, name what it gathered."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibsim.engine import gather
from vibsim.engine.kernel import kernel
from vibsim.models import Model
from vibsim.schemes import Scheme
from vibsim.schemes.base import END_RULES, Options

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

PLAIN_STEPS = 40_000
"""Up to so many member-steps the plain lane takes less time than the compiler takes to be imported."""

LANES = ("plain", "compiled")


@dataclass(frozen=True)
class Trajectories:
    """What one scheme computed for every member; arrays of shape (case, n_samples) or (case,)."""

    position: Floats
    velocity: Floats
    kinetic_energy: Floats
    potential_energy: Floats
    position_range: Floats
    """Least and largest position over every step, shape (case, 2)."""
    velocity_range: Floats
    deviation: Floats
    """Largest absolute energy deviation over every step."""
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
    last_step: Integers
    """Last step with finite values: the number of steps where nothing failed."""


def lane_for(member_steps: int) -> str:
    """Choose the lane from the size of the work; the bits are the same in every lane."""
    return "plain" if member_steps <= PLAIN_STEPS else "compiled"


def integrate(
    model: Model,
    scheme: Scheme,
    options: Options,
    parameters: Floats,
    initial: Floats,
    dt: Floats,
    steps: int,
    every: int,
    lane: str | None = None,
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

    Raises
    ------
    SimulationError
        Where the kernel cannot be compiled.
    """
    members = len(dt)
    samples = np.full((4, members, steps // every + 1), np.nan)
    stats = np.full((members, gather.N_STATS), np.nan)
    counts = np.zeros((members, gather.N_COUNTS), dtype=np.int64)
    stepper = scheme.stepper(options)
    run = kernel(model, stepper, lane or lane_for(members * steps))
    arrays = (np.ascontiguousarray(array, dtype=np.float64) for array in (parameters, initial, dt))
    end_rule = END_RULES.index(stepper.end)
    turn = model.turn or 0.0
    run(*arrays, steps, every, stepper.variant, end_rule, turn, samples, stats, counts)
    return _name(samples, stats, counts)


def _name(samples: Floats, stats: Floats, counts: Integers) -> Trajectories:
    peaks, turns = counts[:, gather.PEAKS] - 1, counts[:, gather.TURNS] - 1
    spinning = turns > 0
    swinging = (peaks > 0) & ~spinning

    def mean_time(first: int, last: int, intervals: Integers) -> Floats:
        span = np.where(intervals > 0, stats[:, last] - stats[:, first], np.nan)
        return np.asarray(span / np.maximum(intervals, 1))

    of_turn = mean_time(gather.FIRST_TURN_TIME, gather.LAST_TURN_TIME, turns)
    of_peak = mean_time(gather.FIRST_PEAK_TIME, gather.LAST_PEAK_TIME, peaks)
    on_grid = mean_time(gather.FIRST_PEAK_TIME_GRID, gather.LAST_PEAK_TIME_GRID, peaks)
    return Trajectories(
        position=samples[0],
        velocity=samples[1],
        kinetic_energy=samples[2],
        potential_energy=samples[3],
        position_range=stats[:, [gather.POSITION_MIN, gather.POSITION_MAX]],
        velocity_range=stats[:, [gather.VELOCITY_MIN, gather.VELOCITY_MAX]],
        deviation=stats[:, gather.DEVIATION],
        deviation_interior=stats[:, gather.DEVIATION_INTERIOR],
        period=np.where(spinning, of_turn, of_peak),
        period_grid=np.where(swinging, on_grid, np.nan),
        period_count=np.where(spinning, turns, np.where(swinging, peaks, 0)),
        first_peak=stats[:, gather.FIRST_PEAK],
        last_peak=stats[:, gather.LAST_PEAK],
        last_trough=stats[:, gather.LAST_TROUGH],
        last_step=counts[:, gather.LAST_STEP],
    )
