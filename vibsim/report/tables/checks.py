"""Tables from a summary: checks, their results, and runs that broke down."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from vibsim.core.record import Record
from vibsim.report import data, words
from vibsim.report.tables.table import Cell, Column, Table, Written

ROUND_OFF = 1e-12  # numbers up to this have two digits: more would be noise


def checks(summary: Mapping[str, Any]) -> Table:
    """Return every check with every result that the summary lists."""
    columns = (
        Column("check"), Column("kind"), Column("quantity"), Column("status"), Column("reason"), Column("expected"),
        Column("scheme"), Column("case", form="integer"), Column("measured status"), Column("measured reason"),
        Column("order", form="order"), Column("order, low", form="order"), Column("order, high", form="order"),
        Column("levels"), Column("value", form="full"), Column("error", form="full"),
        Column("error, at most", form="full"), Column("relative error", form="full"),
    )  # fmt: skip
    of_check = ("id", "kind", "quantity", "status", "reason", "expected")
    of_result = ("scheme", "case", "status", "reason")
    rows = tuple(
        (*map(check.get, of_check), *map(result.get, of_result), *words.measured(result))
        for check in summary["checks"]
        for result in check.get("results") or [{}]
    )
    return Table("checks", "Checks: expected and measured", columns, rows)


def results(record: Record, check: Mapping[str, Any], unit: str) -> Table | None:
    """Return the table of the results of one check; `unit` is that of its numbers."""
    listed: Sequence[Mapping[str, Any]] = check.get("results") or []
    if not listed:
        return None
    has_order = check.get("kind") == "converges" or any(
        words.fact(result, "order") is not None for result in listed
    )
    has_value = any(words.number_of(result) is not None for result in listed)
    columns = [Column("scheme")]
    columns += [Column("case", form="integer"), Column("member")] if data.swept(record) else []
    columns += [Column("measured"), Column("reason")]
    columns += (
        [Column("order", form="order"), Column("interval"), Column("levels")] if has_order else []
    )
    # differences and errors need few digits, a number of a value check may need many
    form = "small" if check.get("kind") in ("equal", "accurate") else "value"
    columns += [Column("value", unit, form)] if has_value else []

    def cells(result: Mapping[str, Any]) -> Iterator[Cell]:
        yield result.get("scheme")
        if data.swept(record):
            yield result.get("case")
            yield member(record, result.get("case", -1)) or "all"
        yield from (result.get("status"), result.get("reason"))
        if has_order:
            yield words.fact(result, "order")
            yield words.interval(words.interval_of(result))
            yield words.levels(words.levels_of(result))
        if has_value:
            value = words.number_of(result)
            is_noise = value is not None and 0.0 < abs(value) <= ROUND_OFF
            yield Written(value, words.number(value, "brief")) if is_noise and value else value

    rows = tuple(tuple(cells(result)) for result in listed)
    return Table(f"results_{check['id']}", "Measured", tuple(columns), rows)


def member(record: Record, case: int) -> str:
    """Name a member by its global index; empty if the record lacks it."""
    place = data.case_position(record, case)
    return "" if place is None else data.case_name(record, place)


def failures(summary: Mapping[str, Any], record: Record) -> Table | None:
    """Return the runs that broke down; None if there are none."""
    listed: Iterable[Mapping[str, Any]] = summary.get("failures") or []
    if not listed:
        return None
    columns = (
        Column("scheme"), Column("level", form="integer"), Column("case", form="integer"), Column("member"),
        Column("t", data.time_unit(record), "step"), Column("step", form="integer"), Column("error"),
    )  # fmt: skip
    keys = ("scheme", "level", "case", "member", "t", "step", "error")
    with_names = [{**row, "member": member(record, row["case"])} for row in listed]
    rows = tuple(tuple(row[key] for key in keys) for row in with_names)
    caption = "Runs that broke down: the first moment at which the solution was not finite"
    return Table("failures", caption, columns, rows)
