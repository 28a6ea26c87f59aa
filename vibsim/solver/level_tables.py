"""Read a table with a row for each level, a column of step sizes, and a column for each quantity."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any

from vibsim.core.array_types import Floats, Integers
from vibsim.core.errors import Fault, InputError, nearest
from vibsim.experiment.tables import csv_text
from vibsim.experiment.yaml.file_content import MOST_BYTES, read_bytes

MOST_LEVELS = csv_text.ROWS_WRITTEN


@dataclass(frozen=True)
class Study:
    """The levels of one quantity, in the order of the rows or the files."""

    quantity: str
    h: Mapping[str, Sequence[float]]
    """Name and values of the step size."""
    values: Sequence[Any]
    """Numbers as they are written, or `vibsim.convergence.study.grid_values.GridValues`."""
    files: Sequence[str] = field(default_factory=tuple)


def read(path: Path, size: str, quantities: Sequence[str]) -> list[Study]:
    """Return a study for each quantity in a table.

    Parameters
    ----------
    path
        CSV or TSV text (`vibsim.experiment.tables.csv_text`).
    size
        Name of the column of step sizes.
    quantities
        Names of the columns of quantities; empty for all other columns.

    Raises
    ------
    InputError
        Where the table is invalid; it names file, line, column and value, and the rule that the value breaks.
    """
    file = str(path)
    names: list[str] = []

    def choose(known: list[str], _: bool) -> list[str]:
        names.extend(_chosen(file, known, size, quantities))
        return [size, *names]

    cells: list[list[str]] = []
    (h, *_), lines = _read(path, choose, MOST_LEVELS, cells)
    if not len(lines):
        raise InputError([Fault(file, 0, "", "", "has no row below the names of its columns")])
    check_sizes(((file, line) for line in lines.tolist()), size, h.tolist())
    columns = list(zip(*cells, strict=True))[1:]
    return [
        Study(name, {size: h.tolist()}, [_as_written(cell) for cell in column], [file])
        for name, column in zip(names, columns, strict=True)
    ]


def _as_written(cell: str) -> Decimal:
    try:
        return Decimal(cell)
    except InvalidOperation:
        # a power of ten beyond those of decimals
        return Decimal(float(cell))


def columns(
    path: Path, names: Sequence[str], most: int, *, is_shown: bool
) -> tuple[dict[str, Floats], dict[str, Decimal]]:
    """Return the columns `names` of a table with up to `most` rows, and their first numbers with their digits.

    Raises InputError, as `read`.

    With `is_shown` false, the file may be anything, and messages show only numbers of its content.
    """

    def choose(known: list[str], is_table: bool) -> Sequence[str]:
        for name in names:
            if known.count(name) != 1:
                problem = "more than one such column" if name in known else "no such column"
                hint = _hint(name, known) if name not in known and (is_shown or is_table) else ""
                raise InputError([Fault(str(path), 0, "", name, f"the table has {problem}", hint)])
        return names

    cells: list[list[str]] = []
    values, _ = _read(path, choose, most, cells, is_shown=is_shown)
    first = map(_as_written, cells[0]) if cells else ()
    return dict(zip(names, values, strict=True)), dict(zip(names, first, strict=False))


def _read(
    path: Path,
    choose: Callable[[list[str], bool], Sequence[str]],
    most: int,
    cells: list[list[str]] | None = None,
    *,
    is_shown: bool = True,
) -> tuple[list[Floats], Integers]:
    """Return the columns that `choose` selects from the names of all columns, and the line of every row.

    The cells of these columns are appended to `cells`.
    """

    def numbers(known: list[str], is_table: bool) -> list[int]:
        return [known.index(name) for name in choose(known, is_table)]

    try:
        return csv_text.read(read_bytes(path, MOST_BYTES), numbers, most, cells)
    except csv_text.CsvError as error:
        cell = _printable(error.cell) if is_shown or csv_text.is_shown(error.cell) else ""
        fault = Fault(str(path), error.line, error.column, cell, error.rule, error.hint)
        raise InputError([fault]) from None


def _printable(text: str) -> str:
    """Return a text with control characters escaped, so that a terminal can show it."""
    return text if text.isprintable() else ascii(text)


def _chosen(file: str, known: list[str], size: str, quantities: Sequence[str]) -> list[str]:
    """Return the names of the columns to be judged; raise InputError where the table lacks one."""
    if all(csv_text.is_shown(name) for name in known):
        raise InputError([Fault(file, 1, "", ",".join(known), "must be the names of the columns")])
    chosen = list(dict.fromkeys(quantities)) or [name for name in known if name != size]
    faults: list[tuple[str, str, str, str]] = []
    for name, option in ((size, "--h"), *((name, "--quantity") for name in chosen)):
        if name not in known:
            faults.append((option, name, "the table has no such column", _hint(name, known)))
        elif known.count(name) > 1:
            faults.append((option, name, "the table has more than one such column", ""))
        elif not name.isprintable():
            faults.append((option, _printable(name), "must be printable", ""))
        elif not name:
            hint = "name it, or choose with --quantity"
            faults.append(("", "", "has a column without a name", hint))
    if size in quantities:
        faults.append(("--quantity", size, "holds the step sizes (--h)", ""))
    if not chosen:
        faults.append(("", "", f"has no column beside '{size}'", ""))
    if faults:
        raise InputError(dict.fromkeys(Fault(file, 0, *fault) for fault in faults))
    return chosen


def _hint(name: str, known: list[str]) -> str:
    """Return a hint for a column that the table lacks."""
    if all(csv_text.is_shown(other) for other in known):
        return "the first line must hold the names of the columns"
    if len(known) == 1 and name in known[0].split():
        return "separate cells by commas, semicolons or tabs"
    return nearest(name, [_printable(other) for other in known])


def check_sizes(places: Iterable[tuple[str, int]], key: str, h: Sequence[float]) -> None:
    """Refuse step sizes that are not positive, finite and different.

    Parameters
    ----------
    places
        File and line of each step size; line 0 for a file with a single one.
    key
        Name of the step size in the files.
    """
    faults, seen = [], dict[float, str]()
    for (file, line), size in zip(places, h, strict=True):
        if not 0.0 < size < math.inf:
            faults.append(Fault(file, line, key, f"{size:g}", "must be a finite number above 0"))
        elif size in seen:
            rule = f"is the step size of {seen[size]}, too; all must differ"
            faults.append(Fault(file, line, key, f"{size:g}", rule))
        seen.setdefault(size, f"line {line}" if line else file)
    if faults:
        raise InputError(faults)
