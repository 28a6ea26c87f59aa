"""The values of all levels at their common points."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.convergence.study import restriction
from vibsim.convergence.study.coordinate_units import in_common_units
from vibsim.convergence.study.grid_values import GridValues, grid_values, real
from vibsim.convergence.study.refusal import refused
from vibsim.core.array_types import Floats
from vibsim.core.signatures import misfit, takes_by_name

GAUSS = 5
"""Points per dimension of the Gauss quadrature that averages a function over a cell."""


@dataclass(frozen=True)
class CommonValues:
    """Values of all levels at common points."""

    values: Floats
    """Shape (n, *points), the coarsest level first."""
    dims: tuple[str, ...]
    coords: Mapping[str, NDArray[Any]]
    """Coordinates of the common points, for the dimensions that have any."""
    epsilon: Floats
    """Machine epsilon of the precision of each level, shape (n,)."""
    kind: str
    """One of `vibsim.core.vocabulary.RESTRICTIONS`."""
    interpolation_order: int | None
    """Order of the interpolation error; None if no value was interpolated."""
    notes: tuple[str, ...] = ()
    """Possible faults of the points, for a verdict that does not pass with an expected order above 1."""
    parts: tuple[str, ...] = ()
    """Which part of the points is compared, if not all."""
    averaged: tuple[str, ...] = ()
    """Dimensions along which averages over cells are compared."""


def common_values(
    levels: Sequence[GridValues], kind: str, dims: Sequence[str] | None, fixed: Sequence[str] = ()
) -> CommonValues:
    """Bring the values of all levels, the coarsest first, to their common points.

    Parameters
    ----------
    levels
        All with the same dimensions, in any order.
    kind
        One of `vibsim.core.vocabulary.RESTRICTIONS`.
    dims
        Names of the dimensions that are refined; None for all. The others must be the same on every level.
    fixed
        Names of further dimensions that are not refined.

    Raises
    ------
    InputError
        If the levels have no common points.
    """
    levels = in_common_units(levels)
    first = levels[0]
    for i, level in enumerate(levels):
        if set(level.dims) != set(first.dims) or len(level.dims) != len(first.dims):
            rule = f"has the dimensions {_listed(level.dims)}, the coarsest level has {_listed(first.dims)}"
            raise refused(level.place(i), level.name or "values", rule)
    refined = first.dims if dims is None else dims
    for dim in refined:
        if dim not in first.dims:
            rule = f"is no dimension of the values, which have {_listed(first.dims)}"
            raise refused("dims", dim, rule)
    arrays = [
        _finite_throughout(_transposed(level, first.dims), first.dims, fixed) for level in levels
    ]
    coords: dict[str, NDArray[Any]] = {}
    notes, parts, averaged, interpolated = [], [], [], False
    for axis, dim in enumerate(first.dims):
        lengths = [array.shape[axis] for array in arrays]
        coordinates = [level.coords.get(dim) for level in levels]
        shared = (
            restriction.common(dim, kind, coordinates, lengths)
            if dim in refined and dim not in fixed
            else restriction.same_points(dim, coordinates, lengths)
        )
        arrays = [r.of(a, axis) for r, a in zip(shared.restrictions, arrays, strict=True)]
        if shared.coordinate is not None:
            coords[dim] = shared.coordinate
        interpolated |= shared.interpolated
        notes += [shared.note] if shared.note else []
        parts += [shared.part] if shared.part else []
        averaged += [dim] if shared.averaged else []
    order = restriction.INTERPOLATION_ORDERS[kind] if interpolated else None
    epsilon = np.array([level.epsilon for level in levels])
    return CommonValues(
        np.stack(arrays),
        first.dims,
        coords,
        epsilon,
        kind,
        order,
        tuple(notes),
        tuple(parts),
        tuple(averaged),
    )


def _listed(dims: Sequence[str]) -> str:
    return ", ".join(dims) or "none (a number)"


def _finite_throughout(values: Floats, dims: Sequence[str], fixed: Sequence[str]) -> Floats:
    """Return values, all NaN if any is not finite, since the common points might not include that one."""
    axes = tuple(axis for axis, dim in enumerate(dims) if dim not in fixed)
    return np.where(np.all(np.isfinite(values), axis=axes, keepdims=True), values, np.nan)


def _transposed(level: GridValues, dims: Sequence[str]) -> Floats:
    return np.transpose(level.values, [level.dims.index(dim) for dim in dims])


def exact_values(exact: Any, common: CommonValues, *, members: bool = False) -> Floats:
    """Return the exact values at the common points, shape (*points).

    `exact` is a number, an array, an xarray object, or a function of the coordinates. The function gets arrays that can
    be broadcast: by name if its parameters have the names of the dimensions, otherwise in the order of the dimensions.
    It is averaged along the dimensions whose cells are. With `members` the first dimension is not an argument.

    Raises
    ------
    InputError
        If it has other points, or values that are not finite real numbers.
    """
    shape = common.values.shape[1:]
    if callable(exact):
        result = _of_function(exact, common, common.dims[1:] if members else common.dims)
    else:
        data = grid_values(exact, "exact")
        named = bool(data.coords) or set(data.dims) == set(common.dims)
        if named and not set(data.dims) <= set(common.dims):
            raise refused("exact", _listed(data.dims), f"the values have {_listed(common.dims)}")
        result = data.values
        if named:
            present = [dim for dim in common.dims if dim in data.dims]
            result = _at_common_points(_transposed(data, present), data, present, common)
            index = [slice(None) if dim in present else None for dim in common.dims]
            result = result[tuple(index)]
    try:
        values = np.broadcast_to(result, shape)
    except ValueError:
        rule = f"has shape {result.shape}, and the common points have {shape}"
        raise refused("exact", "values", rule) from None
    if not np.isfinite(values).all():
        raise refused("exact", "values", "must be finite")
    return values


def _at_common_points(
    values: Floats, data: GridValues, dims: Sequence[str], common: CommonValues
) -> Floats:
    """Return the values at the common points, for the dimensions with coordinates."""
    for axis, dim in enumerate(dims):
        if dim in data.coords and dim in common.coords:
            index = restriction.positions(common.coords[dim], data.coords[dim])
            if index is None:
                rule = f"must be given at the {len(common.coords[dim])} common points of the levels"
                raise refused("exact", f"coordinates {dim}", rule)
            values = np.take(values, index, axis)
    return values


def _of_function(exact: Callable[..., Any], common: CommonValues, dims: Sequence[str]) -> Floats:
    missing = [dim for dim in dims if dim not in common.coords]
    if missing or not dims:
        rule = "is a function, and the values have no coordinates that it could be given"
        hint = "give values, or xarray objects with coordinates"
        raise refused("exact", _listed(dims), rule, hint)
    by_name = takes_by_name(exact, dims)
    if not by_name and (misfits := misfit(exact, *dims)):
        rule = f"must be a function of {_listed(dims)}, takes {misfits[0]}"
        raise refused("exact", "a function", rule)

    def evaluate(grids: Sequence[Floats]) -> Any:
        try:
            return exact(**dict(zip(dims, grids, strict=True))) if by_name else exact(*grids)
        except TypeError as error:
            hint = "it is given numpy arrays: use np.sin instead of math.sin, and np.where instead of if"
            raise refused("exact", "a function", f"raised TypeError ({error})", hint) from error

    nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
    points = []
    for dim in dims:
        x = np.asarray(common.coords[dim], dtype=np.float64)
        if dim in common.averaged:
            if len(x) < 2:
                rule = "cannot be averaged over a single cell"
                raise refused("exact", "a function", rule, "give its average")
            edges = np.concatenate(
                [[1.5 * x[0] - 0.5 * x[1]], 0.5 * (x[1:] + x[:-1]), [1.5 * x[-1] - 0.5 * x[-2]]]
            )
            middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
            x = (middle[:, None] + half[:, None] * nodes).ravel()
        points.append(x)
    grids = np.meshgrid(*points, indexing="ij", sparse=True)
    result, _ = real(np.asarray(evaluate(grids)), "exact")
    for axis, dim in enumerate(dims):
        if dim in common.averaged:
            result = np.broadcast_to(result, [len(x) for x in points])
            points[axis] = np.asarray(common.coords[dim])
            shape = (*result.shape[:axis], len(points[axis]), GAUSS, *result.shape[axis + 1 :])
            result = np.tensordot(result.reshape(shape), 0.5 * weights, axes=([axis + 1], [0]))
    return np.asarray(result)
