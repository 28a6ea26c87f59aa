"""Numbers that a source printed beside ours: the source's own digits, ours in the same manner, and their difference."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from vibsim.checks.fields import measured
from vibsim.core.record import Record
from vibsim.experiment.value_names import VALUES
from vibsim.report import data
from vibsim.report.tables.table import Cell, Column, Table, Written
from vibsim.report.text import words

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.published import PublishedRow, PublishedTable


def ids(experiment: Experiment) -> frozenset[str]:
    """Name the checks that printed numbers made: a page has tables of these in place of cards."""
    from vibsim.experiment.schema.published import row_id

    return frozenset(
        row_id(i, j)
        for i, table in enumerate(experiment.published, 1)
        for j, _ in enumerate(table.rows, 1)
    )


def tables(experiment: Experiment, record: Record, summary: Mapping[str, Any]) -> list[Table]:
    """Return one table for every table of printed numbers."""
    checks = {check["id"]: check for check in summary["checks"]}
    return [
        _table(experiment, record, i, table, checks)
        for i, table in enumerate(experiment.published, 1)
    ]


def sentence(found: list[Table]) -> str:
    """Say how many printed numbers ours agree with; empty where there is none."""
    marks = [row[_place(table, AGREES)] for table in found for row in table.rows]
    if not marks:
        return ""
    agreed = sum(str(mark).startswith("yes") for mark in marks)
    return f"{agreed} of {len(marks)} printed numbers agree with ours to the last printed digit."


AGREES = "agrees?"


def _place(table: Table, header: str) -> int:
    return [column.header for column in table.columns].index(header)


def _table(
    experiment: Experiment, record: Record, i: int, table: PublishedTable, checks: Mapping[str, Any]
) -> Table:
    at = [
        key
        for key in ("t", "step", "case")
        if any(getattr(row.at, key) is not None for row in table.rows)
    ]
    noted = any(row.note for row in table.rows)
    columns = [
        Column("scheme"),
        Column("level"),
        Column("dt", data.time_unit(record, "dt"), "step"),
    ]
    columns += [Column(key, form="step") for key in at]
    columns += [
        Column("printed", form="printed"),
        Column("ours", form="close"),
        Column("difference", form="brief"),
        Column(AGREES),
        *(Column(_beside_header(name, table), form="norm") for name in table.beside),
        *([Column("why")] if noted else []),
    ]
    rows = tuple(
        tuple(_row(experiment, record, (i, j), table, row, at, noted, checks))
        for j, row in enumerate(table.rows, 1)
    )
    of = f" of {words.symbol(table.quantity)}" if table.quantity else ""
    source = f" ({table.source or experiment.source})" if table.source or experiment.source else ""
    caption = (
        f"{table.title}{source}. Ours: {_told(table.value)}{of}; it agrees where it differs by half a unit of the "
        "last printed digit at most"
    )
    return Table(f"published_{i}", caption, tuple(columns), rows)


def _beside_header(name: str, table: PublishedTable) -> str:
    """Return the header of a further value: what it has by the scheme's own velocity, it says so."""
    if f"{name}{words.CENTRED}" == table.value:
        return OWN
    own = f" {OWN}" if f"{name}{words.CENTRED}" in VALUES else ""
    return f"beside: {_told(name)}{own}"


OWN = "by own velocity"


def _told(value: str) -> str:
    return value.replace("_d2t", " by [D₂ₜu]").replace("_", " ")


def _row(
    experiment: Experiment,
    record: Record,
    place: tuple[int, int],
    table: PublishedTable,
    row: PublishedRow,
    at: list[str],
    noted: bool,
    checks: Mapping[str, Any],
) -> Iterator[Cell]:
    from vibsim.experiment.schema.published import row_id

    name = row_id(*place)
    check = checks.get(name, {})
    ours = _ours(record, name, row)
    yield row.scheme
    yield str(record["level"][-1]) if row.level is None else str(row.level)
    yield _dt(record, row)
    yield from (getattr(row.at, key) for key in at)
    yield row.printed
    yield Written(ours, words.like(ours, row.printed))
    yield ours - row.meaning.number
    yield _agrees(check, row)
    yield from _beside(record, name, row, len(table.beside))
    if noted:
        yield row.note or ""


def _agrees(check: Mapping[str, Any], row: PublishedRow) -> str:
    """Say whether the measured number agrees with the printed one, and whether that was expected."""
    if check.get("status") not in {"PASS", "FAIL"}:
        return "not known"
    agrees = (check["status"] == "PASS") == row.holds
    expected = "" if check["status"] == "PASS" else " (not as expected)"
    return ("yes" if agrees else "no") + expected


def _member(record: Record, row: PublishedRow) -> tuple[int, int]:
    """Return the positions of a row's scheme and member; without a member it is the first."""
    case = 0 if row.at.case is None else data.place_of(record, row.at.case)
    return record.words("scheme").index(row.scheme), 0 if case is None else case


def _ours(record: Record, name: str, row: PublishedRow) -> float:
    return float(measured(record, name, "value")[_member(record, row)])


def _dt(record: Record, row: PublishedRow) -> float:
    """Return the step of a row's level; NaN for the extrapolated solution, which has none."""
    levels, (_, case) = data.whole(record, "level"), _member(record, row)
    level = levels[-1] if row.level is None else row.level
    return float(data.steps_of(record, case)[levels.index(level)]) if level in levels else math.nan


def _beside(record: Record, name: str, row: PublishedRow, count: int) -> Iterator[float]:
    """Yield the values that a row has beside it, without a claim."""
    if not count:
        return
    place = record.words("check").index(name)
    found = data.pick(record, "published_beside", check=place, case=_member(record, row)[1])
    yield from (float(value) for value in found[:count])
