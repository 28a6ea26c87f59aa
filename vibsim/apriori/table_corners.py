"""Corners inside steps of a force from tables: tables of systems, and load histories of structures.

Between two points of the table such a force is linear. A step across a point at which the slope changes by s has an
error of the impulse of at most ``s dt^2/8``, of which each level has a different fraction; the sum over all such points
bounds the error that no level shows. Steps that end at a point of the table have no such error there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.formula import Pulses, values
from vibsim.models import Model, tree

ON_A_POINT = 1e-6
"""A corner closer to a grid point than this fraction of a step is at the grid point. [convention]"""
STRAIGHT = 1e-9
"""A change of slope below this fraction of the largest slope is rounding. [convention]"""
PULSE_RATIO = 2.0
"""A pulse exceeds the values at the grid points around it by more than this multiple of their range, ..."""
SMALLEST_PULSE = 1e-3
"""... and by more than this fraction of the largest force until the end. [convention]"""


def is_on_a_point(t: Floats, dt: Floats) -> Flags:
    """Tell whether times are grid points for step dt."""
    place = t / dt
    return np.asarray(np.abs(place - np.round(place)) <= ON_A_POINT)


def has_tables(model: Model) -> bool:
    """Tell whether a model looks up its force in a table that may have points inside steps."""
    if model.loaded is not None:
        return bool(model.loaded.structure.histories)
    return model.lookup is not None and not model.lookup.is_met


def table_corners(
    model: Model, parameters: Mapping[str, Floats], end: Floats, dt: Floats
) -> Floats:
    """Return the corners of tables inside steps of length dt, shape (3, case); NaN without a corner.

    Rows: time of the first one [s], sum of all changes of slope over the largest change, and the same sum over the
    largest force until the end [1/s]. `parameters` are those of the members by name, each of shape (case,), as are
    `end` and `dt`.
    """
    corners = np.full((3, len(end)), np.nan)
    if has_tables(model):
        for case in range(len(end)):
            single = {name: x[case] for name, x in parameters.items()}
            corners[:, case] = _member_corners(model, single, float(end[case]), float(dt[case]))
    return corners


def _member_corners(
    model: Model, parameters: Mapping[str, float], end: float, dt: float
) -> tuple[float, float, float]:
    """Return a column of `table_corners`, for one member."""
    first, total, sharpest, largest = np.inf, 0.0, 0.0, 0.0
    for t, force, size in _histories(model, parameters, end):
        slopes = np.diff(force) / np.diff(t)
        turns, at = np.abs(np.diff(slopes)), t[1:-1]
        is_corner = (at > 0.0) & (at < end) & ~is_on_a_point(at, np.asarray(dt))
        is_corner &= turns > STRAIGHT * np.max(np.abs(slopes))
        largest = max(largest, size)
        if is_corner.any():
            first = min(first, float(at[is_corner][0]))
            total += float(np.sum(turns[is_corner]))
            sharpest = max(sharpest, float(np.max(turns[is_corner])))
    return (first, total / sharpest, total / largest) if total else (np.nan, np.nan, np.nan)


def table_pulses(model: Model, parameters: Mapping[str, Floats], end: Floats, steps: int) -> Pulses:
    """Find for every member the highest pulse of a table between the grid points of a level with `steps` steps."""
    time, width = np.full((2, len(end)), np.nan)
    for case in range(len(end) if has_tables(model) else 0):
        single, highest = {name: x[case] for name, x in parameters.items()}, 0.0
        grid = np.arange(steps + 1) * (end[case] / steps)
        for t, force, size in _histories(model, single, float(end[case])):
            sampled, before = np.interp(grid, t, force), np.searchsorted(grid, t[1:-1]) - 1
            around = sampled[np.clip(before + np.arange(-1, 3)[:, None], 0, steps)]
            low, high = np.min(around, axis=0), np.max(around, axis=0)
            excess = np.maximum(force[1:-1] - high, low - force[1:-1])
            least = np.maximum(PULSE_RATIO * (high - low), SMALLEST_PULSE * size)
            is_pulse = (before >= 0) & (before < steps) & (excess > least)
            i = int(np.argmax(np.where(is_pulse, excess, 0.0)))
            if is_pulse[i] and excess[i] > highest:
                highest, time[case] = float(excess[i]), t[i + 1]
                width[case] = 0.5 * (t[i + 2] - t[i])
    return Pulses(time, width)


def _histories(
    model: Model, parameters: Mapping[str, float], end: float
) -> Iterator[tuple[Floats, Floats, float]]:
    """Yield the times of the points of every table, the force there up to a common factor, and its size until `end`."""
    tables: list[tuple[Floats, Floats]] = []
    if model.loaded is not None:
        structure = model.loaded.structure
        # a single straight line has no corner
        tables += [
            (t, force * np.max(np.abs(structure.shapes[number])))
            for number, (t, force) in structure.histories
            if len(t) > 2
        ]
    elif model.lookup is not None:
        table = model.lookup.table
        speed = float(values(tree(model, model.lookup.place), {**parameters, "t": 1.0}))
        if speed > 0.0:
            place = table.first + table.spacing * np.arange(table.points, dtype=np.float64)
            tables.append((place / speed, table.bends))
    for t, force in tables:
        yield t, force, float(np.max(np.abs(np.interp(np.clip(t, 0.0, end), t, force))))
