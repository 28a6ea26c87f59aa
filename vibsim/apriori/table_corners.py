"""Where a force that is looked up in tables has corners within steps: tables of systems and load histories alike.

Between two points such a force is a straight line. A step across a point at which the slope changes by s has an error
of the impulse of ``s dt^2/8`` at most, another part of it on each level; the sum over all such points bounds what no
level shows. Steps that end at a point have no such error there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.formula import Pulses, values
from vibsim.models import Model, tree

ON_A_POINT = 1e-6
"""Part of a step within which a corner is at its end. [convention]"""
STRAIGHT = 1e-9
"""A slope that changes by less than this part of the largest one is the rounding of a straight line. [convention]"""
PULSE_RATIO = 2.0
"""A pulse leaves the values at the grid points around it by more than so many times their range, ..."""
SMALLEST_PULSE = 1e-3
"""... and by this part of the largest force. [convention]"""


def is_on_a_point(t: Floats, dt: Floats) -> Flags:
    """Tell whether times are grid points of step dt."""
    place = t / dt
    return np.asarray(np.abs(place - np.round(place)) <= ON_A_POINT)


def has_tables(model: Model) -> bool:
    """Tell whether a force of a model is looked up in a table that may have points within steps."""
    if model.loaded is not None:
        return bool(model.loaded.structure.histories)
    return model.lookup is not None and not model.lookup.is_met


def table_corners(
    model: Model, parameters: Mapping[str, Floats], end: Floats, dt: Floats
) -> Floats:
    """Find the corners of tables within steps of length dt: the first one, and how much they turn, shape (3, case).

    That is all changes of slope together, over the largest change and over the largest force; NaN without a corner.
    `parameters` are those of the members by name, each of shape (case,), as are `end` and `dt`.
    """
    found = np.full((3, len(end)), np.nan)
    if has_tables(model):
        for case in range(len(end)):
            own = {name: x[case] for name, x in parameters.items()}
            found[:, case] = _of_member(model, own, float(end[case]), float(dt[case]))
    return found


def _of_member(
    model: Model, parameters: Mapping[str, float], end: float, dt: float
) -> tuple[float, float, float]:
    """Return what `table_corners` finds of one member."""
    first, total, sharpest, largest = np.inf, 0.0, 0.0, 0.0
    for t, force in _histories(model, parameters):
        slopes = np.diff(force) / np.diff(t)
        turns, at = np.abs(np.diff(slopes)), t[1:-1]
        is_due = (at > 0.0) & (at < end) & ~is_on_a_point(at, np.asarray(dt))
        is_due &= turns > STRAIGHT * np.max(np.abs(slopes))
        largest = max(largest, float(np.max(np.abs(force))))
        if is_due.any():
            first = min(first, float(at[is_due][0]))
            total += float(np.sum(turns[is_due]))
            sharpest = max(sharpest, float(np.max(turns[is_due])))
    return (first, total / sharpest, total / largest) if total else (np.nan, np.nan, np.nan)


def table_pulses(model: Model, parameters: Mapping[str, Floats], end: Floats, steps: int) -> Pulses:
    """Find the highest pulse of a table between the points of a level with so many steps, of every member."""
    time, width = np.full((2, len(end)), np.nan)
    for case in range(len(end) if has_tables(model) else 0):
        own, highest = {name: x[case] for name, x in parameters.items()}, 0.0
        grid = np.arange(steps + 1) * (end[case] / steps)
        for t, force in _histories(model, own):
            seen, before = np.interp(grid, t, force), np.searchsorted(grid, t[1:-1]) - 1
            around = seen[np.clip(before + np.arange(-1, 3)[:, None], 0, steps)]
            low, high = np.min(around, axis=0), np.max(around, axis=0)
            excess = np.maximum(force[1:-1] - high, low - force[1:-1])
            least = np.maximum(PULSE_RATIO * (high - low), SMALLEST_PULSE * np.max(np.abs(force)))
            is_pulse = (before >= 0) & (before < steps) & (excess > least)
            i = int(np.argmax(np.where(is_pulse, excess, 0.0)))
            if is_pulse[i] and excess[i] > highest:
                highest, time[case] = float(excess[i]), t[i + 1]
                width[case] = 0.5 * (t[i + 2] - t[i])
    return Pulses(time, width)


def _histories(model: Model, parameters: Mapping[str, float]) -> Iterator[tuple[Floats, Floats]]:
    """Yield the times of the points of every table, and the force there but for a factor that all points share."""
    if model.loaded is not None:
        own = model.loaded.structure
        for number, (t, force) in own.histories:
            # a single straight line has no corner
            if len(t) > 2:
                yield t, force * np.max(np.abs(own.shapes[number]))
    elif model.lookup is not None:
        table = model.lookup.table
        speed = float(values(tree(model, model.lookup.place), {**parameters, "t": 1.0}))
        if speed > 0.0:
            yield (
                (table.first + table.spacing * np.arange(table.points, dtype=np.float64)) / speed,
                table.bends,
            )
