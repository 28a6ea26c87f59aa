"""Numbers from CSV text: a line with the names of the columns, then a line of cells for each row.

Cells are separated by commas, semicolons or tabs, whichever the line of names has. Empty lines and lines that begin
with ``#`` do not count; a byte order mark, quotes around cells, spaces around them, any end of line, and one separator
at the end of a line are allowed. A decimal comma is read where a cell can hold one: between semicolons or tabs, or in
quotes. What could be read in two ways is refused.
"""

from __future__ import annotations

import csv
import re
from array import array
from collections.abc import Callable, Iterator, Sequence
from io import BytesIO, TextIOWrapper
from itertools import chain

import numpy as np

from vibsim.core.array_types import Floats, Integers

MOST_LINES = 2**21
"""Lines of a text, the empty ones and the comments too."""
ROWS_WRITTEN = 1000
"""Rows whose cells are kept as they are written, at most."""
MOST_CHARACTERS = 2**16
"""Of a line."""
SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas"}
"""In the order in which they are looked for: a name may hold a comma where cells have another separator."""

_QUOTED = re.compile(r'"[^"]*"')
_DECIMAL_COMMA = re.compile(r"[+-]?([0-9]+,[0-9]*|,[0-9]+)([eE][+-]?[0-9]+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(,[0-9]{3})+")
_FORTRAN = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)[dD][+-]?[0-9]+")
_GROUPED = re.compile(r"[+-]?[0-9]{1,3}([.,' \u00a0\u202f][0-9]{3})+([.,][0-9]*)?")
_NUMERIC = re.compile(r"[-+0-9.,eE' \u00a0\u202f]{1,40}")
_POINTS = "write all numbers with points"


class CsvError(ValueError):
    """Text that is no table of numbers.

    Parameters
    ----------
    rule, hint
        The rule that is broken, and how to keep it.
    line
        Line of the text, from 1; 0 where it is none of its own.
    column, cell
        Name of the column and the cell that is at fault; empty where it is none. They are the content of a file that
        may be no table at all, and belong in no message unless the reader named that file.
    """

    def __init__(
        self, rule: str, hint: str = "", line: int = 0, column: str = "", cell: str = ""
    ) -> None:
        self.rule, self.hint, self.line, self.column, self.cell = rule, hint, line, column, cell
        super().__init__(f"line {line}: {rule}" if line else rule)


class _Rows:
    """The cells of every line of a text that counts; `line` is the number of the last one."""

    def __init__(self, content: bytes) -> None:
        # counted first: each line costs more than a look at its bytes
        if max(content.count(b"\n"), content.count(b"\r")) > MOST_LINES:
            raise CsvError(f"must not have more than {MOST_LINES} lines")
        try:
            content.decode("utf-8")
        except UnicodeDecodeError as error:
            line = content.count(b"\n", 0, error.start) + 1
            raise CsvError(f"must be UTF-8 text, but line {line} is none") from None
        self.line = 0
        lines = self._lines(TextIOWrapper(BytesIO(content), encoding="utf-8-sig", newline=None))
        head = next(lines, "")
        if not head:
            raise CsvError("must not be empty")
        plain = _QUOTED.sub("", head)
        self.separator = next((separator for separator in SEPARATORS if separator in plain), ",")
        self.reader = csv.reader(
            chain([head], lines), delimiter=self.separator, skipinitialspace=True
        )

    def _lines(self, stream: TextIOWrapper) -> Iterator[str]:
        for self.line, line in enumerate(stream, 1):
            if len(line) > MOST_CHARACTERS:
                rule = f"must not be longer than {MOST_CHARACTERS} characters"
                raise CsvError(rule, line=self.line)
            text = line.lstrip()
            if text and text[0] != "#":
                yield line

    def __iter__(self) -> Iterator[list[str]]:
        try:
            for taken, row in enumerate(self.reader, 1):
                if self.reader.line_num > taken:
                    raise CsvError("a quoted cell must end on its line", line=self.line)
                yield row
        except csv.Error:
            raise CsvError("its quotes cannot be read", line=self.line) from None


def read(
    content: bytes,
    choose: Callable[[list[str], bool], Sequence[int]],
    most: int,
    written: list[list[str]] | None = None,
) -> tuple[list[Floats], Integers]:
    """Return columns of the bytes of a file, of equal length, and the line of every row, from 1.

    CsvError where it is no table of numbers in these columns.

    Parameters
    ----------
    choose
        Returns the numbers of the columns that are to be read, from 0; the others may hold anything. It gets the names
        of all columns, and whether two cells at least of the line below are numbers: else the text may be no table, and
        is not shown.
    most
        Number of rows that are read at most.
    written
        Takes the cells of these columns in the first `ROWS_WRITTEN` rows, with decimal points: zeros at the end are
        digits of what was printed.
    """
    source = _Rows(content)
    rows = iter(source)
    names = [name.strip() for name in next(rows)]
    if len(names) > 1 and not names[-1]:
        names.pop()
    first = next(rows, [])
    marks = _Marks(source.separator)
    chosen = [(i, names[i], array("d")) for i in choose(names, sum(map(_is_number, first)) > 1)]
    lines = array("q")
    for row in chain([first] if first else [], rows):
        if len(row) != len(names):
            _check_width(row, names, source)
        if len(lines) == most:
            raise CsvError(f"must not have more than {most} points")
        for i, name, column in chosen:
            column.append(marks.number(row[i], name, source.line, is_first=not lines))
        if written is not None and len(written) < ROWS_WRITTEN:
            written.append([row[i].strip().replace(",", ".") for i, *_ in chosen])
        lines.append(source.line)
    marks.finish()
    columns = [np.array(column, dtype=np.float64) for _, _, column in chosen]
    return columns, np.array(lines, dtype=np.int64)


def _check_width(row: list[str], names: list[str], source: _Rows) -> None:
    """Refuse a row with another number of cells than there are columns, but for a separator at its end."""
    found, wanted, separator = len(row), len(names), source.separator
    if found == wanted + 1 and not row[-1].strip():
        return
    cells = "1 cell" if found == 1 else f"{found} cells"
    word = "column" if wanted == 1 else "columns"
    rule = f"has {cells} between {SEPARATORS[separator]}, and the table has {wanted} {word}"
    hint = ""
    if separator == "," and found > wanted:
        write = "write 1.5, or separate the cells by semicolons"
        hint = f"a number with a decimal comma is two cells: {write}"
    elif wanted == 1:
        hint = f"separate cells by {', '.join(SEPARATORS.values())}"
    raise CsvError(rule, hint, source.line)


class _Marks:
    """Reads cells, all with the same decimal mark."""

    def __init__(self, separator: str) -> None:
        self.separator = separator
        self.points = self.commas = 0
        """Line of the first cell with such a mark."""
        self.clear = False
        """Whether a comma was seen that separates no thousands."""

    def number(self, cell: str, column: str, line: int, *, is_first: bool) -> float:
        """Return the number in a cell."""
        text, is_plain = cell.strip(), "_" not in cell and cell.isascii()
        try:
            value = float(cell) if is_plain else None
        except ValueError:
            value = None
        if value is not None:
            self.points = self.points or (line if "." in cell else 0)
        elif _DECIMAL_COMMA.fullmatch(text):
            self.commas = self.commas or line
            self.clear = self.clear or not _THOUSANDS.fullmatch(text)
            value = float(text.replace(",", "."))
        else:
            rule, hint = "is no number" if text else "is empty", ""
            if _GROUPED.fullmatch(text):
                hint = "write it without separators of thousands"
            elif _FORTRAN.fullmatch(text):
                hint = f"write {re.sub('[dD]', 'e', text)}"
            elif is_first and text and not text[0].isdigit():
                hint = "a row of units must begin with #"
            raise CsvError(rule, hint, line, column, text)
        if self.points and self.commas:
            lines = f"decimal points (line {self.points}) and decimal commas (line {self.commas})"
            raise CsvError(f"the table has {lines}", _POINTS, 0, column, cell)
        return value

    def finish(self) -> None:
        """Refuse a table whose commas may all separate thousands."""
        if self.commas and not self.clear and self.separator != ";":
            rule = "the comma may be a decimal mark or separate thousands"
            raise CsvError(rule, _POINTS, self.commas)


def _is_number(cell: str) -> bool:
    try:
        _Marks(";").number(cell, "", 1, is_first=False)
    except CsvError:
        return False
    return True


def is_shown(cell: str) -> bool:
    """Tell whether a cell is made of what numbers are made of, so that a message may show it whatever the file is."""
    return _NUMERIC.fullmatch(cell) is not None
