"""Step all members of one scheme: choose the lane, run the kernel, name what it gathered."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibsim.engine.gather import COUNTS, STATS
from vibsim.engine.kernel import kernel
from vibsim.engine.loop import END_RULES
from vibsim.models import Model
from vibsim.schemes import Scheme
from vibsim.schemes.base import Options

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
    stats = np.full((members, len(STATS)), np.nan)
    counts = np.zeros((members, len(COUNTS)), dtype=np.int64)
    run = kernel(model, scheme.stepper(options), lane or lane_for(members * steps))
    arrays = (np.ascontiguousarray(array, dtype=np.float64) for array in (parameters, initial, dt))
    first_order = options.get("start") == "first_order"
    end_rule = END_RULES[options.get("end_velocity", "kick")]
    run(*arrays, steps, every, first_order, end_rule, model.turn or 0.0, samples, stats, counts)
    return _name(samples, stats, counts)


def _name(samples: Floats, stats: Floats, counts: Integers) -> Trajectories:
    stat = dict(zip(STATS, stats.T, strict=True))
    count = dict(zip(COUNTS, counts.T, strict=True))
    swings, turns = count["peaks"] - 1, count["turns"] - 1
    spinning = turns > 0
    swinging = (swings > 0) & ~spinning
    period = np.where(
        spinning,
        _mean_time(stat["first_turn_time"], stat["last_turn_time"], turns),
        _mean_time(stat["first_peak_time"], stat["last_peak_time"], swings),
    )
    grid = _mean_time(stat["first_peak_time_grid"], stat["last_peak_time_grid"], swings)
    return Trajectories(
        position=samples[0],
        velocity=samples[1],
        kinetic_energy=samples[2],
        potential_energy=samples[3],
        position_range=stats[:, 0:2],
        velocity_range=stats[:, 2:4],
        deviation=stat["deviation"],
        deviation_interior=stat["deviation_interior"],
        period=period,
        period_grid=np.where(swinging, grid, np.nan),
        period_count=np.where(spinning, turns, np.where(swinging, swings, 0)),
        first_peak=stat["first_peak"],
        last_peak=stat["last_peak"],
        last_trough=stat["last_trough"],
        last_step=count["last_step"],
    )


def _mean_time(first: Floats, last: Floats, intervals: Integers) -> Floats:
    return np.asarray(np.where(intervals > 0, last - first, np.nan) / np.maximum(intervals, 1))
