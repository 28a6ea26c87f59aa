"""The floor that round-off puts under differences between levels.

A scheme predicts the size of its accumulated round-off relative to the solution, from the arithmetic and the number of
steps. It is an order of magnitude; the verdict blames it only where the data show it too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vibsim.convergence.differences import largest
from vibsim.core.array_types import Floats
from vibsim.core.record import Record

SPACING_AT_ONE = float(np.finfo(np.float64).eps)
"""Distance from 1 to the next number, 2^-52: twice the unit round-off.

No stored number is known better than this, relative to its size.
"""
STORED = 1.0 / 7.0
"""Root mean square of the error that storing leaves of numbers from 1/2 to 1: half a spacing over root 12. [derived]"""


def stored_floor(
    records: Mapping[int, Record], levels: Sequence[int], names: Sequence[str]
) -> Floats:
    """Return the round-off of storing at every level, relative to the solution's size, shape (level,); 0 for doubles.

    Data of other programs may be kept in single precision: no difference of two such levels is known to more than its
    seven digits.

    Parameters
    ----------
    records
        Level Records by level.
    names
        The states.
    """
    floors = []
    for level in levels:
        kinds = (np.asarray(records[level][name]).dtype for name in names if name in records[level])
        eps = max((float(np.finfo(kind).eps) for kind in kinds if kind.kind == "f"), default=0.0)
        floors.append(STORED * eps if eps > SPACING_AT_ONE else 0.0)
    return np.array(floors)


def solution_size(series: list[Floats]) -> Floats:
    """Return the size of a solution, shape (scheme, case): its largest value at the finest level that has one.

    Parameters
    ----------
    series
        The solution at every level from coarse to fine, each of shape (scheme, case, t).
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
    """Return the norm over time of noise as large as `floor` at every point; the shape of `floor`.

    Parameters
    ----------
    floor
        Size of the noise at one point, shape (..., case).
    kind
        One of `vocabulary.NORMS`.
    points
        Number of points of the grid.
    spacing
        Distance between them, shape (case,) or (1,).
    """
    weight = {"l1": spacing * points, "l2": np.sqrt(spacing * points)}.get(kind, np.ones(1))
    return np.asarray(floor * weight)
