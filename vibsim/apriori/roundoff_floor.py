"""The floor of round-off below differences between levels.

A scheme predicts its accumulated round-off, relative to the solution, from the arithmetic and the number of steps. This
is an order of magnitude: a verdict attributes an error to round-off only if the data show it too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vibsim.convergence.differences import largest
from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.experiment import Experiment
from vibsim.experiment.sweep_columns import Columns, by_options
from vibsim.schemes import Options, Scheme

SPACING_AT_ONE = float(np.finfo(np.float64).eps)
"""Distance from 1 to the next number, 2^-52: twice the unit round-off.

No stored number is known better than this, relative to its size.
"""
STORED = 1.0 / 7.0
"""Root mean square of the rounding error of stored numbers from 1/2 to 1, in epsilon: 1/2 over sqrt(12). [derived]"""


def relative_floors(
    experiment: Experiment, steps: tuple[int, ...], columns: Columns, arithmetic: str | None = None
) -> Floats:
    """Return the predicted round-off relative to the solution, shape (scheme, case, level).

    `steps` are the numbers of steps of the levels; `arithmetic` replaces the option of this name, unless it is None.
    """
    loaded = experiment.model.definition.loaded
    least = SPACING_AT_ONE if loaded is None else max(SPACING_AT_ONE, loaded.rounding)

    def floor(scheme: Scheme, options: Options) -> list[float]:
        if arithmetic is not None and "arithmetic" in options:
            options = {**options, "arithmetic": arithmetic}
        return [max(scheme.round_off(options, n), least) for n in steps]

    return by_options(experiment, columns, floor)


def stored_floor(
    records: Mapping[int, Record], levels: Sequence[int], names: Sequence[str]
) -> Floats:
    """Return the rounding error of stored values at every level, relative to the solution, shape (level,).

    It is 0 for double precision. Other programs may store single precision, so that differences between levels are
    known to seven digits only. `names` are the states.
    """
    floors = []
    for level in levels:
        kinds = (np.asarray(records[level][name]).dtype for name in names if name in records[level])
        eps = max((float(np.finfo(kind).eps) for kind in kinds if kind.kind == "f"), default=0.0)
        floors.append(STORED * eps if eps > SPACING_AT_ONE else 0.0)
    return np.array(floors)


def solution_size(series: list[Floats]) -> Floats:
    """Return the largest absolute value of a solution at the finest level with finite values, shape (scheme, case).

    `series` is the solution at every level from coarse to fine, each of shape (scheme, case, t).
    """
    size = largest(series[-1])
    if np.all(np.isfinite(size)):
        return size
    size = np.zeros(series[0].shape[:-1])
    for values in series:
        finite = np.isfinite(values)
        most = np.max(np.abs(np.where(finite, values, 0.0)), axis=-1)
        size = np.where(np.any(finite, axis=-1), most, size)
    return size


def norm_of_floor(floor: Floats, kind: str, points: int, spacing: Floats) -> Floats:
    """Return the norm over time of noise of size `floor`, shape (..., case), at each of `points` grid points.

    `kind` is one of `vocabulary.NORMS`; `spacing` is that of the grid, shape (case,) or (1,).
    """
    weight = {"l1": spacing * points, "l2": np.sqrt(spacing * points)}.get(kind, np.ones(1))
    return np.asarray(floor * weight)
