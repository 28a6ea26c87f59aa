"""Read numbers from CSV text: a header with the names of the columns, then one line of cells per row.

The header determines the separator: comma, semicolon or tab. Empty lines and lines that begin with ``#`` are skipped. A
byte order mark, quotes and spaces around cells, any line ending, and one separator at the end of a line are allowed. A
decimal comma is accepted between semicolons or tabs, or in quotes. Ambiguous numbers are refused.
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

MOST_LINES = 2**21  # largest number of lines, including empty lines and comments
ROWS_WRITTEN = 1000  # largest number of rows whose cells are kept as text
MOST_CHARACTERS = 2**16  # largest number of characters of a line
SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas"}
"""Separators in the order in which they are tried: with another separator, names may contain a comma."""

_QUOTED = re.compile(r'"[^"]*"')
_DECIMAL_COMMA = re.compile(r"[+-]?([0-9]+,[0-9]*|,[0-9]+)([eE][+-]?[0-9]+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(,[0-9]{3})+")
_FORTRAN = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)[dD][+-]?[0-9]+")
_GROUPED = re.compile(r"[+-]?[0-9]{1,3}([.,' \u00a0\u202f][0-9]{3})+([.,][0-9]*)?")
_NUMERIC = re.compile(r"[-+0-9.,eE' \u00a0\u202f]{1,40}")
_POINTS = "write all numbers with points"


class CsvError(ValueError):
    """Text that is not a table of numbers: the rule that it breaks, a hint, and where.

    `line` counts from 1, and is 0 if no particular line is faulty; `column` and `cell` are the name and the text of a
    faulty cell. The file may not be a table at all, so messages show its content only to a user who named the file.
    """

    def __init__(
        self, rule: str, hint: str = "", line: int = 0, column: str = "", cell: str = ""
    ) -> None:
        self.rule, self.hint, self.line, self.column, self.cell = rule, hint, line, column, cell
        super().__init__(f"line {line}: {rule}" if line else rule)


class _Rows:
    """Iterates over the rows of cells of a text, without skipped lines; `line` is the number of the current line."""

    def __init__(self, content: bytes) -> None:
        # counting lines is cheaper than parsing them
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
    """Return the chosen columns of the content of a file, and the line number of every row, from 1.

    `choose` returns the indices of the columns to read, from 0; the others may contain anything. Its arguments are the
    names of all columns, and whether the first row has at least two numbers; otherwise the text may not be a table, and
    messages do not show it. `most` is the largest number of rows. To `written`, if given, the cells of these columns in
    the first `ROWS_WRITTEN` rows are appended, with decimal points and all zeros, which are digits of what was printed.
    Raises `CsvError` if these columns are not a table of numbers.
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
    """Refuse a row whose number of cells differs from that of columns; a separator at its end is allowed."""
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
    """Reads cells, which must all have the same decimal mark."""

    def __init__(self, separator: str) -> None:
        self.separator = separator
        self.points = self.commas = 0
        """Line of the first cell with a decimal point, and with a decimal comma; 0 if there is none."""
        self.clear = False
        """Whether some comma is certainly a decimal mark, not a thousands separator."""

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
            rule, hint = "is not a number" if text else "is empty", ""
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
        """Refuse a table whose commas may all be thousands separators."""
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
    """Tell whether a cell contains only characters of numbers, so that any message may show it."""
    return _NUMERIC.fullmatch(cell) is not None
