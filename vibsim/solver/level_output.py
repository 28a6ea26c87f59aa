"""What a solver wrote for one level: from its file or its dataset to values, and to the record that is stored."""

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
"""Attribute with the distance of neighbouring numbers near 1 in the precision that values were computed in."""
WRITTEN = "written"
"""Attribute of a number with the digits that it was written with in a table."""


def read(path: Path, quantities: Quantities, *, is_shown: bool = True) -> dict[str, GridValues]:
    """Return the quantities in a netCDF or CSV file; VibsimError where it does not have them as they are wanted.

    `is_shown`: whether messages may show what is in a table; see `vibsim.solver.level_tables.columns`.
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
    """Return the quantities in what a function returned; VibsimError where it does not have them as they are wanted."""
    if not hasattr(dataset, "data_vars"):
        kind = type(dataset).__name__
        raise VibsimError(f"returned a value of type {kind}, and must return an xarray.Dataset")
    found = {}
    for name, row in quantities.items():
        if name not in dataset.variables:
            hint = nearest(name, list(map(str, dataset.data_vars)))
            raise VibsimError(f"{name}: the dataset has no such variable: {hint}")
        array = dataset[name]
        for wanted in row.coordinates or ():
            if wanted not in array.dims and wanted in array.coords:
                array = array.swap_dims(dict.fromkeys(array.coords[wanted].dims, wanted))
        try:
            found[name] = _checked(name, grid_values(array, name), row)
        except InputError as error:
            raise VibsimError(f"{name}: {error.faults[0].value} {error.faults[0].rule}") from None
    return found


def _from_table(path: Path, quantities: Quantities, is_shown: bool) -> dict[str, GridValues]:
    """Return the quantities in the columns of a table: a row for each point, or a single one."""
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
    """Return a column as values on the grid of its coordinates; without them a number, or a series over the rows."""
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


def _checked(name: str, values: GridValues, wanted: QuantitySection) -> GridValues:
    """Return values with the coordinates that are wanted; VibsimError where they have others."""
    for dim, points in values.coords.items():
        if points.dtype.kind == "f" and not np.isfinite(points).all():
            raise VibsimError(f"{name}: coordinate {dim} must be finite")
        if len(np.unique(points)) < len(points):
            raise VibsimError(f"{name}: the points of coordinate {dim} must differ from each other")
    if wanted.coordinates is None:
        return values
    if set(values.dims) != set(wanted.coordinates):
        found = ", ".join(values.dims) or "none (a number)"
        rule = f"has the dimensions {found}, and must have {', '.join(wanted.coordinates)}"
        raise VibsimError(f"{name}: {rule}")
    missing = [dim for dim in wanted.coordinates if dim not in values.coords]
    if missing:
        raise VibsimError(f"{name}: dimension {missing[0]} has no coordinate")
    return values


def record(
    experiment: SolverExperiment, level: int, member: int, values: Mapping[str, GridValues]
) -> Record:
    """Return what is stored of a level: its quantities and their coordinates, its sizes and parameters.

    Raises
    ------
    VibsimError
        Where two quantities have different points under one name.
    """
    coords: dict[str, Variable] = {
        LEVEL: plain((), np.int64(level), "position of the level, the coarsest 0")
    }
    for name, size in experiment.sizes_of(level).items():
        coords[name] = plain((), np.float64(size), f"size {name} of the level")
    for name, parameter in experiment.parameters_of(member).items():
        coords[name] = plain((), parameter, f"parameter {name}")
    lengths: dict[str, int] = {}
    for name, one in values.items():
        for dim, length in zip(one.dims, one.values.shape, strict=True):
            points = one.coords.get(dim)
            known = coords.get(dim)
            is_other = known is not None and (
                points is None or not np.array_equal(known.values, points)
            )
            if lengths.setdefault(dim, length) != length or is_other:
                raise VibsimError(f"{name}: has other points along {dim} than another quantity")
            if points is not None and known is None:
                unit, calendar = one.units_of_coords.get(dim, (NO_UNIT, ""))
                more = {"calendar": calendar} if SINCE in unit else {}
                text = attributes(f"coordinate {dim}", unit or NO_UNIT, **more)
                coords[dim] = Variable((dim,), np.asarray(points), text)
    variables = {}
    for name, one in values.items():
        digits = {} if one.written is None else {WRITTEN: str(one.written)}
        text = attributes(name, one.units or NO_UNIT, **{EPSILON: one.epsilon}, **digits)
        variables[name] = Variable(one.dims, one.values, text)
    return Record(coords, variables)


def plain(dims: tuple[str, ...], values: Any, text: str) -> Variable:
    """Return what is stored of values without a unit."""
    return Variable(dims, np.asarray(values), attributes(text, "1"))


def stored(found: Record, name: str) -> GridValues:
    """Return a quantity of a level as it was stored."""
    variable = found.variable(name)
    epsilon = variable.attrs[EPSILON]
    assert isinstance(epsilon, float)
    coords = {dim: found[dim] for dim in variable.dims if dim in found.coords}
    digits = variable.attrs.get(WRITTEN)
    return GridValues(
        np.asarray(variable.values),
        variable.dims,
        coords,
        name,
        epsilon,
        units_in(variable.attrs)[0],
        {dim: units_in(found.coords[dim].attrs) for dim in coords},
        None if digits is None else Decimal(str(digits)),
    )
