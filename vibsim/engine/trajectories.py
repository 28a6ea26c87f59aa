"""Step all members of one scheme: choose the lane, run the kernel, name what it gathered."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibsim.engine import blocks, events, extrema, gather
from vibsim.engine.kernel import carried, kernel, observer
from vibsim.engine.stages import kept_names
from vibsim.models import Model, has_budget
from vibsim.models.base import Formula
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

    ranges: Floats
    """Least and largest value of every state, shape (case, state, 2)."""
    norms: Floats
    """``dt sum |u|`` and ``sqrt(dt sum u^2)`` over every point of every state, shape (case, state, 2)."""
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
    deviation_d2t: Floats
    """Largest absolute deviation of the energy by ``[D_2t u]``, n = 1, ..., N-1; NaN where that is the own velocity."""
    accepted_steps: Floats
    """Of a scheme that chooses its own steps; NaN of any other one."""
    force_evaluations: Floats


@dataclass(frozen=True)
class Extrema:
    """Local extrema of the position (`vibsim.engine.extrema`); the first of each kind in order of time, NaN behind.

    Arrays have the shape (case, extremum), the counts (case,).
    """

    peak_time: Floats
    """Of the parabola through three points."""
    peak: Floats
    peak_time_grid: Floats
    """Of the highest point."""
    peak_grid: Floats
    trough_time: Floats
    trough: Floats
    trough_time_grid: Floats
    trough_grid: Floats
    peak_count: Integers
    """All peaks, those for which there was no room among them."""
    trough_count: Integers


@dataclass(frozen=True)
class EventTimes:
    """The events of members of a model that has some (`vibsim.models.events`); arrays of shape (case,)."""

    event_count: Floats
    first_event_time: Floats
    """NaN where there was none."""
    last_event_time: Floats
    rest_time: Floats
    """From when on the member was at rest to the end; NaN where it moved."""


@dataclass(frozen=True)
class Series:
    """What samples have beside position and velocity; arrays of shape (case, n_samples)."""

    deviation_running: Floats
    """Largest absolute energy deviation at every step so far."""
    velocities_d2t: Floats
    """``[D_2t u]`` of every coordinate, shape (case, coordinate, n_samples); NaN at either end, and of a
    scheme whose own velocity it is."""
    deviation_d2t_running: Floats
    """Largest absolute deviation of the energy with that velocity so far; at the end that of the point before."""
    dissipated: Floats | None
    """Sum of the power that damping takes, over every point so far; None of a model without such forces."""
    driven: Floats | None
    """Sum of the power that driving forces put in."""


@dataclass(frozen=True)
class Trajectories:
    """What one scheme computed for every member."""

    states: Floats
    """In the order of `Model.states`, shape (state, case, n_samples); NaN from where a member failed."""
    last_step: Integers
    """Last step with finite values, shape (case,): the number of steps where nothing failed."""
    gathered: Gathered | None
    """None where nothing was to be gathered."""
    series: Series | None = None
    """None where they were not asked for."""
    extrema: Extrema | None = None
    events: EventTimes | None = None
    """None for a smooth model, and where nothing was to be gathered."""

    @property
    def position(self) -> Floats:
        """Position of the first coordinate, shape (case, n_samples)."""
        return np.asarray(self.states[0])

    @property
    def velocity(self) -> Floats:
        """Velocity of the first coordinate."""
        return np.asarray(self.states[len(self.states) // 2])


def lane_for(members: int, steps: int, *, implicit: bool = False) -> str:
    """Choose the lane from the size of the work; the bits are the same in every lane.

    An implicit step iterates as often as its member needs, which no vector instruction can; nor can it a step that an
    event of the member divides, the step of several coordinates, or a table looked up at a place of the member, for
    which `implicit` stands as well.
    """
    if members * steps <= PLAIN_MEMBER_STEPS:
        return "plain"
    return "blocks" if members > 1 and not implicit else "scalar"


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
    with_series: bool = False,
    n_extrema: int = 0,
) -> Trajectories:
    """Step every member from t = 0.

    Parameters
    ----------
    parameters
        In the order of `model.parameters`, shape (case, n_parameters).
    initial
        All positions and then all velocities, shape (case, state).
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
    with_series
        Whether samples have more than position and velocity.
    n_extrema
        How many peaks and troughs of a member are kept.

    Raises
    ------
    SimulationError
        Where the kernel cannot be compiled.
    ValueError
        Where there are not as many parameters as the model has, or not an initial value of every state.
    """
    members = len(dt)
    # what is tabulated stands behind the parameters
    if parameters.shape[1] < len(model.parameters):
        known = len(model.parameters)
        raise ValueError(f"{model.kind} has {known} parameters, not {parameters.shape[1]}")
    if initial.shape != (members, len(model.states)):
        wanted = (members, len(model.states))
        raise ValueError(
            f"initial values of {model.kind} have the shape {wanted}, not {initial.shape}"
        )
    stepper = scheme.stepper_for(model, options)
    has_events = model.events is not None
    count = model.coordinates
    alone = stepper.implicit or has_events or count > 1 or model.lookup is not None
    lane = lane or lane_for(members, steps, implicit=alone)
    run = kernel(model, stepper, lane, with_gathered, with_series, n_extrema > 0)
    rows = gather.n_sample_rows(count, with_series, stepper.own_velocity, has_budget(model))
    samples = np.full((rows, members, steps // every + 1), np.nan)
    columns = events.N_STATS_EVENTS if has_events else count * gather.N_STATS
    stats = np.full((members, columns if with_gathered else 0), np.nan)
    columns = extrema.N_COUNTS_KEPT if n_extrema else gather.N_COUNTS
    counts = np.zeros((members, columns), dtype=np.int64)
    kept = np.full((extrema.N_KEPT, members if n_extrema else 0, n_extrema), np.nan)
    parameters = _scaled(model, stepper, parameters, dt)
    arrays = (parameters, _table(model), initial, dt)
    numbers = [np.ascontiguousarray(array, dtype=float) for array in arrays]
    scratch = (
        _scratch(model, stepper, parameters.shape[1], n_extrema > 0) if lane == "blocks" else 0
    )
    end_rule, turn = END_RULES.index(stepper.end), model.turn or 0.0

    def task(first: int) -> None:
        stop = min(first + (TASK if threads > 1 else members), members)
        run(*numbers, first, stop, steps, every, stepper.variant, end_rule, turn, samples, stats, counts, kept, _aligned(scratch))  # fmt: skip # noqa: E501

    _share(task, range(0, members, TASK) if threads > 1 else range(1), threads)
    return Trajectories(
        states=samples[: 2 * count],
        last_step=counts[:, gather.LAST_STEP],
        gathered=_name(stats, counts, count) if with_gathered else None,
        series=_series(samples, count, has_budget(model)) if with_series else None,
        extrema=_extrema(kept, counts) if n_extrema else None,
        events=_events(stats) if has_events and with_gathered else None,
    )


def _scratch(model: Model, stepper: Stepper, n_parameters: int, with_peaks: bool) -> int:
    """Return how many floats of scratch memory a block needs."""
    n_kept = len(kept_names(stepper.step))
    n_rows = blocks.n_rows(carried(stepper, model), n_parameters, with_peaks, n_kept)
    return n_rows * blocks.LANES


def _scaled(model: Model, stepper: Stepper, parameters: Floats, dt: Floats) -> Floats:
    """Put the factors of `Stepper.scaling` behind the parameters of every member."""
    if stepper.scaling is None:
        return parameters
    named = {row.key: parameters[:, i] for i, row in enumerate(model.parameters)}
    factors = stepper.scaling(np.broadcast_to(model.natural_frequency(named), dt.shape) * dt)
    return np.column_stack([parameters, *factors])


def _table(model: Model) -> Floats:
    """Return what formulas of the model look up, shape (row, point)."""
    return _NO_TABLE if model.lookup is None else model.lookup.table.rows


_NOTHING, _NO_TABLE = np.empty(0), np.empty((0, 0))


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
    states: Floats,
    *,
    lane: str,
) -> tuple[Floats, Floats]:
    """Return kinetic and potential energy at the samples of `integrate`, shape (case, n_samples); see `observed`."""
    formulas = (model.kinetic_energy, model.potential_energy)
    kinetic, potential = observed(model, formulas, parameters, dt, every, states, lane=lane)
    return kinetic, potential


def observed(
    model: Model,
    formulas: tuple[Formula, ...],
    parameters: Floats,
    dt: Floats,
    every: int,
    states: Floats,
    *,
    lane: str,
) -> Floats:
    """Return formulas of a model at the samples of `integrate`, shape (formula, case, n_samples).

    Parameters
    ----------
    states
        As `Trajectories.states`.

    Raises
    ------
    SimulationError
        Where the kernel cannot be compiled.
    """
    samples = np.ascontiguousarray(states)
    found = np.empty((len(formulas), *samples.shape[1:]))
    numbers = (
        np.ascontiguousarray(array, dtype=float) for array in (parameters, _table(model), dt)
    )
    run = observer(model, formulas, "plain" if lane == "plain" else "scalar")
    run(*numbers, every, 0, samples, found)
    return found


def _columns(coordinates: int, position: Sequence[int], velocity: Sequence[int]) -> Integers:
    """Return the columns of what is gathered of every state, shape (state, number)."""
    firsts = gather.N_STATS * np.arange(coordinates)[:, None]
    return np.concatenate([firsts + np.array(position), firsts + np.array(velocity)])


_RANGES = (gather.POSITION_MIN, gather.POSITION_MAX), (gather.VELOCITY_MIN, gather.VELOCITY_MAX)
_NORMS = (gather.POSITION_L1, gather.POSITION_L2), (gather.VELOCITY_L1, gather.VELOCITY_L2)


def _name(stats: Floats, counts: Integers, coordinates: int) -> Gathered:
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
        ranges=stats[:, _columns(coordinates, *_RANGES)],
        norms=stats[:, _columns(coordinates, *_NORMS)],
        deviation=stats[:, gather.DEVIATION],
        deviation_interior=stats[:, gather.DEVIATION_INTERIOR],
        period=np.where(spinning, of_turn, of_peak),
        period_grid=np.where(swinging, on_grid, np.nan),
        period_count=np.where(spinning, turns, np.where(swinging, peaks, 0)),
        first_peak=stats[:, gather.FIRST_PEAK],
        last_peak=stats[:, gather.LAST_PEAK],
        last_trough=stats[:, gather.LAST_TROUGH],
        deviation_d2t=_storable(stats[:, gather.DEVIATION_D2T]),
        accepted_steps=np.full(len(stats), np.nan),
        force_evaluations=np.full(len(stats), np.nan),
    )


def _events(stats: Floats) -> EventTimes:
    return EventTimes(
        event_count=stats[:, events.EVENT_COUNT],
        first_event_time=stats[:, events.FIRST_EVENT],
        last_event_time=stats[:, events.LAST_EVENT],
        rest_time=stats[:, events.REST_TIME],
    )


def _series(samples: Floats, coordinates: int, with_work: bool) -> Series:
    rows = gather.sample_rows(coordinates)
    nothing = np.broadcast_to(np.nan, samples.shape[1:])

    def row(number: int) -> Floats:
        return samples[number] if number < len(samples) else nothing

    first = rows["VELOCITY_D2T_ROW"]
    velocities = [row(first + i) for i in range(coordinates)]
    return Series(
        deviation_running=row(rows["RUNNING_ROW"]),
        velocities_d2t=np.stack(velocities, 1) if coordinates > 1 else velocities[0][:, None],
        deviation_d2t_running=_storable(row(rows["RUNNING_D2T_ROW"])),
        dissipated=samples[rows["DISSIPATED_ROW"]] if with_work else None,
        driven=samples[rows["DRIVEN_ROW"]] if with_work else None,
    )


def _storable(energy: Floats) -> Floats:
    """Return NaN for an energy that is too large: ``[D_2t u]`` may be so where neither point has failed."""
    return np.where(np.isfinite(energy), energy, np.nan)


def _extrema(kept: Floats, counts: Integers) -> Extrema:
    trough = kept[extrema.OF_A_KIND :]
    return Extrema(
        peak_time=kept[extrema.TIME],
        peak=kept[extrema.HEIGHT],
        peak_time_grid=kept[extrema.TIME_GRID],
        peak_grid=kept[extrema.HEIGHT_GRID],
        trough_time=trough[extrema.TIME],
        trough=trough[extrema.HEIGHT],
        trough_time_grid=trough[extrema.TIME_GRID],
        trough_grid=trough[extrema.HEIGHT_GRID],
        peak_count=counts[:, extrema.PEAK_COUNT],
        trough_count=counts[:, extrema.TROUGH_COUNT],
    )
