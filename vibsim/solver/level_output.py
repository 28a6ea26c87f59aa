"""The output of a user's solver for one level: read its file or dataset, and make the Record that is stored."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from vibsim.convergence.study.coordinate_units import SINCE
from vibsim.convergence.study.grid_values import NO_UNIT, GridValues, grid_values, units_in
from vibsim.core.array_types import Floats
from vibsim.core.errors import InputError, VibsimError, nearest
from vibsim.core.record import Record, Variable, attributes
from vibsim.experiment.schema.solver import QuantitySection
from vibsim.experiment.solver import SolverExperiment
from vibsim.experiment.tables.csv_text import MOST_LINES
from vibsim.solver import level_files, level_tables

Quantities = Mapping[str, QuantitySection]
LEVEL = "level"
"""Name of the coordinate with the position of a level, the coarsest 0."""
EPSILON = "epsilon"
"""Attribute with the machine epsilon of the precision that the values were computed in."""
WRITTEN = "written"
"""Attribute of a number with the digits that it was written with in a table."""
SPACING = "spacing"
"""Attribute with the distance of neighbouring values that were packed into integers."""


def read(path: Path, quantities: Quantities, *, is_shown: bool = True) -> dict[str, GridValues]:
    """Return the quantities in a netCDF or CSV file; raise VibsimError where one is missing or has other coordinates.

    `is_shown`: whether messages may show the content of a table; see `vibsim.solver.level_tables.columns`.
    """
    if level_files.is_netcdf(path):
        with level_files.opened(path) as dataset:
            return {
                name: _checked(
                    name, level_files.grid_values(str(path), dataset, name, row.coordinates), row
                )
                for name, row in quantities.items()
            }
    return _from_table(path, quantities, is_shown)


def from_dataset(dataset: Any, quantities: Quantities) -> dict[str, GridValues]:
    """Return the quantities in a function's result; raise VibsimError where one is missing or has other coordinates.

    The result is a Dataset, or a mapping with a number for each name.
    """
    if not hasattr(dataset, "data_vars"):
        if not isinstance(dataset, Mapping) or any(map(np.ndim, dataset.values())):
            kind = type(dataset).__name__
            raise VibsimError(
                f"returned a value of type {kind}, and must return an xarray.Dataset or a dict of numbers"
            )
        import xarray as xr

        dataset = xr.Dataset(dataset)
    values = {}
    for name, row in quantities.items():
        if name not in dataset.variables:
            hint = nearest(name, list(map(str, dataset.data_vars)))
            raise VibsimError(f"{name}: the dataset has no such variable: {hint}")
        array = dataset[name]
        for requested in row.coordinates or ():
            if requested not in array.dims and requested in array.coords:
                array = array.swap_dims(dict.fromkeys(array.coords[requested].dims, requested))
        try:
            values[name] = _checked(name, grid_values(array, name), row)
        except InputError as error:
            raise VibsimError(f"{name}: {error.faults[0].value} {error.faults[0].rule}") from None
    return values


def _from_table(path: Path, quantities: Quantities, is_shown: bool) -> dict[str, GridValues]:
    """Return the quantities in the columns of a table with a row for each point, or a single row."""
    columns = [name for row in quantities.values() for name in row.coordinates or ()]
    names = list(dict.fromkeys([*columns, *quantities]))
    table, first = level_tables.columns(path, names, MOST_LINES, is_shown=is_shown)
    if not len(table[names[0]]):
        raise VibsimError(f"{path}: has no row below the names of its columns")
    return {
        name: _checked(name, _on_grid(name, table, first, row.coordinates or ()), row)
        for name, row in quantities.items()
    }


def _on_grid(
    name: str, table: Mapping[str, Floats], first: Mapping[str, Decimal], dims: Sequence[str]
) -> GridValues:
    """Return a column as values on the grid of its coordinates `dims`; without these a number, or one value per row."""
    column = table[name]
    if not dims:
        if len(column) == 1:
            return GridValues(column[0], (), {}, name, written=first[name])
        return GridValues(column, ("row",), {}, name)
    points = [np.unique(table[dim], return_inverse=True) for dim in dims]
    shape = tuple(len(axis) for axis, _ in points)
    flat = np.ravel_multi_index(tuple(place for _, place in points), shape)
    if len(np.unique(flat)) < len(flat) or len(flat) < np.prod(shape):
        size = " x ".join(map(str, shape))
        rule = f"has {len(flat)} rows for the {size} points of {', '.join(dims)}"
        raise VibsimError(f"{name}: {rule}; every point must have one row")
    values = np.empty(len(flat))
    values[flat] = column
    coords = {dim: axis for dim, (axis, _) in zip(dims, points, strict=True)}
    return GridValues(values.reshape(shape), tuple(dims), coords, name)


def _checked(name: str, values: GridValues, quantity: QuantitySection) -> GridValues:
    """Return values if their coordinates are valid and those of the experiment; else raise VibsimError."""
    for dim, points in values.coords.items():
        if points.dtype.kind == "f" and not np.isfinite(points).all():
            raise VibsimError(f"{name}: coordinate {dim} must be finite")
        if len(np.unique(points)) < len(points):
            raise VibsimError(f"{name}: the points of coordinate {dim} must differ from each other")
    if quantity.coordinates is None:
        return values
    if set(values.dims) != set(quantity.coordinates):
        actual = ", ".join(values.dims) or "none (a number)"
        rule = f"has the dimensions {actual}, and must have {', '.join(quantity.coordinates)}"
        raise VibsimError(f"{name}: {rule}")
    missing = [dim for dim in quantity.coordinates if dim not in values.coords]
    if missing:
        raise VibsimError(f"{name}: dimension {missing[0]} has no coordinate")
    return values


def record(
    experiment: SolverExperiment, level: int, member: int, values: Mapping[str, GridValues]
) -> Record:
    """Return the stored Record of a level: its quantities with their coordinates, its sizes and its parameters.

    Raises
    ------
    VibsimError
        Where a dimension has the name of a size, or two quantities have different points under one name.
    """
    coords: dict[str, Variable] = {
        LEVEL: plain((), np.int64(level), "position of the level, the coarsest 0")
    }
    for name, size in experiment.sizes_of(level).items():
        coords[name] = plain((), np.float64(size), f"size {name} of the level")
    for name, parameter in experiment.parameters_of(member).items():
        coords[name] = plain((), parameter, f"parameter {name}")
    taken = tuple(coords)
    lengths: dict[str, int] = {}
    for name, quantity in values.items():
        for dim, length in zip(quantity.dims, quantity.values.shape, strict=True):
            if dim in taken:
                rule = f"its dimension {dim} has the name of a size or a parameter"
                raise VibsimError(f"{name}: {rule}; rename one of them")
            points = quantity.coords.get(dim)
            known = coords.get(dim)
            is_other = known is not None and (
                points is None or not np.array_equal(known.values, points)
            )
            if lengths.setdefault(dim, length) != length or is_other:
                raise VibsimError(f"{name}: has other points along {dim} than another quantity")
            if points is not None and known is None:
                unit, calendar = quantity.units_of_coords.get(dim, (NO_UNIT, ""))
                more = {"calendar": calendar} if SINCE in unit else {}
                text = attributes(f"coordinate {dim}", unit or NO_UNIT, **more)
                coords[dim] = Variable((dim,), np.asarray(points), text)
    variables = {}
    for name, quantity in values.items():
        rounding: dict[str, Any] = {EPSILON: quantity.epsilon}
        if quantity.written is not None:
            rounding[WRITTEN] = str(quantity.written)
        if quantity.spacing:
            rounding[SPACING] = quantity.spacing
        text = attributes(name, quantity.units or NO_UNIT, **rounding)
        variables[name] = Variable(quantity.dims, quantity.values, text)
    return Record(coords, variables)


def plain(dims: tuple[str, ...], values: Any, text: str) -> Variable:
    """Return a variable without a unit."""
    return Variable(dims, np.asarray(values), attributes(text, "1"))


def stored(level: Record, name: str) -> GridValues:
    """Return a quantity from the stored Record of a level."""
    variable = level.variable(name)
    epsilon = variable.attrs[EPSILON]
    spacing = variable.attrs.get(SPACING, 0.0)
    assert isinstance(epsilon, float)
    assert isinstance(spacing, float)
    coords = {dim: level[dim] for dim in variable.dims if dim in level.coords}
    digits = variable.attrs.get(WRITTEN)
    return GridValues(
        np.asarray(variable.values),
        variable.dims,
        coords,
        name,
        epsilon,
        units_in(variable.attrs)[0],
        {dim: units_in(level.coords[dim].attrs) for dim in coords},
        None if digits is None else Decimal(str(digits)),
        spacing,
    )
