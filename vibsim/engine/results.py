"""What the integration of a scheme gives, and its making from the arrays that kernels fill."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Floats, Integers
from vibsim.engine import events, extrema, gather


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

    Arrays have the shape (case, extremum), the counts (case,); in the order of the rows that kernels fill.
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
    """The events of members of a model that has some (`vibsim.models.events`); arrays of shape (case,) unless noted."""

    event_count: Floats
    """All events, those for whose times there was no room among them."""
    first_event_time: Floats
    """NaN where there was none."""
    last_event_time: Floats
    rest_time: Floats
    """From when on the member was at rest to the end; NaN where it moved."""
    event_time: Floats
    """Times of the first events, NaN behind the last, shape (case, event)."""


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
    """Sum of the power that driving forces put in; of a model with events their work."""
    lost: Floats | None
    """What sliding or impacts have cost so far, in units of ``cost`` (`vibsim.models.events`); None of other models."""


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
    energies: Floats | None = None
    """Kinetic and potential energy, shape (case, 2, n_samples), where states do not tell them; None where they do."""

    @property
    def position(self) -> Floats:
        """Position of the first coordinate, shape (case, n_samples)."""
        return np.asarray(self.states[0])

    @property
    def velocity(self) -> Floats:
        """Velocity of the first coordinate."""
        return np.asarray(self.states[len(self.states) // 2])


def gathered_of(stats: Floats, counts: Integers, dt: Floats, coordinates: int) -> Gathered:
    """Name what a kernel gathered: shapes (case, column of `vibsim.engine.gather`)."""
    peaks, turns = counts[:, gather.PEAKS] - 1, counts[:, gather.TURNS] - 1
    spinning = turns > 0
    swinging = (peaks > 0) & ~spinning

    def mean_time(first: int, last: int, intervals: Integers) -> Floats:
        span = np.where(intervals > 0, stats[:, last] - stats[:, first], np.nan)
        return np.asarray(span / np.maximum(intervals, 1))

    def of_states(first: int) -> Floats:
        """Return two columns of the position and two of the velocity of every coordinate, shape (case, state, 2)."""
        columns = gather.N_STATS * np.arange(coordinates)[:, None] + first + np.arange(4)
        found = stats[:, columns].reshape(len(stats), coordinates, 2, 2)
        return found.swapaxes(1, 2).reshape(len(stats), 2 * coordinates, 2)

    of_turn = mean_time(gather.FIRST_TURN_TIME, gather.LAST_TURN_TIME, turns)
    of_peak = mean_time(gather.FIRST_PEAK_TIME, gather.LAST_PEAK_TIME, peaks)
    on_grid = mean_time(gather.FIRST_PEAK_TIME_GRID, gather.LAST_PEAK_TIME_GRID, peaks)
    # l1 = dt sum |u|, l2 = sqrt(dt sum u^2) over every point from t = 0 on (B, section 4.4)
    norms = dt[:, None, None] * of_states(gather.POSITION_SUM)
    norms[..., 1] = np.sqrt(norms[..., 1])
    return Gathered(
        ranges=of_states(gather.POSITION_MIN),
        norms=norms,
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


def extrema_of(kept: Floats, counts: Integers) -> Extrema:
    """Name the extrema that a kernel kept: rows and columns of `vibsim.engine.extrema`."""
    return Extrema(*kept, *counts[:, [extrema.PEAK_COUNT, extrema.TROUGH_COUNT]].T)


def event_times_of(stats: Floats, coordinates: int) -> EventTimes:
    """Name what a kernel noted of events: shape (case, column of `vibsim.engine.events`)."""
    columns = events.columns(coordinates)
    return EventTimes(
        event_count=stats[:, columns["EVENT_COUNT"]],
        first_event_time=stats[:, columns["FIRST_EVENT"]],
        last_event_time=stats[:, columns["LAST_EVENT"]],
        rest_time=stats[:, columns["REST_TIME"]],
        event_time=stats[:, columns["N_STATS_EVENTS"] :],
    )


def series_of(samples: Floats, coordinates: int, with_work: bool, with_events: bool) -> Series:
    """Name the rows of samples behind the states: shape (row, case, n_samples)."""
    rows = gather.sample_rows(coordinates)
    # rows that a scheme has no use for are left out at the end
    nothing = np.broadcast_to(np.nan, samples.shape[1:])
    found = [*samples, *[nothing] * (rows["LOST_ROW"] + 1 - len(samples))]
    first = rows["VELOCITY_D2T_ROW"]
    velocities = found[first : first + coordinates]
    return Series(
        deviation_running=found[rows["RUNNING_ROW"]],
        velocities_d2t=np.stack(velocities, 1) if coordinates > 1 else velocities[0][:, None],
        deviation_d2t_running=_storable(found[rows["RUNNING_D2T_ROW"]]),
        dissipated=found[rows["DISSIPATED_ROW"]] if with_work else None,
        driven=found[rows["DRIVEN_ROW"]] if with_work else None,
        lost=found[rows["LOST_ROW"]] if with_work and with_events else None,
    )


def _storable(energy: Floats) -> Floats:
    """Return NaN for an energy that is too large: ``[D_2t u]`` may be so where neither point has failed."""
    return np.where(np.isfinite(energy), energy, np.nan)
