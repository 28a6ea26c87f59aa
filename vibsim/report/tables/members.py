"""The members of a sweep, one row each, in a table for reading and in a file for computing.

A file of a million rows takes some seconds: it is written in pieces, each of them by one formatting operation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim import store
from vibsim.core.record import Record
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.report import finest_level
from vibsim.report.data import exact_periods, flags, norm_unit, swept, swept_label, unit, whole
from vibsim.report.tables.table import Column, Table, csv_line
from vibsim.report.text import words

LISTED = 10_000
"""Rows up to which a table lists members, and a file has every digit of what was measured."""
DIGITS = 9
"""Significant digits of what was measured, in a file with more rows."""
PIECE = 10_000
"""Rows that are formatted at once."""


@dataclass(frozen=True)
class Field:
    """One column of all members."""

    column: Column
    values: NDArray[Any]
    """Shape (case,), or (scheme, case)."""

    def of(self, scheme: int) -> NDArray[Any]:
        """Return the values of one scheme, shape (case,)."""
        return self.values if self.values.ndim == 1 else self.values[scheme]


def fields(record: Record, quantity: str) -> list[Field]:
    """Return what is listed of every member: first what it is, then what was measured of it."""
    letter = words.symbol(quantity)
    error, measure = finest_level.error(record, quantity), norm_unit(record, quantity, TYPICAL_NORM)
    time, size = (finest_level.measured(record, name, quantity) for name in ("period", "amplitude"))
    level = whole(record, "level")[-1]
    names = [f"order of {letter}", "order, low", "order, high"]
    orders = zip(names, finest_level.orders(record, quantity), strict=True)
    return [
        Field(Column("case", form="integer"), np.asarray(record["case"])),
        *(Field(Column(*swept_label(record, name), "step"), record[name]) for name in swept(record)),
        *(Field(Column(name), flags(record, f"{quantity}_{name}")) for name in ("status", "reason")),
        *(Field(Column(name, form="order"), values) for name, values in orders),
        Field(Column(f"true error, level {level}", measure, "norm"), error.true),
        Field(Column(f"estimated error, level {level}", measure, "norm"), error.estimate),
        Field(Column("period", time.unit, "full"), time.value),
        Field(Column("exact period", unit(record, "exact_period"), "full"), exact_periods(record)),
        Field(Column("relative error of the period", form="norm"), finest_level.period_error(record, -1)),
        Field(Column("amplitude", size.unit, "full"), size.value),
    ]  # fmt: skip


def table(record: Record, quantity: str) -> Table | None:
    """Return one row per scheme and member of a sweep; None without one, or for too many rows."""
    schemes = record.words("scheme")
    if not swept(record) or len(record["case"]) * len(schemes) > LISTED:
        return None
    found = [f for f in fields(record, quantity) if _has_any(f.values)]
    rows = [
        (scheme, *row)
        for s, scheme in enumerate(schemes)
        for row in zip(*(field.of(s).tolist() for field in found), strict=True)
    ]
    caption = f"Members: order of {words.symbol(quantity)} ({TYPICAL_NORM}), and numbers of the finest level"
    columns = (Column("scheme"), *(field.column for field in found))
    return Table("members", caption, columns, tuple(rows))


def _has_any(values: NDArray[Any]) -> bool:
    return values.dtype.kind != "f" or bool(np.isfinite(values).any())


def write_csv(path: Path, record: Record, quantity: str) -> None:
    """Write one row per scheme and member, of any number: empty where a number does not exist.

    Swept values have every digit. So has what was measured, in files of up to `LISTED` rows; in longer ones it has
    `DIGITS` significant digits (``convergence.nc`` has all of them).
    """
    found, schemes = fields(record, quantity), record.words("scheme")
    count = len(record["case"])
    own = 1 + len(swept(record))
    form = "%r" if count * len(schemes) <= LISTED else f"%.{DIGITS}g"
    head = (
        [field.column.title for field in found[:own]],
        [field.column.title for field in found[own:]],
    )
    with (
        store.replacing(path) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        file.write(csv_line([*head[0], "scheme", *head[1]]))
        first = [_repeated(field.values) for field in found[:own]]
        for s, scheme in enumerate(schemes):
            columns = [*first, *(field.of(s) for field in found[own:])]
            for text in _pieces(columns, own, form):
                file.write(text.replace(SCHEME, csv_line([scheme])[:-1]))


def digits(record: Record) -> str:
    """Say what a file of members holds; empty without a sweep."""
    if not swept(record):
        return ""
    count = len(record["case"]) * len(record["scheme"])
    measured = "every digit" if count <= LISTED else f"{DIGITS} significant digits"
    return (
        f"`tables/members.csv` lists all {words.number(count, 'integer')} members: swept values with every digit, "
        f"measured numbers with {measured}."
    )


SCHEME = "\0"
"""Stands for the name of a scheme, which may hold anything, until all else is written."""


def _pieces(columns: Sequence[NDArray[Any]], own: int, form: str) -> Iterator[str]:
    """Yield the rows of one scheme in pieces."""
    exact = {"f": "%r", "i": "%d"}
    forms = [exact.get(column.dtype.kind, "%s") for column in columns[:own]]
    forms += [form if column.dtype.kind == "f" else "%s" for column in columns[own:]]
    template = ",".join([*forms[:own], SCHEME, *forms[own:]]) + "\n"
    for start in range(0, len(columns[0]), PIECE):
        parts = [column[start : start + PIECE].tolist() for column in columns]
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
