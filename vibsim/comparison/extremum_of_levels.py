"""An extremum of a motion at every level: between the grid points where the motion is smooth, and how far it is off."""

from __future__ import annotations

import numpy as np

from vibsim.comparison import value_numbers
from vibsim.comparison.largest_between_samples import (
    WIDTH,
    largest_between_samples,
    rise_of_other_crests,
)
from vibsim.comparison.thresholds import OF_A_LINE
from vibsim.convergence.differences import error_factor
from vibsim.convergence.thresholds import ORDER_ABOVE_ROUND_OFF
from vibsim.core.array_types import Flags, Floats
from vibsim.observe.member_block import MemberBlock

_UPWARD = {"min": np.negative, "max": np.positive, "max_abs": np.abs}
"""What turns an extremum of a series into its largest value."""
Series = dict[int, Floats]
"""Of levels, by their positions, whose largest values are sought, shape (scheme x case, t)."""


def extremum_of_levels(
    name: str,
    place: value_numbers.Place,
    over_points: Floats,
    floor: Floats,
    size: Floats,
    order: Floats,
) -> tuple[Floats, Floats, Flags]:
    """Return an extremum at every level, how far it is off at the finest one, and where it is that of a smooth motion.

    Elsewhere it stays that over grid points: without a series, near a velocity that events change, and where levels
    with the same number have met it, which the series does not pass.

    Parameters
    ----------
    name
        ``min``, ``max`` or ``max_abs``.
    over_points
        The extremum over the grid points, shape (scheme, case, level), as its `floor`.
    size
        Of the solution, shape (scheme, case).
    order
        With which the extremum converges, shape (scheme, case).
    """
    near = ORDER_ABOVE_ROUND_OFF * floor[..., -1]
    rise = _rise_after_start(name, place, over_points[..., -1], near)
    error = _error_over_points(place, over_points, near, size, rise)
    series = _upward(name, place)
    smooth, error_smooth = _between_points(name, series, over_points)
    # a scheme may miss a crest in the first step at all levels
    is_missed = np.abs(smooth[..., -1] - over_points[..., -1]) <= near
    error_smooth = error_smooth + np.where(is_missed, rise, 0.0)
    is_smooth = (error > 0.0) | (np.abs(smooth[..., -1] - over_points[..., -1]) > error_smooth)
    is_smooth = np.where(_is_struck(place.block), error_smooth < error, is_smooth)
    is_smooth = is_smooth & np.isfinite(error_smooth) & ~place.block.adaptive[:, None]
    found = np.where(is_smooth[..., None], smooth, over_points)
    other = _rise_of_other_crests(series, place.levels, order)
    return found, np.where(is_smooth, error_smooth, error) + other, is_smooth


def _upward(name: str, place: value_numbers.Place) -> Series:
    """Return the series of the levels that have one with enough samples, turned so that the extremum is the largest."""
    found = {}
    for i, level in enumerate(place.levels):
        record = place.block.records[level]
        if place.quantity in record and np.shape(record[place.quantity])[-1] >= WIDTH:
            series = np.asarray(record[place.quantity], dtype=np.float64)
            found[i] = _UPWARD[name](series).reshape(-1, series.shape[-1])
    return found


def _is_struck(block: MemberBlock) -> Flags:
    """Mark members whose velocity events change, shape (scheme, case)."""
    events = block.model.events
    return np.logical_not(block.eventless) & (events is not None and events.jumps)


def _rise_after_start(name: str, place: value_numbers.Place, value: Floats, near: Floats) -> Floats:
    """Return how far a position moves on beyond an extremum that is its start, at most; 0 elsewhere, (scheme, case).

    A velocity that has turned within a step has led no further than half a step goes with it.
    """
    model, data = place.block.model, place.block.finest
    speed = dict(zip(model.positions, model.velocities, strict=True)).get(place.quantity, "")
    if speed not in data or place.quantity not in data:
        return np.zeros(value.shape)
    start, slope = (np.asarray(data[q][..., 0]) for q in (place.quantity, speed))
    outward = slope * {"min": -1.0, "max": 1.0, "max_abs": np.sign(start)}[name]
    with np.errstate(invalid="ignore"):
        at_start = np.abs(np.abs(value) - np.abs(start)) <= near
        return np.where(at_start & (outward > 0.0), 0.5 * place.block.grid.dt[-1] * outward, 0.0)


def _error_over_points(
    place: value_numbers.Place, values: Floats, near: Floats, size: Floats, rise: Floats
) -> Floats:
    """Return how much of an extremum lies between grid points: ``w^2 dt^2/8`` of its size at most.

    Where impacts change a velocity, a state turns without rest, and ``w dt`` may be missed. How much differs from level
    to level by accident, which no extrapolation takes away. Nothing is missed where the levels have the same number,
    unless it is that of a start from which the position moves on beyond it, by `rise`.
    """
    p = np.minimum(place.block.omega_dt[:, -1], 1.0)
    changes = np.abs(np.diff(values[..., -3:], axis=-1))
    with np.errstate(invalid="ignore"):
        same = np.all(changes <= near[..., None], axis=-1) & (rise == 0.0)
    part = np.where(_is_struck(place.block), p, OF_A_LINE * p**2)
    return np.where(same, 0.0, part * size)


def _between_points(name: str, series: Series, over_points: Floats) -> tuple[Floats, Floats]:
    """Return an extremum between the grid points at every level, and how far it may be off at the finest one.

    Shapes (scheme, case, level) and (scheme, case). The bound is NaN where there is no series. A level with too few
    samples keeps its value over the grid points.
    """
    found, errors = over_points.copy(), np.full(over_points.shape, np.nan)
    if series:
        largest, error = largest_between_samples(list(series.values()))
        shape, levels = (*over_points.shape[:-1], -1), list(series)
        found[..., levels] = (-1.0 if name == "min" else 1.0) * largest.reshape(shape)
        errors[..., levels] = error.reshape(shape)
    # the limit is made of the level before the finest, too
    two = errors[..., -2:]
    return found, np.where(np.isnan(two[..., -1]), np.nan, np.fmax.reduce(two, axis=-1))


def _rise_of_other_crests(series: Series, levels: tuple[int, ...], order: Floats) -> Floats:
    """Return how much larger another extremum than that of the finest level may be in the limit, (scheme, case)."""
    finest = len(levels) - 1
    if not {finest - 1, finest} <= set(series):
        return np.zeros(order.shape)
    coarse, fine = (np.nan_to_num(series[i], posinf=0.0, neginf=0.0) for i in (finest - 1, finest))
    gap = levels[finest] - levels[finest - 1]
    fall = np.where(np.isfinite(order), -1.0 - error_factor(np.maximum(order, 1.0), gap), 0.0)
    return rise_of_other_crests(coarse, fine, fall.reshape(-1)).reshape(order.shape)
