"""Where the exact period grows beyond all bounds: the separatrix between kinds of motion, found from the model alone.

Along every line of a grid the period has a peak there. A search by golden sections follows each peak; it belongs to a
separatrix where the period keeps growing, and is an ordinary maximum where it does not.
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
"""A peak whose period grows by this factor from the best point of the grid to the last of the search has no end."""
SECTIONS = 80
"""Golden sections: each leaves 0.618 of a bracket, so that 80 leave a rounding error of it."""
SCANNED = 201  # most lines of a grid that are searched in each direction


def with_separatrix(experiment: Experiment, grid: Grid) -> Grid:
    """Return a grid with the separatrix within it; as it is without an exact period or a separatrix."""
    if experiment.model.definition.exact_period is None or grid.x.words or grid.y.words:
        return grid

    def period(x: Floats, y: Floats) -> Floats:
        return _period_at(experiment, {grid.x.key: x, grid.y.key: y})

    down = _peaks(period, grid.x.distinct, grid.y.distinct)
    across = _peaks(lambda y, x: period(x, y), grid.y.distinct, grid.x.distinct)
    found = np.concatenate([down[0], across[1]]), np.concatenate([down[1], across[0]])
    return replace(grid, separatrix=found)


def on_line(experiment: Experiment, key: Key) -> Floats:
    """Return the values of one swept key on the separatrix; none where there is no such value."""
    if experiment.model.definition.exact_period is None or key.words or key.distinct.size < 3:
        return np.empty(0)
    return _peaks(lambda _, y: _period_at(experiment, {key.key: y}), np.zeros(1), key.distinct)[1]


def _period_at(experiment: Experiment, values: dict[str, Floats]) -> Floats:
    """Return the exact period with some keys replaced by `values`; infinite where it does not exist."""
    model, period = experiment.model, experiment.model.definition.exact_period
    assert period is not None
    initial, parameters = (
        {name: values.get(f"{section}.{name}", value) for name, value in found.items()}
        for section, found in (("initial", experiment.initial), ("model", model.parameters))
    )
    shape = np.broadcast_shapes(*(np.shape(value) for value in values.values()))
    return np.array(np.broadcast_to(period(initial, parameters), shape), dtype=float)


def _peaks(period: Period, fixed: Floats, moving: Floats) -> tuple[Floats, Floats]:
    """Return the coordinates (fixed, moving) of endless peaks along `moving`, for every value of `fixed`."""
    lines = fixed[:: -(-fixed.size // SCANNED)]
    table = period(lines[:, None], moving[None, :])
    filled = np.pad(np.nan_to_num(table, nan=0.0, posinf=np.inf), ((0, 0), (1, 1)))
    is_peak = (filled[:, 1:-1] >= filled[:, :-2]) & (filled[:, 1:-1] > filled[:, 2:])
    line, place = np.nonzero(is_peak)
    low, high = moving[np.maximum(place - 1, 0)], moving[np.minimum(place + 1, moving.size - 1)]
    best, found = _climb(lambda y: period(lines[line], y), low, high)
    inside = (best > low) & (best < high)
    endless = inside & (np.isinf(found) | (found > GROWTH * table[line, place]))
    return lines[line][endless], best[endless]


def _climb(period: Callable[[Floats], Floats], low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Follow the largest value within brackets by golden sections; return where it is and its value."""
    part = 0.5 * (np.sqrt(5.0) - 1.0)
    for _ in range(SECTIONS):
        left, right = high - part * (high - low), low + part * (high - low)
        to_left = period(left) >= period(right)
        low, high = np.where(to_left, low, left), np.where(to_left, right, high)
    middle = 0.5 * (low + high)
    return middle, period(middle)
