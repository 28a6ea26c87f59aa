"""What printed tables must be besides well-formed: what they name exists, and their rows are claims."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from vibsim.experiment.faults import Report
from vibsim.experiment.rules.check_places import (
    Ladder,
    Scope,
    check_place,
    check_scheme_and_case,
)
from vibsim.experiment.rules.quantities import (
    allowed,
    check_value,
    has_quantity,
    is_comparable,
    known_value,
)
from vibsim.experiment.schema.published import row_at, row_id


def check_published(
    tables: Iterable[Any], taken: Iterable[str], ladder: Ladder, report: Report
) -> None:
    """Note every fault of printed tables (None stands for a malformed one, or row).

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
            _table(table, Scope(("published", i), ladder, report))


def _table(table: Any, scope: Scope) -> None:
    rows = [(row, scope.at("rows", j)) for j, row in enumerate(table.rows) if row is not None]
    row = None if table.value is None else known_value(table.value, scope.at("value"))
    if row is not None and not scope.at("quantity").is_faulty:
        best = any(printed.level == "best" for printed, _ in rows)
        check_value(row, table.quantity, best, scope)
    for j, name in enumerate(table.beside):
        _beside(name, table, table.beside[:j], scope.at("beside", j))
    for printed, place in rows:
        if row is not None:
            check_place(row_at(printed), row, place)
        else:
            check_scheme_and_case(row_at(printed), place)
        if table.quantity is not None:
            has_quantity(table.quantity, [(printed.scheme, place.at("scheme"))])


def _beside(name: str, table: Any, before: tuple[str, ...], scope: Scope) -> None:
    """Check a further value, which is of the quantity of the table where it is of one."""
    row = known_value(name, scope)
    if name in before:
        scope.refuse("a value must not be repeated", value=name)
    if row is None:
        return
    choices = allowed(row, scope.ladder)
    if choices and table.quantity not in choices:
        rule = f"{row.name} is not known of the quantity of this table"
        scope.refuse(rule, "it is of " + ", ".join(choices), row.name)
    is_comparable(row, table.quantity, scope)
