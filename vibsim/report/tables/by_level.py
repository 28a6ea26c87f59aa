"""Tables with a row for every scheme, member and level: each column stands beside what fills it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from vibsim.core.record import Record
from vibsim.report.data import Floats, Member, steps_of, swept, time_unit, whole
from vibsim.report.tables.table import Cell, Column, Table

Fill = Callable[[Member, int], Cell]
"""Returns the cell of a member and the position of a level."""


def cells(values: Floats, kind: type[int] | type[float] = float) -> Fill:
    """Return what fills a column with numbers of shape (scheme, case, level)."""
    return lambda member, i: kind(values[member.scheme, member.case, i])


def step_column(record: Record) -> tuple[Column, Fill]:
    """Return the column of the time steps."""
    column = Column("dt", time_unit(record, "dt"), "step")
    return column, lambda member, i: float(steps_of(record, member.case)[i])


def by_level(
    record: Record,
    name: str,
    caption: str,
    members: Sequence[Member],
    filled: Sequence[tuple[Column, Fill] | None],
    *,
    titled: bool = False,
    counts: Fill = lambda member, i: 1,
) -> Table:
    """Return a table with a row for every member and level.

    Parameters
    ----------
    filled
        Columns after scheme, member and level, each with what fills it; None for one that is left out.
    titled
        Whether scheme and member share a column.
    counts
        Tells whether a row is shown.
    """
    several = bool(swept(record))
    names = ["scheme", "member"] if several and not titled else ["scheme"]
    shown = [column for column in filled if column is not None]
    columns = (*map(Column, names), Column("level", form="integer"), *(c for c, _ in shown))
    rows = tuple(
        (*_who(member, titled)[: len(names)], level, *(fill(member, i) for _, fill in shown))
        for member in members
        for i, level in enumerate(whole(record, "level"))
        if counts(member, i)
    )
    return Table(name, caption, columns, rows, heads=len(names) * several)


def _who(member: Member, titled: bool) -> list[Cell]:
    return [member.title] if titled else [member.scheme_name, member.case_name]
