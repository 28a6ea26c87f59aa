"""The separatrix between kinds of motion, where the exact period is unbounded, found from the model alone.

Along every line of a grid the period has a peak there. A golden-section search follows each peak: on a separatrix the
period keeps growing, at an ordinary maximum it does not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.report.sweep_layout import Grid, Key
from vibsim.report.types import Experiment

Period = Callable[[Floats, Floats], Floats]
GROWTH = 1.3
"""A peak is unbounded if the period grows by this factor from the best grid point to the end of the search."""
SECTIONS = 80
"""Golden sections: each reduces a bracket by the factor 0.618, so that 80 reduce it to rounding error."""
SCANNED = 201  # most lines of a grid that are searched in each direction


def with_separatrix(experiment: Experiment, grid: Grid) -> Grid:
    """Return a grid with its separatrix, if the model has an exact period and a separatrix crosses the grid."""
    if experiment.model.definition.exact_period is None or grid.x.words or grid.y.words:
        return grid

    def period(x: Floats, y: Floats) -> Floats:
        return _period_at(experiment, {grid.x.key: x, grid.y.key: y})

    down = _peaks(period, grid.x.distinct, grid.y.distinct)
    across = _peaks(lambda y, x: period(x, y), grid.y.distinct, grid.x.distinct)
    points = np.concatenate([down[0], across[1]]), np.concatenate([down[1], across[0]])
    return replace(grid, separatrix=points)


def on_line(experiment: Experiment, key: Key) -> Floats:
    """Return the values of one swept key on the separatrix; empty if it does not cross it."""
    if experiment.model.definition.exact_period is None or key.words or key.distinct.size < 3:
        return np.empty(0)
    return _peaks(lambda _, y: _period_at(experiment, {key.key: y}), np.zeros(1), key.distinct)[1]


def _period_at(experiment: Experiment, values: dict[str, Floats]) -> Floats:
    """Return the exact period with some keys replaced by `values`; infinite if it does not exist."""
    model, period = experiment.model, experiment.model.definition.exact_period
    assert period is not None
    initial, parameters = (
        {name: values.get(f"{section}.{name}", value) for name, value in fixed.items()}
        for section, fixed in (("initial", experiment.initial), ("model", model.parameters))
    )
    shape = np.broadcast_shapes(*(np.shape(value) for value in values.values()))
    return np.array(np.broadcast_to(period(initial, parameters), shape), dtype=float)


def _peaks(period: Period, fixed: Floats, moving: Floats) -> tuple[Floats, Floats]:
    """Return the coordinates (fixed, moving) of unbounded peaks along `moving`, for every value of `fixed`."""
    lines = fixed[:: -(-fixed.size // SCANNED)]
    table = period(lines[:, None], moving[None, :])
    filled = np.pad(np.nan_to_num(table, nan=0.0, posinf=np.inf), ((0, 0), (1, 1)))
    is_peak = (filled[:, 1:-1] >= filled[:, :-2]) & (filled[:, 1:-1] > filled[:, 2:])
    line, peak = np.nonzero(is_peak)
    low, high = moving[np.maximum(peak - 1, 0)], moving[np.minimum(peak + 1, moving.size - 1)]
    best, highest = _climb(lambda y: period(lines[line], y), low, high)
    inside = (best > low) & (best < high)
    is_unbounded = inside & (np.isinf(highest) | (highest > GROWTH * table[line, peak]))
    return lines[line][is_unbounded], best[is_unbounded]


def _climb(period: Callable[[Floats], Floats], low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Maximise within brackets by golden sections; return position and value of the maximum."""
    ratio = 0.5 * (np.sqrt(5.0) - 1.0)
    for _ in range(SECTIONS):
        left, right = high - ratio * (high - low), low + ratio * (high - low)
        to_left = period(left) >= period(right)
        low, high = np.where(to_left, low, left), np.where(to_left, right, high)
    middle = 0.5 * (low + high)
    return middle, period(middle)
