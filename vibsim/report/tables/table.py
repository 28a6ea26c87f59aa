"""Tables as text for reading and as CSV with all digits for computing; LaTeX is in `latex.py`."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import Any

from vibsim.report import words

Cell = str | int | float | None
_FORMULA = ("=", "+", "-", "@", "\t", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")
"""First characters of a spreadsheet formula; the last four are their full-width forms."""


class Written(float):
    """A number with the text that is shown instead; files for computing hold the number."""

    text: str

    def __new__(cls, value: float, text: str) -> Written:
        """Return the number `value`, written as `text`."""
        made = super().__new__(cls, value)
        made.text = text
        return made


@dataclass(frozen=True)
class Column:
    """One column."""

    header: str
    unit: str = ""
    form: str = "text"  # ``text``, ``printed`` (see `words.printed`), or a form of `words.number`

    @property
    def title(self) -> str:
        """Header with the unit in brackets."""
        return f"{self.header} [{self.unit}]" if self.unit else self.header


@dataclass(frozen=True)
class Table:
    """A table with a caption; every row has one cell per column."""

    name: str
    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    heads: int = 0  # number of columns at the left that a page shows once, above each block of rows

    def __post_init__(self) -> None:
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"table {self.name}: a row does not have {len(self.columns)} cells")

    def without_empty(self, headers: Collection[str] | None = None) -> Table:
        """Return the table without the empty ones among the columns `headers`, or among all but the heads."""
        chosen = [
            i
            for i, column in enumerate(self.columns)
            if not (column.header in headers if headers is not None else i >= self.heads)
            or any(not is_nothing(row[i]) for row in self.rows)
        ]
        return self.only(chosen)

    def only(self, columns: Sequence[int]) -> Table:
        """Return the table with the columns at these places."""
        rows = tuple(tuple(row[i] for i in columns) for row in self.rows)
        return replace(self, columns=tuple(self.columns[i] for i in columns), rows=rows)

    def text_rows(self) -> Iterator[list[str]]:
        """Yield every row as text."""
        forms = [self._form(i) for i in range(len(self.columns))]
        for row in self.rows:
            yield [_text(cell, form) for cell, form in zip(row, forms, strict=True)]

    def _form(self, i: int) -> str:
        """Return the form of a column: if one norm needs a power of ten, all have one, so that they compare."""
        form = self.columns[i].form
        sizes = [abs(row[i]) for row in self.rows if isinstance(row[i], float)]  # type: ignore[arg-type]
        nonzero = [size for size in sizes if 0 < size < math.inf]
        needs_power = nonzero and not 0.1 <= min(nonzero) <= max(nonzero) < 1e4
        return "small" if form == "norm" and needs_power else form


Filled = tuple[Column, Callable[[Any], Cell]]  # a column, and what gives its cell for an object


def keyed(key: str, unit: str = "", form: str = "text") -> Filled:
    """Return a column of the values of a key of the objects, under its name."""
    return Column(key, unit, form), itemgetter(key)


def filled(
    name: str, caption: str, columns: Sequence[Filled], objects: Iterable[Any], heads: int = 0
) -> Table:
    """Return a table with a row for each object."""
    rows = tuple(tuple(fill(one) for _, fill in columns) for one in objects)
    return Table(name, caption, tuple(column for column, _ in columns), rows, heads)


def is_nothing(cell: Cell) -> bool:
    """Return whether a cell is empty."""
    return cell is None or (isinstance(cell, float) and math.isnan(cell))


def _text(cell: Cell, form: str) -> str:
    if cell is None:
        return "–"
    if isinstance(cell, Written):
        return cell.text
    if isinstance(cell, str):
        return words.printed(cell) if form == "printed" and cell else cell
    return words.number(cell, form)


def to_csv(table: Table) -> str:
    """Return a table as CSV: units in the header, floats with all digits, empty cells for missing values."""
    lines = [csv_line([column.title for column in table.columns])]
    lines += [csv_line([_exact(cell) for cell in row]) for row in table.rows]
    return "".join(lines)


def csv_line(cells: Sequence[str]) -> str:
    """Return a line of CSV; text that a spreadsheet would run as a formula is prefixed with an apostrophe.

    Source: OWASP, CSV injection.
    """
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerow([_harmless(cell) for cell in cells])
    return stream.getvalue()


def _harmless(text: str) -> str:
    # the writer does not quote a lone carriage return, which would end the line
    cell = text.replace("\r\n", "\n").replace("\r", "\n")
    if not cell.startswith(_FORMULA):
        return cell
    try:
        float(cell)
    except ValueError:
        return f"'{cell}"
    return cell


def _exact(cell: Cell) -> str:
    if cell is None or is_nothing(cell):
        return ""
    return repr(float(cell)) if isinstance(cell, float) else str(cell)
