"""The members of a sweep, one row each, as a table for reading and as a file for computing.

The file is written in pieces, each by one formatting operation, so that a million rows take some seconds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim import store
from vibsim.report import finest_level, words
from vibsim.report.data import Results
from vibsim.report.tables.table import Column, Table, csv_line

LISTED = 10_000  # most rows of the table, and of a file with all digits of measured numbers
DIGITS = 9  # significant digits of measured numbers in longer files
ROWS_AT_A_TIME = 10_000  # in one formatting operation
Field = tuple[Column, NDArray[Any]]  # a column and its values, shape (scheme, case)


def fields(record: Results) -> list[Field]:
    """Return the fields of every member: index and swept values first, then the measured ones.

    A member whose order is undecided has none.
    """
    quantity, level = record.model.position, record.levels[-1]
    error, error_unit = finest_level.error(record, quantity), record.norm_unit(quantity)
    time, size = (finest_level.measured(record, name) for name in ("period", "amplitude"))
    names = [f"order of {words.symbol(quantity)}", "order, low", "order, high"]
    orders = zip(names, record.stated_orders(quantity), strict=True)
    listed: list[Field] = [
        (Column("case", form="integer"), np.asarray(record["case"])),
        *((Column(*record.swept_label(name), "step"), record[name]) for name in record.swept),
        *(
            (Column(name), record.flags(f"{quantity}_{name}"))
            for name in ("status", "reason")
            if f"{quantity}_{name}" in record
        ),
        *((Column(name, form="order"), values) for name, values in orders),
        (Column(f"true error, level {level}", error_unit, "norm"), error.true),
        (Column(f"estimated error, level {level}", error_unit, "norm"), error.estimate),
        (Column("period", time.unit, "full"), time.value),
        (Column("exact period", record.unit("exact_period"), "full"), record.exact_periods),
        (Column("relative error of the period", form="norm"), finest_level.period_error(record, -1)),
        (Column("amplitude", size.unit, "full"), size.value),
    ]  # fmt: skip
    shape = len(record.schemes), record.count
    return [(column, np.broadcast_to(values, shape)) for column, values in listed]


def table(record: Results) -> Table | None:
    """Return one row per scheme and member of a sweep; None without a sweep, or for too many rows."""
    schemes = record.schemes
    if not record.swept or record.count * len(schemes) > LISTED:
        return None
    shown = [
        (column, values)
        for column, values in fields(record)
        if values.dtype.kind != "f" or np.isfinite(values).any()
    ]
    rows = [
        (scheme, *row)
        for s, scheme in enumerate(schemes)
        for row in zip(*(values[s].tolist() for _, values in shown), strict=True)
    ]
    order = f"order of {words.symbol(record.model.position)} ({words.USUAL_NORM})"
    caption = f"Members: {order}, and numbers of the finest level"
    columns = (Column("scheme"), *(column for column, _ in shown))
    return Table("members", caption, columns, tuple(rows))


def write_csv(path: Path, record: Results) -> None:
    """Write one row per scheme and member, with empty cells for missing numbers.

    Swept values have all digits. Measured numbers have all digits in files of up to `LISTED` rows, and `DIGITS`
    significant digits in longer ones (``convergence.nc`` has all of them).
    """
    listed, schemes = fields(record), record.schemes
    keys = 1 + len(record.swept)
    is_short = record.count * len(schemes) <= LISTED
    head = [column.title for column, _ in listed]
    with (
        store.replacing(path) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        file.write(csv_line([*head[:keys], "scheme", *head[keys:]]))
        first = [_repeated(values[0]) for _, values in listed[:keys]]
        for s, scheme in enumerate(schemes):
            columns = [*first, *(values[s] for _, values in listed[keys:])]
            for text in _pieces(columns, keys, "%r" if is_short else f"%.{DIGITS}g"):
                file.write(text.replace(SCHEME, csv_line([scheme])[:-1]))


def digits(record: Results) -> str:
    """Say what the file of members holds; empty without a sweep."""
    if not record.swept:
        return ""
    count = record.count * len(record.schemes)
    listed = f"`tables/members.csv` lists all {words.number(count, 'integer')} members"
    if count <= LISTED:
        return f"{listed}."
    return f"{listed}: swept values with every digit, measured numbers with {DIGITS} significant digits."


SCHEME = "\0"  # placeholder for the name of a scheme, which may hold any text, until the rest is formatted


def _pieces(columns: Sequence[NDArray[Any]], keys: int, form: str) -> Iterator[str]:
    """Yield the rows of one scheme in pieces; the first `keys` columns have all digits."""
    exact = {"f": "%r", "i": "%d"}
    forms = [exact.get(column.dtype.kind, "%s") for column in columns[:keys]]
    forms += [form if column.dtype.kind == "f" else "%s" for column in columns[keys:]]
    template = ",".join([*forms[:keys], SCHEME, *forms[keys:]]) + "\n"
    for start in range(0, len(columns[0]), ROWS_AT_A_TIME):
        parts = [column[start : start + ROWS_AT_A_TIME].tolist() for column in columns]
        cells = tuple(chain.from_iterable(zip(*parts, strict=True)))
        # NaN becomes an empty cell; no status or reason begins with "nan"
        yield (template * len(parts[0]) % cells).replace(",nan", ",")


def _repeated(values: NDArray[Any]) -> NDArray[Any]:
    """Convert values that repeat often, as on a grid, to text, so that each is formatted only once."""
    distinct, inverse = np.unique(values, return_inverse=True)
    if distinct.size > values.size // 4:
        return values
    texts = np.array([str(value) for value in distinct.tolist()], dtype=object)
    return np.asarray(texts[inverse.ravel()])
