"""Ways to bring the values of a finer level to the points of the coarsest one, along one dimension.

``subset``
    the values at points that all levels have.
``mean``
    averages over the cells of the coarsest level, with equal weights.
``linear``, ``cubic``
    interpolation by polynomials through the 2 or 4 nearest points, with an additional error of order 2 or 4.

Each is a weighted sum: common point m has the value ``sum_q weights[m, q] values[indices[m, q]]``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.convergence.study.refusal import refused
from vibsim.core.array_types import Flags, Floats, Integers

EQUAL = 1e-9
"""Points closer than this part of the spacing are equal."""
CENTRED = 1e-3
"""Coordinates may be off the centres of cells by this part of the width, since they may be rounded."""
INTERPOLATION_ORDERS: Mapping[str, int] = MappingProxyType({"linear": 2, "cubic": 4})
"""Order of the error of an interpolation, which is also its number of points."""
Coordinate = NDArray[Any] | None
"""Points of a dimension, shape (length,); None if only their number is known."""


FEWEST_POINTS = 3
"""Fewest common points along a dimension: fewer show only prescribed values at its ends."""


@dataclass(frozen=True)
class Restriction:
    """Weighted sums of the values of a level along a dimension."""

    indices: Integers
    """Shape (m, q), or (m,) if each common point is a point of the level."""
    weights: Floats | None = None
    """Shape (m, q)."""

    def of(self, values: Floats, axis: int) -> Floats:
        """Return the weighted sums of `values` along `axis`, which then has m points."""
        taken = np.take(values, self.indices, axis)
        if self.weights is None:
            return taken
        weights = self.weights.reshape(self.weights.shape + (1,) * (values.ndim - axis - 1))
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray(np.sum(taken * weights, axis=axis + 1))


@dataclass(frozen=True)
class Common:
    """The common points of all levels along one dimension."""

    restrictions: tuple[Restriction, ...]
    """One for each level, the coarsest first."""
    coordinate: Coordinate
    """The common points."""
    interpolated: bool = False
    """Whether any value is interpolated."""
    note: str = ""
    """Possible fault of these points, for a verdict that does not pass with an expected order above 1."""
    part: str = ""
    """Which part of the points is compared, if not all."""
    averaged: bool = False
    """Whether averages over cells are compared."""


def common(
    dim: str, kind: str, coordinates: Sequence[Coordinate], lengths: Sequence[int]
) -> Common:
    """Return the common points of the levels along a dimension, the coarsest level first.

    Parameters
    ----------
    dim
        Name of the dimension.
    kind
        One of `vibsim.core.vocabulary.RESTRICTIONS`.
    coordinates
        Coordinate of each level, or None.
    lengths
        Number of points of each level.

    Raises
    ------
    InputError
        If the levels have no such points.
    """
    known = [c is not None for c in coordinates]
    if any(known) and not all(known):
        raise refused(dim, "coordinates", f"level {known.index(False)} has none, others do")
    if len(set(lengths)) == 1 and _all_equal(coordinates):
        return _all_points(coordinates[0], len(lengths), lengths[0])
    if kind == "mean":
        return _means(dim, coordinates, lengths)
    if kind == "subset":
        return _subset(dim, coordinates, lengths) if all(known) else _every_kth(dim, lengths)
    points = [
        _numeric(dim, c) if c is not None else np.linspace(0.0, 1.0, n)
        for c, n in zip(coordinates, lengths, strict=True)
    ]
    return _interpolations(dim, kind, points, has_points=all(known))


def same_points(dim: str, coordinates: Sequence[Coordinate], lengths: Sequence[int]) -> Common:
    """Return all points of a dimension that is not refined; InputError if the levels differ in it."""
    if len(set(lengths)) > 1:
        rule = "must have the same points on every level, because it is none of `dims`"
        raise refused(dim, f"lengths {list(lengths)}", rule)
    if not _all_equal(coordinates):
        raise refused(
            dim, "coordinates", "must be the same on every level, because it is none of `dims`"
        )
    return _all_points(coordinates[0], len(lengths), lengths[0])


def spacing_tolerance(points: NDArray[Any], epsilon: float) -> float:
    """Return the largest distance of equal points: a part of the spacing plus rounding.

    Points may be summed step by step, each with a rounding error; that counts up to a visible part of the spacing.
    """
    size = float(np.max(np.abs(points)))
    gaps = np.abs(np.diff(np.sort(points)))
    spacing = float(np.min(gaps)) if gaps.size else size
    rounding = epsilon * size
    return EQUAL * spacing + max(8.0 * rounding, min(len(points) * rounding, CENTRED * spacing))


def _all_points(coordinate: Coordinate, levels: int, length: int) -> Common:
    return Common((Restriction(np.arange(length)),) * levels, coordinate)


def _all_equal(coordinates: Sequence[Coordinate]) -> bool:
    first = coordinates[0]
    if first is None:
        return all(c is None for c in coordinates)
    return all(c is not None and are_equal(first, c) for c in coordinates[1:])


def are_equal(first: NDArray[Any], second: NDArray[Any]) -> bool:
    """Tell whether two coordinates have the same points, up to rounding."""
    if first.shape != second.shape:
        return False
    if not (_is_numeric(first) and _is_numeric(second)):
        return bool(np.all(first == second))
    tolerance = spacing_tolerance(first, max(_epsilon(first), _epsilon(second)))
    return bool(np.all(np.abs(first - second) <= tolerance))


def positions(targets: NDArray[Any], points: NDArray[Any]) -> Integers | None:
    """Return the index of each target among the points; None if any target is not among them."""
    if not (_is_numeric(targets) and _is_numeric(points)):
        return np.arange(len(targets)) if are_equal(targets, points) else None
    index, distance = _nearest(targets, points)
    tolerance = spacing_tolerance(points, max(_epsilon(targets), _epsilon(points)))
    return index if np.all(distance <= tolerance) else None


def _is_numeric(points: NDArray[Any]) -> bool:
    return points.dtype.kind in "fiu"


def _epsilon(points: NDArray[Any]) -> float:
    """Return the machine epsilon of a coordinate; 0 for integers, which are not rounded."""
    return float(np.finfo(points.dtype).eps) if points.dtype.kind == "f" else 0.0


def _numeric(dim: str, points: NDArray[Any]) -> NDArray[Any]:
    """Return the points; InputError if they are not different finite numbers."""
    if not _is_numeric(points):
        raise refused(
            dim, str(points.dtype), "its coordinates are no numbers, and differ between levels"
        )
    if not np.isfinite(points).all():
        raise refused(dim, "coordinates", "must be finite")
    if np.unique(points).size < points.size:
        raise refused(dim, "coordinates", "must differ from each other")
    return points


def _every_kth(dim: str, lengths: Sequence[int]) -> Common:
    """Return the common points of levels without coordinates: of grids from end to end, or of periodic grids."""
    first = lengths[0]
    steps = [n - 1 for n in lengths]
    if any(finer < n for n, finer in pairwise(lengths)):
        rule = "a finer level must not have fewer points than a coarser one"
        raise refused(dim, f"lengths {list(lengths)}", rule, "check the step sizes of the levels")
    if first > 1 and all(s % steps[0] == 0 for s in steps):
        factors, note = [s // steps[0] for s in steps], ""
    elif all(n % first == 0 for n in lengths):
        factors = [n // first for n in lengths]
        counts = ", ".join(map(str, lengths))
        note = (
            f"The levels have {counts} values{_along(dim)}, which were taken for those of a periodic grid: every level "
            "begins at the same point. For averages of cells use restrict: mean."
        )
    else:
        rule = "the points of the coarsest level are not among those of the finer ones"
        hint = "give coordinates, or use restrict: linear or cubic"
        raise refused(dim, f"lengths {list(lengths)}", rule, hint)
    return Common(tuple(Restriction(np.arange(first) * k) for k in factors), None, note=note)


def _along(dim: str) -> str:
    return "" if dim == "axis 0" else f" along {dim}"


def _subset(dim: str, coordinates: Sequence[Coordinate], lengths: Sequence[int]) -> Common:
    points = [_numeric(dim, c) for c in coordinates if c is not None]
    epsilon = max(map(_epsilon, points))
    coarse = points[0]
    indices = [np.arange(lengths[0])]
    is_common: Flags = np.ones(lengths[0], dtype=bool)
    for fine in points[1:]:
        index, distance = _nearest(coarse, fine)
        is_common &= distance <= spacing_tolerance(fine, epsilon)
        indices.append(index)
    count = int(is_common.sum())
    if count < min(FEWEST_POINTS, lengths[0]):
        rule = "the levels have no point in common"
        if count:
            rule = f"the levels have {count} of the {lengths[0]} points of the coarsest one in common; "
            rule += f"{FEWEST_POINTS} are needed at least"
        hint = "use restrict: linear or cubic, or mean for averages of cells"
        raise refused(dim, "coordinates", rule, hint)
    part = ""
    if count < lengths[0]:
        part = f"The levels have {count} of the {lengths[0]} points of the coarsest one in common along {dim}."
    restrictions = tuple(Restriction(i[is_common]) for i in indices)
    return Common(restrictions, coarse[is_common], note=_numbered(dim, points), part=part)


def _numbered(dim: str, points: Sequence[NDArray[Any]]) -> str:
    """Doubt coordinates that have the same spacing on all levels: they may number the points."""
    spacings = [float(np.ptp(p)) / max(len(p) - 1, 1) for p in points]
    if np.ptp(spacings) > EQUAL * max(spacings):
        return ""
    return (
        f"The coordinates along {dim} have the same spacing on all levels. If they only number the points or cells, "
        "give their positions."
    )


def _nearest(targets: NDArray[Any], points: NDArray[Any]) -> tuple[Integers, Floats]:
    """Return the index of the point nearest to each target, and its distance."""
    order = np.argsort(points)
    ordered = points[order]
    right = np.clip(np.searchsorted(ordered, targets), 0, len(points) - 1)
    left = np.clip(right - 1, 0, None)
    is_left = np.abs(targets - ordered[left]) < np.abs(targets - ordered[right])
    nearest = np.where(is_left, left, right)
    return order[nearest], np.abs(targets - ordered[nearest]).astype(np.float64)


def _means(dim: str, coordinates: Sequence[Coordinate], lengths: Sequence[int]) -> Common:
    first = lengths[0]
    if any(n % first for n in lengths):
        rule = "the number of cells of a finer level must be a multiple of that of the coarsest one"
        raise refused(
            dim, f"lengths {list(lengths)}", rule, "or use restrict: subset, linear or cubic"
        )
    restrictions = []
    for level, (points, n) in enumerate(zip(coordinates, lengths, strict=True)):
        k = n // first
        indices = np.arange(n).reshape(first, k)
        restrictions.append(Restriction(indices, np.full(indices.shape, 1.0 / k)))
        _check_centres(dim, coordinates[0], points, indices, level)
    return Common(tuple(restrictions), coordinates[0], averaged=True)


def _check_centres(
    dim: str, coarse: Coordinate, fine: Coordinate, indices: Integers, level: int
) -> None:
    """Refuse coordinates that are not centres of cells of equal width, the finer cells within the coarse ones.

    Integers number the cells. `indices` are those of the finer cells in each coarse one.
    """
    if coarse is None or fine is None or coarse.dtype.kind != "f" or fine.dtype.kind != "f":
        return
    centres = np.mean(fine[indices].astype(np.float64), axis=1)
    gaps = np.abs(np.diff(coarse)) if len(coarse) > 1 else np.abs(fine[-1:] - fine[:1])
    off = np.flatnonzero(~(np.abs(centres - coarse) <= CENTRED * np.min(gaps)))
    if off.size:
        i = int(off[0])
        rule = (
            f"mean needs cells of one width, within those of the coarsest level: {dim} is {coarse[i]:.6g} in its cell "
            f"{i}, and {centres[i]:.6g} in the mean of the cells of level {level} there"
        )
        hint = "for values at points use restrict: subset; take averages over other cells yourself"
        raise refused(dim, "coordinates", rule, hint)


def _interpolations(
    dim: str, kind: str, points: Sequence[NDArray[Any]], *, has_points: bool
) -> Common:
    width = INTERPOLATION_ORDERS[kind]
    epsilon = max(map(_epsilon, points))
    tolerances = [spacing_tolerance(p, epsilon) for p in points]
    coarse = points[0].astype(np.float64)
    low = max(float(p.min()) - t for p, t in zip(points, tolerances, strict=True))
    high = min(float(p.max()) + t for p, t in zip(points, tolerances, strict=True))
    inside = (coarse >= low) & (coarse <= high)
    if not inside.any():
        raise refused(dim, "coordinates", "the levels cover no common range")
    targets = coarse[inside]
    restrictions = [Restriction(np.flatnonzero(inside))]
    interpolated = False
    for fine, tolerance in zip(points[1:], tolerances[1:], strict=True):
        if len(fine) < width:
            raise refused(
                dim, f"length {len(fine)}", f"{kind} interpolation needs {width} points at least"
            )
        weights, indices, is_used = polynomials(targets, fine.astype(np.float64), width, tolerance)
        interpolated |= is_used
        restrictions.append(Restriction(indices, weights))
    part = ""
    if not inside.all():
        part = f"Of the {len(coarse)} points of the coarsest level along {dim}, {inside.sum()} lie within all levels."
    note, lengths = _numbered(dim, points) if has_points else "", [len(p) for p in points]
    if not has_points and interpolated and all(n % lengths[0] == 0 for n in lengths):
        counts = ", ".join(map(str, lengths))
        note = (
            f"The levels have {counts} values{_along(dim)}, which were taken for points from end to end. For averages "
            "of cells use restrict: mean, or give their coordinates."
        )
    return Common(tuple(restrictions), targets if has_points else None, interpolated, note, part)


def polynomials(
    targets: Floats, points: Floats, width: int, tolerance: float
) -> tuple[Floats, Integers, bool]:
    """Return weights and indices of the Lagrange polynomials through the nearest `width` points.

    Also return whether any is needed: a target that coincides with a point takes the value there.
    """
    order = np.argsort(points)
    ordered = points[order]
    left = np.searchsorted(ordered, targets) - width // 2
    start = np.clip(left, 0, len(points) - width)
    stencil = start[:, None] + np.arange(width)
    x = ordered[stencil]
    weights = np.ones(x.shape)
    for q in range(width):
        for r in range(width):
            if r != q:
                weights[:, q] *= (targets - x[:, r]) / (x[:, q] - x[:, r])
    distance = np.abs(x - targets[:, None])
    nearest = np.argmin(distance, axis=1)
    coincides = np.take_along_axis(distance, nearest[:, None], axis=1)[:, 0] <= tolerance
    weights[coincides] = np.eye(width)[nearest[coincides]]
    return weights, order[stencil], not bool(coincides.all())
