"""Printed numbers of a source beside ours: its digits, ours in the same notation, and their difference."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from vibsim.checks.fields import field_values
from vibsim.core.vocabulary import CENTRED
from vibsim.experiment.sweep_columns import members_with, recorded_columns
from vibsim.experiment.value_names import VALUES
from vibsim.report import words
from vibsim.report.data import Results
from vibsim.report.tables.table import Cell, Column, Table, Written
from vibsim.report.types import Experiment, PublishedRow, PublishedTable

AGREES = "agrees?"
OWN = "by own velocity"
PLACES = ("t", "step", "event", "case")  # keys that locate a number, besides swept values


def ids(experiment: Experiment) -> frozenset[str]:
    """Return the ids of the checks of printed numbers, for which a page has tables in place of cards."""
    from vibsim.experiment.schema.published import row_id

    numbered = enumerate(experiment.published, 1)
    return frozenset(row_id(i, j) for i, table in numbered for j in range(1, len(table.rows) + 1))


def sentence(compared: list[Table]) -> str:
    """Say how many printed numbers agree with ours; empty if there are none."""
    marks = []
    for table in compared:
        i = [column.header for column in table.columns].index(AGREES)
        marks += [str(row[i]) for row in table.rows]
    agreed = sum(mark.startswith("yes") for mark in marks)
    text = f"{agreed} of {len(marks)} printed numbers agree with ours to the last printed digit."
    return text if marks else ""


def tables(record: Results, summary: Mapping[str, Any]) -> list[Table]:
    """Return one table for each table of printed numbers."""
    from vibsim.experiment.schema.published import row_id

    checks = {check["id"]: check for check in summary["checks"]}
    compared = []
    for i, table in enumerate(record.experiment.published, 1):
        columns = _columns(record, table)
        rows = tuple(
            tuple(_row(record, row_id(i, j), table, row, columns, checks))
            for j, row in enumerate(table.rows, 1)
        )
        of = f" of {words.symbol(table.quantity)}" if table.quantity else ""
        origin = table.source or record.experiment.source
        caption = (
            f"{table.title}{f' ({origin})' if origin else ''}. Ours: {words.spelled(table.value)}{of}; it agrees if it "
            "differs by at most half a unit of the last printed digit"
        )
        compared.append(Table(f"published_{i}", caption, columns, rows))
    return compared


def _columns(record: Results, table: PublishedTable) -> tuple[Column, ...]:
    rows = table.rows
    at = [key for key in PLACES if any(getattr(row.at, key) is not None for row in rows)]
    at += dict.fromkeys(key for row in rows for key in row.at.swept)
    return (
        Column("scheme"), Column("level"), Column("dt", record.time_unit, "step"),
        *(Column(key, form="step") for key in at),
        Column("printed", form="printed"), Column("ours", form="close"), Column("difference", form="brief"),
        Column(AGREES), *(Column(_beside_header(name, table), form="norm") for name in table.beside),
        *([Column("why")] if any(row.note for row in rows) else []),
    )  # fmt: skip


def _beside_header(name: str, table: PublishedTable) -> str:
    """Return the header of an additional value, which names the scheme's own velocity if there are two."""
    if f"{name}{CENTRED}" == table.value:
        return OWN
    velocity = f" {OWN}" if f"{name}{CENTRED}" in VALUES else ""
    return f"beside: {words.spelled(name)}{velocity}"


def _row(
    record: Results,
    name: str,
    table: PublishedTable,
    row: PublishedRow,
    columns: tuple[Column, ...],
    checks: Mapping[str, Any],
) -> Iterator[Cell]:
    headers = [column.header for column in columns]
    # by default the first member
    case = 0 if row.at.case is None else record.case_position(row.at.case) or 0
    if row.at.swept:
        case = int(np.argmax(members_with(recorded_columns(record), row.at.swept, record.count)))
    scheme = record.schemes.index(row.scheme)
    ours = float(field_values(record, name, "value")[scheme, case])
    levels: list[int | str] = [*record.levels]
    level = levels[-1] if row.level is None else row.level
    steps = dict(zip(levels, record.dt(case).tolist(), strict=True))
    yield row.scheme
    yield str(level)
    yield steps.get(level, math.nan)  # the extrapolated solution has no step
    yield from (getattr(row.at, key) for key in PLACES if key in headers)
    yield from (row.at.swept.get(header) for header in headers if "." in header)
    yield row.printed
    yield Written(ours, words.in_style_of(ours, row.printed))
    yield ours - row.meaning.number
    yield _agrees(checks.get(name, {}).get("status"), row)
    if table.beside:
        check = record.words("check").index(name)
        values = record.pick("published_beside", check=check, case=case)
        yield from (float(value) for value in values[: len(table.beside)])
    if "why" in headers:
        yield row.note or ""


def _agrees(status: str | None, row: PublishedRow) -> str:
    """Say whether our number agrees with the printed one, and whether that was expected."""
    if status not in {"PASS", "FAIL"}:
        return "not known"
    expected = "" if status == "PASS" else " (not as expected)"
    return ("yes" if (status == "PASS") == row.holds else "no") + expected
