"""Tables from a summary: checks, their results, and runs that broke down."""

from __future__ import annotations

from collections.abc import Mapping
from operator import itemgetter
from typing import Any

from vibsim.report import words
from vibsim.report.data import Results
from vibsim.report.tables.table import Cell, Column, Filled, Table, Written, filled, keyed

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
        for result in check["results"]
    )
    return Table("checks", "Checks: expected and measured", columns, rows)


def results(record: Results, check: Mapping[str, Any], unit: str) -> Table:
    """Return the table of the results of one check; `unit` is that of its numbers."""
    listed, kind = check["results"], check["kind"]
    columns: list[Filled] = [keyed("scheme")]
    if record.swept:
        columns += [keyed("case", form="integer")]
        columns += [(Column("member"), lambda result: member(record, result["case"]) or "all")]
    columns += [(Column("measured"), itemgetter("status")), keyed("reason")]
    if kind == "converges" or any(words.fact(result, "order") is not None for result in listed):
        columns += [
            (Column("order", form="order"), lambda result: words.fact(result, "order")),
            (Column("interval"), lambda result: words.interval(words.interval_of(result))),
            (Column("levels"), lambda result: words.levels(words.levels_of(result))),
        ]
    if kind == "accurate":
        measure = record.norm_unit(check["quantity"], "l2")
        columns += [
            (Column("L2 error", measure, "small"), lambda result: words.fact(result, "error")),
            (
                Column("relative error", form="small"),
                lambda result: words.fact(result, "relative_error"),
            ),
        ]
    elif any(words.number_of(result) is not None for result in listed):
        # a difference needs few digits, a number of a value check may need many
        form = "small" if kind == "equal" else "value"
        columns += [(Column("value", unit, form), _value)]
    return filled(f"results_{check['id']}", "Measured", columns, listed)


def _value(result: Mapping[str, Any]) -> Cell:
    value = words.number_of(result)
    is_noise = value is not None and 0.0 < abs(value) <= ROUND_OFF
    return Written(value, words.number(value, "brief")) if is_noise and value else value


def member(record: Results, case: int) -> str:
    """Name a member by its global index; empty if the record lacks it."""
    place = record.case_position(case)
    return "" if place is None else record.case_name(place)


def failures(summary: Mapping[str, Any], record: Results) -> Table | None:
    """Return the runs that broke down; None if there are none."""
    if not summary["failures"]:
        return None
    columns: list[Filled] = [
        keyed("scheme"), keyed("level", form="integer"), keyed("case", form="integer"),
        (Column("member"), lambda row: member(record, row["case"])),
        keyed("t", record.time_unit, "step"), keyed("step", form="integer"), keyed("error"),
    ]  # fmt: skip
    caption = "Runs that broke down: the first moment at which the solution was not finite"
    return filled("failures", caption, columns, summary["failures"])
