"""Read tables from CSV or netCDF files: values at equally spaced abscissae, or loads over time.

A CSV file is UTF-8 text (`vibsim.experiment.tables.csv_text`). A netCDF file has two one-dimensional variables.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from vibsim.core import netcdf
from vibsim.core.array_types import Floats
from vibsim.core.errors import nearest
from vibsim.experiment.data import ExperimentSpec
from vibsim.experiment.schema.fields import TABLE
from vibsim.experiment.tables import csv_text
from vibsim.experiment.tables.content import MOST_LISTED, TableError, bytes_of, reason
from vibsim.models.table import FEWEST_POINTS, Table

ENDINGS = (".csv", ".nc")
MOST_POINTS = 2**20
EVEN = 1e-3  # tolerance for equal spacing of abscissae, in spacings: a file may have rounded them
UNIT = "m"
WORDS = {"x": "places", "t": "times"}  # name of the content of the first column, by its key
MOST_SHOWN = 40  # largest number of characters of a name in a message


_Columns = tuple[Floats, Floats, Callable[[Any], str], tuple[str, str]]
"""Abscissae and values; for messages a function that gives the place of a point in the file, and their names there."""


def read(path: Path, keys: tuple[str, str], names: tuple[str, str]) -> tuple[Table, str]:
    """Return the table in the file at `path`, and the SHA-256 of its bytes; raise `TableError` if it is invalid.

    `names` are those of the columns of abscissae and values; `keys` are the keys of the experiment that give them.
    """
    columns, content = _read(path, keys, names, UNIT)
    return _table(columns), content


def read_history(path: Path, names: tuple[str, str]) -> tuple[Floats, str]:
    """Return times and loads in the file at `path`, shape (2, point), and the SHA-256 of its bytes.

    Times increase from 0 or below, with any spacing. Raises `TableError` if the file is not such a table.
    """
    columns, content = _read(path, ("t", "p"), names, "")
    t, p, _, (name, _) = columns
    if len(t) < 2:
        raise TableError(f"must have at least 2 points, has {len(t)}")
    _check_rising(columns)
    if t[0] > 0.0:
        raise TableError(_late(name, t[0]))
    return np.stack([t, p]), content


def _read(
    path: Path, keys: tuple[str, str], names: tuple[str, str], unit: str
) -> tuple[_Columns, str]:
    content = bytes_of(path, ENDINGS, "table")
    if names[0] == names[1]:
        rule = f"must be another column than '{names[0]}', which holds the {WORDS[keys[0]]}"
        raise TableError(rule, key=keys[1])
    if path.suffix.lower() == ".csv":
        columns = _from_text(content, keys, names)
    else:
        columns = _from_netcdf(content, keys, names, unit)
    return columns, hashlib.sha256(content).hexdigest()


def _from_text(content: bytes, keys: tuple[str, str], names: tuple[str, str]) -> _Columns:
    shown = names

    def choose(known: list[str], may_list: bool) -> list[int]:
        nonlocal shown
        pairs = zip(keys, names, strict=True)
        if len(set(known)) == len(known) == 2 and names == keys and may_list:
            # two columns need no names in the file: the first holds the places, and certainly if these are times
            swapped = known[0] == names[1] or known[1] == names[0]
            order = [1, 0] if swapped and known[0] != "t" else [0, 1]
            shown = known[order[0]][:MOST_SHOWN], known[order[1]][:MOST_SHOWN]
            return order
        return [_found(known, name, key, "column", may_list=may_list) for key, name in pairs]

    try:
        (place, value), lines = csv_text.read(content, choose, MOST_POINTS)
    except csv_text.CsvError as error:
        rule = error.rule
        if error.line:
            # a link may lead to a private file, so show numbers only
            cell = f"'{error.cell}' " if error.cell and csv_text.is_shown(error.cell) else ""
            column = f", in column '{error.column}'" if error.column else ""
            what = "" if cell or not error.column else "the cell "
            rule = f"line {error.line}: {cell}{what}{error.rule}{column}"
        raise TableError(rule, error.hint) from None
    return place, value, lambda i: f"line {lines[i]}", shown


def _found(names: list[str], name: str, key: str, word: str, *, may_list: bool = True) -> int:
    """Return the index of the column `name`; `may_list`: messages may list the other names."""
    if name not in names:
        hint = nearest(name, [known[:MOST_SHOWN] for known in names]) if may_list else ""
        if len(names) > MOST_LISTED and not hint.startswith("did"):
            hint = f"it has {len(names)}"
        raise TableError(f"the table has no {word} '{name}'", hint, key)
    if names.count(name) > 1:
        raise TableError(f"the table has more than one {word} '{name}'", key=key)
    return names.index(name)


def _from_netcdf(
    content: bytes, keys: tuple[str, str], names: tuple[str, str], unit: str
) -> _Columns:
    try:
        with netcdf.foreign(content) as dataset:
            found = [_variable(dataset, *pair, unit) for pair in zip(keys, names, strict=True)]
    except (OSError, RuntimeError) as error:
        raise TableError(f"the netCDF library cannot read it ({reason(error)})") from None
    place, value = found
    if len(place) != len(value):
        rule = f"'{names[0]}' has {len(place)} points, '{names[1]}' has {len(value)}"
        raise TableError(f"both variables must be of one dimension: {rule}")
    return place, value, lambda i: f"index {i}", names


def _variable(dataset: Any, key: str, name: str, unit: str) -> Floats:
    """Return a one-dimensional variable as floats, with NaN for missing values; its unit must be `unit`, if given."""
    known = list(dataset.variables)
    variable = dataset.variables[known[_found(known, name, key, "variable")]]
    if len(variable.dimensions) != 1:
        dims = len(variable.dimensions)
        raise TableError(f"variable '{name}' must have one dimension, and has {dims}", key=key)
    own = str(getattr(variable, "units", unit)).strip()
    if unit and own not in (unit, "metre", "meter", "metres", "meters"):
        raise TableError(f"variable '{name}' is in '{own}', and must be in {unit}", key=key)
    if variable.size > MOST_POINTS:
        raise TableError(f"must not have more than {MOST_POINTS} points, has {variable.size}")
    if variable.dtype is str or variable.dtype.kind not in "fiu":
        raise TableError(f"variable '{name}' must hold numbers", key=key)
    values = np.ma.asarray(variable[:])
    return np.ma.filled(values.astype(np.float64), np.nan)


def _late(name: str, first: float) -> str:
    return f"'{name}' must begin at 0 or below, where the motion starts; it begins at {first:.10g}"


def _check_rising(columns: _Columns) -> None:
    """Refuse non-finite numbers, and abscissae that do not increase."""
    x, h, place_of, names = columns
    for name, values in zip(names, (x, h), strict=True):
        wrong = np.flatnonzero(~np.isfinite(values))
        if len(wrong):
            rule = f"{place_of(wrong[0])}: '{name}' is {values[wrong[0]]:g}, and must be finite"
            raise TableError(rule)
    falling = np.flatnonzero(np.diff(x) <= 0.0)
    if len(falling):
        i = int(falling[0])
        rule = f"'{names[0]}' must increase, but is {x[i]:.10g} and then {x[i + 1]:.10g}"
        raise TableError(f"{place_of(i + 1)}: {rule}")


def _table(columns: _Columns) -> Table:
    x, h, place_of, (name, _) = columns
    if len(x) < FEWEST_POINTS:
        raise TableError(f"must have at least {FEWEST_POINTS} points, has {len(x)}")
    _check_rising(columns)
    spacing = float(x[-1] - x[0]) / (len(x) - 1)
    if not 0.0 < spacing < np.inf:
        raise TableError(f"'{name}' must span a finite length")
    gaps, even = np.diff(x), x[0] + np.arange(len(x)) * spacing
    usual = float(np.median(gaps))
    if np.any(np.abs(x - even) > EVEN * usual):
        # the first gap that differs from the median gap
        odd = np.flatnonzero(np.abs(gaps - usual) > EVEN * usual)
        i = min(int(odd[0] if len(odd) else np.argmax(np.abs(x - even))), len(gaps) - 1)
        rule = (
            f"'{name}' must be equally spaced, but is {gaps[i]:.10g} further than the point before"
        )
        hint = f"the others are {usual:.10g} apart"
        raise TableError(f"{place_of(i + 1)}: {rule}", hint)
    if x[0] > EVEN * spacing:
        raise TableError(_late(name, x[0]))
    table = Table(float(x[0]), spacing, h)
    with np.errstate(all="ignore"):
        if not np.isfinite(table.rows).all():
            raise TableError("its second differences are too large to be numbers")
    return table


def attach(experiment: ExperimentSpec) -> None:
    """Read the tables of an experiment that was restored without their numbers.

    Raises `InputError` if one cannot be read, or its numbers have changed.
    """
    keys = {row.name: row.table or ("", "") for row in experiment.model.base.formulas}
    for name, spec in experiment.model.tables.items():
        try:
            path, columns = experiment.folder / spec.file, (spec.place, spec.value)
            table, content = read(path, keys[name], columns)
            if table.digest != spec.numbers:
                rule = "has other numbers than when the experiment was read"
                raise TableError(rule, "run the experiment again")
        except TableError as error:
            key = f"model.{name}.{TABLE}"
            raise experiment.refused(key, spec.file, error.rule, error.hint) from None
        spec.hold(table, content)
