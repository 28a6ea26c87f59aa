"""The table of impacts, turns of friction and rest, level by level."""

from __future__ import annotations

import numpy as np

from vibsim.core.record import Record
from vibsim.report.data import Floats, Member, known, time_unit
from vibsim.report.tables.by_level import by_level, cells, step_column
from vibsim.report.tables.table import Cell, Column, Table
from vibsim.report.tables.theory import OF_LEVEL, everyone

COUNT, FIRST, LAST, REST = "event_count", "first_event_time", "last_event_time", "rest_time"


def table(record: Record) -> Table | None:
    """Return number and times of events for every scheme, member and level; None where there are none."""
    if COUNT not in record or not (known(record, COUNT, OF_LEVEL) > 0.0).any():
        return None
    caption = (
        "Events (impacts; turns and starts of a body under friction): where they are located, their times move with "
        "the level as the error of the scheme does, else by part of a step"
    )
    count, first, last, rest = (
        known(record, name, OF_LEVEL) for name in (COUNT, FIRST, LAST, REST)
    )
    seconds = time_unit(record, FIRST)

    def change(member: Member, i: int) -> Cell:
        return _change(count[member.scheme, member.case], last[member.scheme, member.case], i)

    filled = (
        step_column(record),
        (Column("events", form="integer"), cells(count, int)),
        (Column("first", seconds, "value"), cells(first)),
        (Column("last", seconds, "value"), cells(last)),
        (Column("at rest from", seconds, "value"), cells(rest))
        if np.isfinite(rest).any()
        else None,
        (Column("last, less that of the next finer level", seconds, "small"), change),
    )
    return by_level(record, "events", caption, everyone(record), filled)


def _change(count: Floats, last: Floats, i: int) -> Cell:
    """Return by how much the last event is later than on the next finer level; None where it is another event."""
    if i + 1 == len(last) or count[i] != count[i + 1] or not np.isfinite(last[i] - last[i + 1]):
        return None
    return float(last[i] - last[i + 1])
