"""Results of the integration of a scheme, constructed from the arrays that kernels fill."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Floats, Integers
from vibsim.engine import events, extrema, gather


@dataclass(frozen=True)
class Gathered:
    """Statistics over all steps of one scheme; arrays of shape (case,) unless stated."""

    ranges: Floats
    """Least and largest value of every state, shape (case, state, 2)."""
    norms: Floats
    """``dt sum |u|`` and ``sqrt(dt sum u^2)`` over every point of every state, shape (case, state, 2)."""
    deviation: Floats
    """Largest absolute energy deviation."""
    deviation_interior: Floats
    """The same without the last point."""
    period: Floats
    """Mean time between peaks, or mean time of a turn if the member rotates; NaN if less than one period was seen."""
    period_grid: Floats
    """Mean time between peaks at grid points; NaN if there are fewer than two or the member rotates."""
    period_count: Integers
    first_peak: Floats
    last_peak: Floats
    last_trough: Floats
    deviation_d2t: Floats
    """Largest absolute deviation of the energy by ``[D_2t u]``, n = 1, ..., N-1; NaN if it is the scheme's velocity."""
    accepted_steps: Floats
    """Number of accepted steps of an adaptive scheme; NaN for any other."""
    force_evaluations: Floats


@dataclass(frozen=True)
class Extrema:
    """The first local extrema of the position (`vibsim.engine.extrema`), in order of time, padded with NaN.

    Arrays have the shape (case, extremum), counts (case,); fields are in the order of the rows that kernels fill.
    """

    peak_time: Floats
    """Time of the vertex of the parabola through three points."""
    peak: Floats
    peak_time_grid: Floats
    """Time of the highest grid point."""
    peak_grid: Floats
    trough_time: Floats
    trough: Floats
    trough_time_grid: Floats
    trough_grid: Floats
    peak_count: Integers
    """Number of all peaks, including those that did not fit."""
    trough_count: Integers


@dataclass(frozen=True)
class EventTimes:
    """Events of members (`vibsim.models.events`); arrays of shape (case,) unless noted."""

    event_count: Floats
    """Number of all events, including those whose times did not fit."""
    first_event_time: Floats
    """NaN if there was no event."""
    last_event_time: Floats
    rest_time: Floats
    """Time since when the member is at rest at the end; NaN if it moves."""
    event_time: Floats
    """Times of the first events, padded with NaN, shape (case, event)."""


@dataclass(frozen=True)
class Series:
    """Further samples beside position and velocity; arrays of shape (case, n_samples)."""

    deviation_running: Floats
    """Largest absolute energy deviation over all steps so far."""
    velocities_d2t: Floats
    """``[D_2t u]`` of every coordinate, shape (case, coordinate, n_samples); NaN at either end, and if it is the
    scheme's velocity."""
    deviation_d2t_running: Floats
    """Largest absolute deviation of the energy with that velocity so far; at the end, up to the previous point."""
    dissipated: Floats | None
    """Sum of the power of damping over all points so far; with events, its work. None without forces and events."""
    driven: Floats | None
    """The same of driving forces."""
    lost: Floats | None
    """Cost of sliding or impacts so far, in units of ``cost`` (`vibsim.models.events`); None without events."""


@dataclass(frozen=True)
class Trajectories:
    """Results of one scheme for every member."""

    states: Floats
    """In the order of `Model.states`, shape (state, case, n_samples); NaN from where a member failed."""
    last_step: Integers
    """Last step with finite values, shape (case,); equal to the number of steps if nothing failed."""
    gathered: Gathered | None
    """None if nothing was gathered."""
    series: Series | None = None
    """None if not requested, as are extrema."""
    extrema: Extrema | None = None
    events: EventTimes | None = None
    """None for a smooth model, or if nothing was gathered."""
    energies: Floats | None = None
    """Kinetic and potential energy, shape (case, 2, n_samples); None if they follow from the states."""

    @property
    def position(self) -> Floats:
        """Position of the first coordinate, shape (case, n_samples)."""
        return np.asarray(self.states[0])

    @property
    def velocity(self) -> Floats:
        """Velocity of the first coordinate."""
        return np.asarray(self.states[len(self.states) // 2])


def gathered_of(stats: Floats, counts: Integers, dt: Floats, coordinates: int) -> Gathered:
    """Return the statistics from the arrays of a kernel, shapes (case, column of `vibsim.engine.gather`)."""
    peaks, turns = counts[:, gather.PEAKS] - 1, counts[:, gather.TURNS] - 1
    rotates = turns > 0
    oscillates = (peaks > 0) & ~rotates

    def mean_time(first: int, last: int, intervals: Integers) -> Floats:
        span = np.where(intervals > 0, stats[:, last] - stats[:, first], np.nan)
        return np.asarray(span / np.maximum(intervals, 1))

    def of_states(first: int) -> Floats:
        """Return two columns of the position and two of the velocity of every coordinate, shape (case, state, 2)."""
        columns = gather.N_STATS * np.arange(coordinates)[:, None] + first + np.arange(4)
        pairs = stats[:, columns].reshape(len(stats), coordinates, 2, 2)
        return pairs.swapaxes(1, 2).reshape(len(stats), 2 * coordinates, 2)

    of_turn = mean_time(gather.FIRST_TURN_TIME, gather.LAST_TURN_TIME, turns)
    of_peak = mean_time(gather.FIRST_PEAK_TIME, gather.LAST_PEAK_TIME, peaks)
    on_grid = mean_time(gather.FIRST_PEAK_TIME_GRID, gather.LAST_PEAK_TIME_GRID, peaks)
    # l1 = dt sum |u|, l2 = sqrt(dt sum u^2) over all points including t = 0 (B, section 4.4)
    norms = dt[:, None, None] * of_states(gather.POSITION_SUM)
    norms[..., 1] = np.sqrt(norms[..., 1])
    return Gathered(
        ranges=of_states(gather.POSITION_MIN),
        norms=norms,
        deviation=stats[:, gather.DEVIATION],
        deviation_interior=stats[:, gather.DEVIATION_INTERIOR],
        period=np.where(rotates, of_turn, of_peak),
        period_grid=np.where(oscillates, on_grid, np.nan),
        period_count=np.where(rotates, turns, np.where(oscillates, peaks, 0)),
        first_peak=stats[:, gather.FIRST_PEAK],
        last_peak=stats[:, gather.LAST_PEAK],
        last_trough=stats[:, gather.LAST_TROUGH],
        deviation_d2t=_storable(stats[:, gather.DEVIATION_D2T]),
        accepted_steps=np.full(len(stats), np.nan),
        force_evaluations=np.full(len(stats), np.nan),
    )


def extrema_of(kept: Floats, counts: Integers) -> Extrema:
    """Return the extrema from the arrays of a kernel, rows and columns of `vibsim.engine.extrema`."""
    return Extrema(*kept, *counts[:, [extrema.PEAK_COUNT, extrema.TROUGH_COUNT]].T)


def event_times_of(stats: Floats, coordinates: int) -> EventTimes:
    """Return the events from the array of a kernel, shape (case, column of `vibsim.engine.events`)."""
    columns = events.columns(coordinates)
    return EventTimes(
        event_count=stats[:, columns["EVENT_COUNT"]],
        first_event_time=stats[:, columns["FIRST_EVENT"]],
        last_event_time=stats[:, columns["LAST_EVENT"]],
        rest_time=stats[:, columns["REST_TIME"]],
        event_time=stats[:, columns["N_STATS_EVENTS"] :],
    )


def series_of(samples: Floats, coordinates: int, with_work: bool, with_events: bool) -> Series:
    """Return the series from the further rows of samples, shape (row, case, n_samples)."""
    index = gather.sample_rows(coordinates)
    # kernels omit trailing rows that they do not use
    missing = np.broadcast_to(np.nan, samples.shape[1:])
    rows = [*samples, *[missing] * (index["LOST_ROW"] + 1 - len(samples))]
    first = index["VELOCITY_D2T_ROW"]
    velocities = rows[first : first + coordinates]
    return Series(
        deviation_running=rows[index["RUNNING_ROW"]],
        velocities_d2t=np.stack(velocities, 1) if coordinates > 1 else velocities[0][:, None],
        deviation_d2t_running=_storable(rows[index["RUNNING_D2T_ROW"]]),
        dissipated=rows[index["DISSIPATED_ROW"]] if with_work else None,
        driven=rows[index["DRIVEN_ROW"]] if with_work else None,
        lost=rows[index["LOST_ROW"]] if with_work and with_events else None,
    )


def _storable(energy: Floats) -> Floats:
    """Replace infinite energies by NaN: ``[D_2t u]`` may be too large even if neither point has failed."""
    return np.where(np.isfinite(energy), energy, np.nan)
