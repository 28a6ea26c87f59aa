"""Rules for printed tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from vibsim.experiment.faults import Report
from vibsim.experiment.rules import values
from vibsim.experiment.rules.check_places import Scope
from vibsim.experiment.rules.setting import Setting
from vibsim.experiment.schema.published import row_at, row_id


def check_published(
    tables: Sequence[Any], ids: Iterable[str], setting: Setting, report: Report
) -> None:
    """Report every fault of printed tables (None: a malformed table or row); `ids` holds the ids of the checks."""
    row_ids = {
        row_id(i, j)
        for i, table in enumerate(tables, 1)
        for j in range(1, 1 + len(table.rows if table else ()))
    }
    for i, id_ in enumerate(ids):
        if id_ in row_ids:
            report.add(("checks", i, "id"), "is the id of a row of published", value=id_)
    for i, table in enumerate(tables):
        if table is not None:
            _check_table(table, Scope(("published", i), setting, report))


def _check_table(table: Any, scope: Scope) -> None:
    rows = [(row, scope.at("rows", j)) for j, row in enumerate(table.rows) if row is not None]
    row = None if table.value is None else values.value_named(table.value, scope.at("value"))
    if row is not None and not scope.at("quantity").is_faulty:
        best = any(printed.level == "best" for printed, _ in rows)
        values.check_quantity_of(row, table.quantity, best, scope)
    for j, name in enumerate(table.beside):
        place = scope.at("beside", j)
        other = values.value_named(name, place)
        if name in table.beside[:j]:
            place.refuse("a value must not be repeated", value=name)
        if other is not None:
            # a value that needs a quantity has that of the table
            choices = values.quantities_of(other, scope.setting)
            if choices and table.quantity not in choices:
                rule = f"{name} is not defined for the quantity of this table"
                place.refuse(rule, "it is defined for " + ", ".join(choices), name)
            values.check_support(other, table.quantity, place)
    for printed, place in rows:
        if row is not None:
            place.check_place(row_at(printed), row)
        else:
            place.check_scheme_and_case(row_at(printed))
        if table.quantity is not None:
            values.check_velocities(table.quantity, [(printed.scheme, place.at("scheme"))])
