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
from dataclasses import dataclass
from io import BytesIO, TextIOWrapper
from itertools import chain

import numpy as np
from numpy.typing import NDArray

MOST_LINES = 2**21
"""Lines of a text, the empty ones and the comments too."""
MOST_CHARACTERS = 2**16
"""Of a line."""
SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas"}
"""In the order in which they are looked for: a name may hold a comma where cells have another separator."""

_QUOTED = re.compile(r'"[^"]*"')
_DECIMAL_COMMA = re.compile(r"[+-]?([0-9]+,[0-9]*|,[0-9]+)([eE][+-]?[0-9]+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(,[0-9]{3})+")
_GROUPED = re.compile(r"[+-]?[0-9]{1,3}([.,' \u00a0\u202f][0-9]{3})+([.,][0-9]*)?")
_NUMERIC = re.compile(r"[-+0-9.,eE' \u00a0\u202f]{1,40}")
_WRITE = "write 1.5, or separate the cells by semicolons"


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


@dataclass(frozen=True)
class Header:
    """The first line of a text."""

    names: list[str]
    """Of all columns."""
    is_of_numbers: bool
    """Whether two cells at least of the line below are numbers: else the text may be no table, and is not shown."""


@dataclass(frozen=True)
class Numbers:
    """Columns of a text, as numbers."""

    columns: tuple[NDArray[np.float64], ...]
    """Those that were chosen, of equal length."""
    lines: NDArray[np.int64]
    """Line of every row, from 1."""


def read(content: bytes, choose: Callable[[Header], Sequence[int]], most: int) -> Numbers:
    """Return columns of a text.

    Parameters
    ----------
    content
        The bytes of a file.
    choose
        Returns the numbers of the columns that are to be read, from 0; the others may hold anything.
    most
        Number of rows that are read at most.

    Raises
    ------
    CsvError
        Where it is no table of numbers in these columns.
    """
    lines = _Lines(content)
    separator = _separator(lines.head)
    rows = _rows(lines, separator)
    names = [name.strip() for name in next(rows)]
    if len(names) > 1 and not names[-1]:
        names.pop()
    first = next(rows, [])
    header = Header(names, sum(map(_is_number, first)) > 1)
    marks = _Marks(separator)
    chosen = [(i, names[i], array("d")) for i in choose(header)]
    numbers = array("q")
    for row in chain([first] if first else [], rows):
        if len(row) != len(names):
            _check_width(row, names, separator, lines.number)
        if len(numbers) == most:
            raise CsvError(f"must not have more than {most} points")
        for i, name, column in chosen:
            column.append(marks.number(row[i], name, lines.number, is_first=not numbers))
        numbers.append(lines.number)
    marks.finish()
    columns = tuple(np.array(column, dtype=np.float64) for _, _, column in chosen)
    return Numbers(columns, np.array(numbers, dtype=np.int64))


class _Lines:
    """The lines of a text that count, one by one; `number` is that of the last one."""

    def __init__(self, content: bytes) -> None:
        # counted first: each line costs more than a look at its bytes
        if max(content.count(b"\n"), content.count(b"\r")) > MOST_LINES:
            raise CsvError(f"must not have more than {MOST_LINES} lines")
        self.content = content
        self.number = 0
        self.lines = self._read()
        self.head = next(self.lines, "")
        if not self.head:
            raise CsvError("must not be empty")

    def _read(self) -> Iterator[str]:
        stream = TextIOWrapper(BytesIO(self.content), encoding="utf-8-sig", newline=None)
        try:
            for number, line in enumerate(stream, 1):
                self.number = number
                if len(line) > MOST_CHARACTERS:
                    rule = f"must not be longer than {MOST_CHARACTERS} characters"
                    raise CsvError(rule, line=number)
                text = line.lstrip()
                if text and text[0] != "#":
                    yield line
        except UnicodeDecodeError:
            raise CsvError(f"must be UTF-8 text, but line {self._foreign()} is none") from None

    def _foreign(self) -> int:
        """Return the first line that is not UTF-8: a stream only knows the place within what it has read last."""
        try:
            self.content.decode("utf-8")
        except UnicodeDecodeError as error:
            return self.content.count(b"\n", 0, error.start) + 1
        return 1


def _separator(head: str) -> str:
    plain = _QUOTED.sub("", head)
    return next((separator for separator in SEPARATORS if separator in plain), ",")


def _rows(lines: _Lines, separator: str) -> Iterator[list[str]]:
    """Yield the cells of every line."""
    cells = chain([lines.head], lines.lines)
    reader = csv.reader(cells, delimiter=separator, skipinitialspace=True)
    taken = 0
    while True:
        try:
            row = next(reader, None)
        except csv.Error:
            raise CsvError("its quotes cannot be read", line=lines.number) from None
        if row is None:
            return
        taken += 1
        if reader.line_num > taken:
            raise CsvError("a quoted cell must end on its line", line=lines.number)
        yield row


def _check_width(row: list[str], names: list[str], separator: str, line: int) -> None:
    """Refuse a row with another number of cells than there are columns, but for a separator at its end."""
    found, wanted = len(row), len(names)
    if found == wanted + 1 and not row[-1].strip():
        return
    cells = "1 cell" if found == 1 else f"{found} cells"
    word = "column" if wanted == 1 else "columns"
    rule = f"has {cells} between {SEPARATORS[separator]}, and the table has {wanted} {word}"
    hint = ""
    if separator == "," and found > wanted:
        hint = f"a number with a decimal comma is two cells: {_WRITE}"
    elif wanted == 1:
        hint = f"separate cells by {', '.join(SEPARATORS.values())}"
    raise CsvError(rule, hint, line)


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
        try:
            value = float(cell)
        except ValueError:
            return self._other(cell.strip(), column, line, is_first)
        if "_" in cell or not cell.isascii():
            return self._other(cell.strip(), column, line, is_first)
        if "." in cell:
            self.points = self.points or line
            if self.commas:
                self._refuse_both(line, column, cell)
        return value

    def _other(self, text: str, column: str, line: int, is_first: bool) -> float:
        """Return the number in a cell that has a decimal comma, or none."""
        if _DECIMAL_COMMA.fullmatch(text):
            self.commas = self.commas or line
            self.clear = self.clear or not _THOUSANDS.fullmatch(text)
            if self.points:
                self._refuse_both(line, column, text)
            return float(text.replace(",", "."))
        rule, hint = "is no number" if text else "is empty", ""
        if _GROUPED.fullmatch(text):
            hint = "write it without separators of thousands"
        elif text and is_first:
            hint = "a row of units must begin with #"
        raise CsvError(rule, hint, line, column, text)

    def _refuse_both(self, line: int, column: str, cell: str) -> None:
        rule = (
            f"decimal points (line {self.points}) and decimal commas (line {self.commas or line})"
        )
        raise CsvError(f"the table has {rule}", "write all numbers with points", 0, column, cell)

    def finish(self) -> None:
        """Refuse a table whose commas may all separate thousands."""
        if self.commas and not self.clear and self.separator != ";":
            rule = "the comma may be a decimal mark or separate thousands"
            raise CsvError(rule, "write all numbers with points", self.commas)


def _is_number(cell: str) -> bool:
    try:
        _Marks(";").number(cell, "", 1, is_first=False)
    except CsvError:
        return False
    return True


def is_shown(cell: str) -> bool:
    """Tell whether a cell is made of what numbers are made of, so that a message may show it whatever the file is."""
    return _NUMERIC.fullmatch(cell) is not None
