"""What printed tables must be besides well-formed: what they name exists, and their rows are claims."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from vibsim.spec.check_places import Ladder, check_anywhere, check_place, is_faulty
from vibsim.spec.faults import Report
from vibsim.spec.published import PublishedTable, row_at, row_id
from vibsim.spec.quantity_rules import allowed, has_quantity
from vibsim.spec.source import Path_
from vibsim.spec.value_rules import known_value, needs, value_of
from vibsim.spec.values import Value


def finish_published(
    tables: Iterable[Any], taken: Iterable[str], ladder: Ladder, report: Report
) -> tuple[PublishedTable, ...]:
    """Note every fault of printed tables (None stands for a malformed one, or row); return them.

    Parameters
    ----------
    taken
        The ids of the checks, in their order in the file.
    """
    listed = list(tables)
    own = {
        row_id(i, j)
        for i, table in enumerate(listed, 1)
        for j in range(1, 1 + len(table.rows if table else ()))
    }
    for i, id_ in enumerate(taken):
        if id_ in own:
            report.add(("checks", i, "id"), "is the id of a row of published", value=id_)
    for i, table in enumerate(listed):
        if table is not None:
            _table(table, ("published", i), ladder, report)
    if report.faults:
        return ()
    return tuple(PublishedTable.model_validate(table.model_dump()) for table in listed)


def _table(table: Any, path: Path_, ladder: Ladder, report: Report) -> None:
    rows = [(row, (*path, "rows", j)) for j, row in enumerate(table.rows) if row is not None]
    row = None if table.value is None else known_value(table.value, (*path, "value"), report)
    if row is not None and not is_faulty((*path, "quantity"), report):
        best = any(printed.level == "best" for printed, _ in rows)
        value_of(row, table.quantity, best, path, ladder, report)
    for j, name in enumerate(table.beside):
        _beside(name, table, (*path, "beside", j), ladder, report)
    for printed, place in rows:
        if row is not None:
            check_place(row_at(printed), row, place, ladder, report)
        else:
            check_anywhere(row_at(printed), place, ladder, report)
        if table.quantity is not None:
            has_quantity(table.quantity, [(printed.scheme, (*place, "scheme"))], ladder, report)


def _beside(name: str, table: Any, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check a further value, which is of the quantity of the table where it is of one."""
    row = known_value(name, path, report)
    if name in table.beside[: path[-1]]:
        report.add(path, "a value must not be repeated", value=name)
    if row is None:
        return
    _fits(row, table, path, ladder, report)
    needs(row, table.quantity, path, ladder, report)


def _fits(row: Value, table: Any, path: Path_, ladder: Ladder, report: Report) -> None:
    choices = allowed(row, ladder)
    if choices and table.quantity not in choices:
        rule = f"{row.name} is not known of the quantity of this table"
        report.add(path, rule, "it is of " + ", ".join(choices), row.name)
