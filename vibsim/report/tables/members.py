"""The members of a sweep, one row each, in a table for reading and in a file for computing.

A file of a million rows takes some seconds: it is written in pieces, each of them by one formatting operation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim import store
from vibsim.core.record import Record
from vibsim.report import finest_level, words
from vibsim.report.data import exact_periods, flags, norm_unit, swept, swept_label, unit, whole
from vibsim.report.tables.table import Column, Table, csv_line

LISTED = 10_000
"""Rows up to which a table lists members, and a file has every digit of what was measured."""
DIGITS = 9  # significant digits of what was measured, in a file with more rows
ROWS_AT_A_TIME = 10_000  # rows that are formatted at once


Field = tuple[Column, NDArray[Any]]
"""One column, and its values of the shape (scheme, case)."""


def fields(record: Record, quantity: str) -> list[Field]:
    """Return what is listed of every member: first what it is, then what was measured of it."""
    error, measure = finest_level.error(record, quantity), norm_unit(record, quantity)
    time, size = (finest_level.measured(record, name, quantity) for name in ("period", "amplitude"))
    level = whole(record, "level")[-1]
    names = [f"order of {words.symbol(quantity)}", "order, low", "order, high"]
    orders = zip(names, finest_level.orders(record, quantity), strict=True)
    found: list[Field] = [
        (Column("case", form="integer"), np.asarray(record["case"])),
        *((Column(*swept_label(record, name), "step"), record[name]) for name in swept(record)),
        *(
            (Column(name), flags(record, f"{quantity}_{name}"))
            for name in ("status", "reason")
            if f"{quantity}_{name}" in record
        ),
        *((Column(name, form="order"), values) for name, values in orders),
        (Column(f"true error, level {level}", measure, "norm"), error.true),
        (Column(f"estimated error, level {level}", measure, "norm"), error.estimate),
        (Column("period", time.unit, "full"), time.value),
        (Column("exact period", unit(record, "exact_period"), "full"), exact_periods(record)),
        (Column("relative error of the period", form="norm"), finest_level.period_error(record, -1)),
        (Column("amplitude", size.unit, "full"), size.value),
    ]  # fmt: skip
    shape = len(record["scheme"]), len(record["case"])
    return [(column, np.broadcast_to(values, shape)) for column, values in found]


def table(record: Record, quantity: str) -> Table | None:
    """Return one row per scheme and member of a sweep; None without one, or for too many rows."""
    schemes = record.words("scheme")
    if not swept(record) or len(record["case"]) * len(schemes) > LISTED:
        return None
    found = [
        (column, values)
        for column, values in fields(record, quantity)
        if values.dtype.kind != "f" or np.isfinite(values).any()
    ]
    rows = [
        (scheme, *row)
        for s, scheme in enumerate(schemes)
        for row in zip(*(values[s].tolist() for _, values in found), strict=True)
    ]
    caption = f"Members: order of {words.symbol(quantity)} ({words.USUAL_NORM}), and numbers of the finest level"
    columns = (Column("scheme"), *(column for column, _ in found))
    return Table("members", caption, columns, tuple(rows))


def write_csv(path: Path, record: Record, quantity: str) -> None:
    """Write one row per scheme and member, of any number: empty where a number does not exist.

    Swept values have every digit. So has what was measured, in files of up to `LISTED` rows; in longer ones it has
    `DIGITS` significant digits (``convergence.nc`` has all of them).
    """
    found, schemes = fields(record, quantity), record.words("scheme")
    own = 1 + len(swept(record))
    is_short = len(record["case"]) * len(schemes) <= LISTED
    head = [column.title for column, _ in found]
    with (
        store.replacing(path) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        file.write(csv_line([*head[:own], "scheme", *head[own:]]))
        first = [_repeated(values[0]) for _, values in found[:own]]
        for s, scheme in enumerate(schemes):
            columns = [*first, *(values[s] for _, values in found[own:])]
            for text in _pieces(columns, own, "%r" if is_short else f"%.{DIGITS}g"):
                file.write(text.replace(SCHEME, csv_line([scheme])[:-1]))


def digits(record: Record) -> str:
    """Say what a file of members holds; empty without a sweep."""
    if not swept(record):
        return ""
    count = len(record["case"]) * len(record["scheme"])
    listed = f"`tables/members.csv` lists all {words.number(count, 'integer')} members"
    if count <= LISTED:
        return f"{listed}."
    return f"{listed}: swept values with every digit, measured numbers with {DIGITS} significant digits."


SCHEME = "\0"  # stands for the name of a scheme, which may hold anything, until all else is written


def _pieces(columns: Sequence[NDArray[Any]], own: int, form: str) -> Iterator[str]:
    """Yield the rows of one scheme in pieces."""
    exact = {"f": "%r", "i": "%d"}
    forms = [exact.get(column.dtype.kind, "%s") for column in columns[:own]]
    forms += [form if column.dtype.kind == "f" else "%s" for column in columns[own:]]
    template = ",".join([*forms[:own], SCHEME, *forms[own:]]) + "\n"
    for start in range(0, len(columns[0]), ROWS_AT_A_TIME):
        parts = [column[start : start + ROWS_AT_A_TIME].tolist() for column in columns]
        cells = tuple(chain.from_iterable(zip(*parts, strict=True)))
        # a number that does not exist is an empty cell; no word of a status or reason begins so
        yield (template * len(parts[0]) % cells).replace(",nan", ",")


def _repeated(values: NDArray[Any]) -> NDArray[Any]:
    """Return values that come again and again, as on a grid, as text: it is written only once."""
    distinct, place = np.unique(values, return_inverse=True)
    if distinct.size > values.size // 4:
        return values
    texts = np.array([str(value) for value in distinct.tolist()], dtype=object)
    return np.asarray(texts[place.ravel()])
