"""Read the values of levels from netCDF files of any program, one file for each level."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from vibsim.convergence.study.grid_values import (
    GridValues,
    plain_coordinate,
    real,
    spacing_in,
    units_in,
)
from vibsim.core import netcdf, regular_files
from vibsim.core.errors import Fault, InputError, nearest
from vibsim.solver.level_tables import Study, check_sizes

MAGIC = (b"CDF", b"\x89HDF")
"""First bytes of netCDF 3 and 4 files."""


def is_netcdf(path: Path) -> bool:
    """Tell whether a file is a netCDF file; raise InputError where it cannot be read."""
    try:
        with regular_files.reading(path) as stream:
            return stream.read(4).startswith(MAGIC)
    except OSError as error:
        _refuse(str(path), "", "", f"cannot be read ({error.strerror or error})")


def read(paths: Sequence[Path], size: str, quantities: Sequence[str]) -> list[Study]:
    """Return a study for each variable in the files.

    Parameters
    ----------
    paths
        One file for each level.
    size
        Name of an attribute, or of a variable with one value, that holds the step size of a file; or the step sizes
        themselves, separated by commas, in the order of the files.
    quantities
        Names of the variables; ``group/name`` for a variable in a group.

    Raises
    ------
    InputError
        Where a file cannot be read, or lacks the step size or a variable.
    """
    if not quantities:
        with opened(paths[0]) as dataset:
            names = (name for name in dataset.variables if name not in (*dataset.dimensions, size))
            hint = f"choose from {', '.join(names)}"
        _refuse(str(paths[0]), "--quantity", "", "must name the variables to be judged", hint)
    listed = _listed(size)
    if listed is not None and len(listed) != len(paths):
        rule = f"has {len(listed)} step sizes for {len(paths)} files"
        _refuse("vibsim judge", "--h", size, rule)
    for i, path in enumerate(paths):
        if path in paths[:i]:
            _refuse(str(path), "", "", "is named twice, and every level has a file of its own")
    chosen = list(dict.fromkeys(quantities))
    h, units = list[float](), dict[str, Path]()
    values: dict[str, list[GridValues]] = {name: [] for name in chosen}
    for i, path in enumerate(paths):
        with opened(path) as dataset:
            step, unit = (listed[i], "") if listed else _step_size(str(path), dataset, size)
            h.append(step)
            if unit:
                units.setdefault(unit, path)
            for name in chosen:
                values[name].append(grid_values(str(path), dataset, name, key="--quantity"))
    if len(units) > 1:
        (first, file), (other, path) = list(units.items())[:2]
        rule = f"has the unit {other}, in {file} it has {first}"
        _refuse(str(path), size, "", rule, "give all levels the same units")
    files = [str(path) for path in paths]
    check_sizes(((file, 0) for file in files), size if listed is None else "h", h)
    key = "h" if listed is not None else size.rpartition("/")[2]
    return [Study(name, {key: h}, values[name], files) for name in chosen]


def _refuse(file: str, key: str, value: str, rule: str, hint: str = "") -> NoReturn:
    raise InputError([Fault(file, 0, key, value, rule, hint)])


def _listed(size: str) -> list[float] | None:
    """Return the step sizes in a comma-separated list; None if `size` is a name."""
    try:
        return [float(part) for part in size.split(",")]
    except ValueError:
        if "," in size:
            _refuse("vibsim judge", "--h", size, "must be a name, or numbers separated by commas")
        return None


def opened(path: Path) -> Any:
    """Open a netCDF file; raise InputError where the library cannot read it."""
    try:
        return netcdf.foreign(path)
    except (OSError, RuntimeError) as error:
        _refuse(str(path), "", "", f"the netCDF library cannot read it ({error})")


def _variable(dataset: Any, name: str) -> Any | None:
    """Return a variable of the root group, or of another group by its path; None if it does not exist."""
    *groups, last = name.strip("/").split("/")
    for group in groups:
        if group not in dataset.groups:
            return None
        dataset = dataset.groups[group]
    return dataset.variables.get(last)


def _step_size(file: str, dataset: Any, name: str) -> tuple[float, str]:
    """Return the step size of a file, from an attribute or a variable with one value, and the unit of the variable."""
    variable, unit = _variable(dataset, name), ""
    if name in dataset.ncattrs():
        value = np.asarray(dataset.getncattr(name))
    elif variable is not None:
        value = np.ma.filled(np.ma.asarray(variable[...], dtype=np.float64), np.nan)
        unit = units_in(_attributes(variable))[0]
    else:
        single = [n for n, v, group in netcdf.variables(dataset) if v.size == 1 and not group]
        hint = nearest(name, [*dataset.ncattrs(), *single])
        _refuse(file, "--h", name, "is neither an attribute nor a variable of the file", hint)
    if value.size != 1:
        _refuse(file, "--h", name, f"has {value.size} values, and must have one")
    try:
        return float(value.reshape(())[()]), unit
    except ValueError:
        _refuse(file, name, str(value), "must be a number")


def grid_values(
    file: str, dataset: Any, name: str, dims: Sequence[str] | None = None, key: str = ""
) -> GridValues:
    """Return the values of a variable of the root group, or of another group by its path.

    `dims` are requested coordinates: a dimension with such a coordinate takes its name. `key` is the option that names
    the variable, for messages.

    Raises
    ------
    InputError
        Where the variable does not exist, or does not hold real numbers.
    """
    variable = _variable(dataset, name)
    if variable is None:
        known = [f"{group}/{n}" if group else n for n, _, group in netcdf.variables(dataset)]
        _refuse(file, key, name, "the file has no such variable", nearest(name, known))
    try:
        values, epsilon = real(np.ma.asarray(variable[...]), name)
    except (OSError, RuntimeError, ValueError) as error:
        _refuse(file, name, "", f"the netCDF library cannot read it ({error})")
    except InputError as error:
        fault = error.faults[0]
        _refuse(file, name, fault.value, fault.rule, fault.hint)
    new_names = {dim: dim for dim in variable.dimensions}
    for requested in dims or ():
        along: Sequence[str] = getattr(_variable(dataset, requested), "dimensions", ())
        if requested not in new_names and len(along) == 1 and along[0] in new_names:
            new_names[along[0]] = requested
    rows = ((new, _coordinate(variable, dataset, dim, new)) for dim, new in new_names.items())
    coordinates = {new: row for new, row in rows if row is not None}
    return GridValues(
        values,
        tuple(new_names.values()),
        {new: _points(row) for new, row in coordinates.items()},
        name,
        epsilon,
        units_in(_attributes(variable))[0],
        {new: units_in(_attributes(row)) for new, row in coordinates.items()},
        spacing=spacing_in({"dtype": variable.dtype, **_attributes(variable)}),
        file=file,
    )


def _attributes(variable: Any) -> dict[str, Any]:
    """Return the attributes of a variable of a dataset."""
    return {name: variable.getncattr(name) for name in variable.ncattrs()}


def _points(coordinate: Any) -> NDArray[Any]:
    """Return the numbers or labels of a coordinate."""
    points = np.ma.asarray(coordinate[...])
    is_float = points.dtype.kind == "f"
    return np.ma.filled(points, np.nan) if is_float else plain_coordinate(np.asarray(points))


def _coordinate(variable: Any, dataset: Any, dim: str, name: str) -> Any | None:
    """Return the coordinate of a dimension of a variable; None if it has none.

    It is a one-dimensional variable along this dimension, in the group of the values or in the root group: the one
    called `name`, else the one called as the dimension, else one that the attribute ``coordinates`` of the values lists
    (CF conventions).
    """
    listed = str(getattr(variable, "coordinates", "")).split()
    scopes: tuple[Mapping[str, Any], ...] = (variable.group().variables, dataset.variables)
    for scope, key in product(scopes, (name, dim, *listed)):
        candidate = scope.get(key)
        if candidate is not None and candidate.dimensions == (dim,):
            return candidate
    return None
