"""An extremum of a motion at each level, at an event or interpolated between grid points, and its error."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from vibsim.comparison import value_numbers
from vibsim.comparison.largest_between_samples import (
    WIDTH,
    Heights,
    crest_heights,
    largest_between_samples,
    rise_of_other_crests,
)
from vibsim.comparison.rescaled_differences import error_factor
from vibsim.comparison.thresholds import ERROR_OF_LINE
from vibsim.convergence.extrapolation.thresholds import ORDER_ABOVE_ROUND_OFF
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER
from vibsim.observe.member_block import MemberBlock

_UPWARD = {"min": np.negative, "max": np.positive, "max_abs": np.abs}
"""Functions that turn an extremum of a series into its largest value."""
Series = dict[int, Floats]
"""Series by the index of their level, shape (scheme x case, t)."""


def extremum_of_levels(
    name: str,
    place: value_numbers.Place,
    over_points: Floats,
    floor: Floats,
    size: Floats,
    order: Floats,
) -> tuple[Floats, Floats, Flags]:
    """Return an extremum at each level, a bound of its error at the finest one, and where it has the motion's order.

    It has that order at an event that all levels locate, and where the motion is smooth. Elsewhere it is the extremum
    over grid points: without a series, near a velocity that events change, and where all levels have the same value and
    the interpolated series does not exceed it.

    Parameters
    ----------
    name
        ``min``, ``max`` or ``max_abs``.
    over_points
        The extremum over the grid points, shape (scheme, case, level); `floor` is its round-off.
    size
        Size of the solution, shape (scheme, case).
    order
        Order of convergence of the extremum, shape (scheme, case).
    """
    noise = ORDER_ABOVE_ROUND_OFF * floor[..., -1]
    rise = _rise_after_start(name, place, over_points[..., -1], noise)
    series = _upward(name, place)
    is_apart, reach = _beside_impacts(series, place)
    error = _error_over_points(place, over_points, noise, size, (rise == 0.0) & is_apart)
    # without a frequency the motion between points is known by its largest change from one to the next
    error = np.where(np.isnan(error) & _is_struck(place.block), reach, error)
    smooth, error_smooth = _between_points(name, series, over_points)
    # all levels may miss a crest in the first step
    is_missed = np.abs(smooth[..., -1] - over_points[..., -1]) <= noise
    error_smooth = error_smooth + np.where(is_missed, rise, 0.0)
    is_smooth = (error > 0.0) | (np.abs(smooth[..., -1] - over_points[..., -1]) > error_smooth)
    is_smooth = np.where(_is_struck(place.block), error_smooth < error, is_smooth)
    is_smooth = is_smooth & np.isfinite(error_smooth) & ~place.block.adaptive[:, None]
    values = np.where(is_smooth[..., None], smooth, over_points)
    error = np.where(is_smooth, error_smooth, error) + _rise_between_points(series, place, order)
    at_events, rise, is_event = _at_events(name, place, over_points, order)
    values = np.where(is_event[..., None], at_events, values)
    return values, np.where(is_event, rise, error), is_smooth | is_event


def _upward(name: str, place: value_numbers.Place) -> Series:
    """Return the series of all levels with enough samples, transformed so that the extremum is the largest value."""
    series_of_levels = {}
    for i, level in enumerate(place.levels):
        record = place.block.records[level]
        if place.quantity in record and np.shape(record[place.quantity])[-1] >= WIDTH:
            series = np.asarray(record[place.quantity], dtype=np.float64)
            series_of_levels[i] = _UPWARD[name](series).reshape(-1, series.shape[-1])
    return series_of_levels


def _is_struck(block: MemberBlock) -> Flags:
    """Mark members whose velocity events change, shape (scheme, case)."""
    events = block.model.events
    return np.logical_not(block.eventless) & (events is not None and events.jumps)


def _rise_after_start(
    name: str, place: value_numbers.Place, value: Floats, noise: Floats
) -> Floats:
    """Return how far a position can move beyond an extremum that is its start; 0 elsewhere, shape (scheme, case).

    If its velocity changes sign within the first step, it moves at most half a step at the initial velocity.
    """
    model, data = place.block.model, place.block.finest
    speed = dict(zip(model.positions, model.velocities, strict=True)).get(place.quantity, "")
    if speed not in data or place.quantity not in data:
        return np.zeros(value.shape)
    start, slope = (np.asarray(data[q][..., 0]) for q in (place.quantity, speed))
    outward = slope * {"min": -1.0, "max": 1.0, "max_abs": np.sign(start)}[name]
    with np.errstate(invalid="ignore"):
        at_start = np.abs(np.abs(value) - np.abs(start)) <= noise
        return np.where(at_start & (outward > 0.0), 0.5 * place.block.grid.dt[-1] * outward, 0.0)


def _beside_impacts(series: Series, place: value_numbers.Place) -> tuple[Flags, Floats]:
    """Mark extrema that no motion from a sample beside an impact reaches, and return the largest change in a step.

    Shapes (scheme, case). Without a series none is marked, and the change is infinite.
    """
    record, finest = place.block.finest, len(place.levels) - 1
    events, velocities = place.block.model.events, place.block.model.velocities
    # a motion that ends stays where it ends, which points see
    is_smooth = ~(_is_struck(place.block) & bool(events and events.changed(velocities)))
    if finest not in series or "event_time" not in record:
        return is_smooth, np.full(place.block.shape, np.inf)
    times = np.asarray(record["event_time"])
    rows = series[finest].reshape(*times.shape[:-1], -1)
    where = times / place.block.group.end[:, None] * (rows.shape[-1] - 1)
    before = np.clip(np.nan_to_num(where), 0, rows.shape[-1] - 2).astype(np.int64)
    beside = np.maximum(*(np.take_along_axis(rows, before + k, -1) for k in (0, 1)))
    beside = np.max(np.where(np.isnan(times), -np.inf, beside), axis=-1, initial=-np.inf)
    is_whole = np.asarray(record["event_count"]) <= times.shape[-1]
    reach = np.max(np.abs(np.diff(rows, axis=-1)), axis=-1)
    return is_smooth | (is_whole & (beside + reach < np.max(rows, axis=-1))), reach


def _error_over_points(
    place: value_numbers.Place, values: Floats, noise: Floats, size: Floats, may_be_whole: Flags
) -> Floats:
    """Return a bound of how much grid points miss of an extremum: ``w^2 dt^2/8`` of its size.

    If impacts change a velocity, a state turns abruptly, and the bound is ``w dt``. The missed part varies irregularly
    between levels, so extrapolation cannot remove it. Nothing is missed if the levels have the same value where it
    `may_be_whole`: not at a start beyond which the position moves, nor near an impact, beside which they share a point.
    """
    w_dt = np.minimum(place.block.omega_dt[:, -1], 1.0)
    changes = np.abs(np.diff(values[..., -3:], axis=-1))
    with np.errstate(invalid="ignore"):
        is_constant = np.all(changes <= noise[..., None], axis=-1) & may_be_whole
    missed_share = np.where(_is_struck(place.block), w_dt, ERROR_OF_LINE * w_dt**2)
    return np.where(is_constant, 0.0, missed_share * size)


def _between_points(name: str, series: Series, over_points: Floats) -> tuple[Floats, Floats]:
    """Return an extremum between the grid points at each level, and a bound of its error at the finest one.

    Shapes (scheme, case, level) and (scheme, case). The bound is NaN without a series. A level with too few samples
    keeps its value over the grid points.
    """
    values, errors = over_points.copy(), np.full(over_points.shape, np.nan)
    if series:
        largest, error = largest_between_samples(list(series.values()))
        shape, levels = (*over_points.shape[:-1], -1), list(series)
        values[..., levels] = (-1.0 if name == "min" else 1.0) * largest.reshape(shape)
        errors[..., levels] = error.reshape(shape)
    # extrapolation uses the second finest level, too
    last = errors[..., -2:]
    return values, np.where(np.isnan(last[..., -1]), np.nan, np.fmax.reduce(last, axis=-1))


def _rise_between_points(series: Series, place: value_numbers.Place, order: Floats) -> Floats:
    """Return by how much another extremum may exceed that of the finest level in the limit, (scheme, case)."""
    count = len(place.levels)
    finest = [i for i in range(count - LEVELS_OF_AN_ORDER, count) if i in series]
    if not {count - 2, count - 1} <= set(finest):
        return np.zeros(order.shape)
    known = (np.nan_to_num(series[i], posinf=0.0, neginf=0.0) for i in finest)
    return _rise([crest_heights(values) for values in known], place, order)


def _rise(heights: Sequence[Heights], place: value_numbers.Place, order: Floats) -> Floats:
    """Return the rise of other extrema from the heights of all at the finest levels, two or three."""
    finest = place.levels[-len(heights) :]
    falls = [
        np.where(
            np.isfinite(order), -1.0 - error_factor(np.maximum(order, 1.0), fine - coarse), 0.0
        )
        for coarse, fine in itertools.pairwise(finest)
    ]
    return rise_of_other_crests(heights, [fall.reshape(-1) for fall in falls]).reshape(order.shape)


def _at_events(
    name: str, place: value_numbers.Place, over_points: Floats, order: Floats
) -> tuple[Floats, Floats, Flags]:
    """Return the extremum at located events at each level, the rise of others, and where it is that of the motion.

    A body turns at an event, or rests behind it to the end.
    """
    block, records = place.block, [place.block.records[level] for level in place.levels]
    nowhere = over_points, np.zeros(order.shape), np.zeros(order.shape, dtype=bool)
    if place.quantity != block.model.position or len(records) < LEVELS_OF_AN_ORDER:
        return nowhere
    if not all({"event_time", "peak", place.quantity} <= set(row.variables) for row in records):
        return nowhere
    is_event = np.isnan(block.left_to_the_mesh) & ~block.adaptive[:, None]
    values, heights, upward = over_points.copy(), [], _UPWARD[name]
    for i, row in enumerate(records):
        times, turns = _turns(name, row)
        rest_time = np.asarray(row["rest_time"])[..., None]
        rest = np.where(np.isnan(rest_time), -np.inf, upward(row[place.quantity][..., -1:]))
        highest = np.argmax(turns, axis=-1)[..., None]
        at = np.take_along_axis(times, highest, -1)
        is_located = np.any(at == row["event_time"], axis=-1)
        top = np.take_along_axis(turns, highest, -1)[..., 0]
        top = np.maximum(np.where(is_located, top, -np.inf), rest[..., 0])
        with np.errstate(invalid="ignore"):
            is_event &= top >= np.maximum(upward(over_points[..., i]), turns.max(axis=-1))
        values[..., i] = upward(top) if name == "min" else top
        times, turns = np.append(times, rest_time, axis=-1), np.append(turns, rest, axis=-1)
        heights.append(_sorted(times / block.group.end[:, None], turns))
    return values, _rise(heights[-LEVELS_OF_AN_ORDER:], place, order), is_event


def _turns(name: str, record: Record) -> tuple[Floats, Floats]:
    """Return times and upward heights of the stored turns, -inf behind the last, shape (scheme, case, turn)."""
    kinds = {"max": ("peak",), "min": ("trough",), "max_abs": ("peak", "trough")}[name]
    times, heights = (
        np.concatenate([record[f"{kind}{what}"] for kind in kinds], axis=-1)
        for what in ("_time", "")
    )
    return times, np.where(np.isnan(heights), -np.inf, _UPWARD[name](heights))


def _sorted(places: Floats, heights: Floats) -> Heights:
    """Return the finite heights of all members in the order of their places, which are parts of the run."""
    row = np.arange(heights[..., 0].size).reshape(heights[..., :1].shape)
    keys = (2.0 * row + places)[np.isfinite(heights)]
    order = np.argsort(keys, kind="stable")
    return Heights(keys[order], heights[np.isfinite(heights)][order])
