"""The table of impacts, turns of friction and rest, level by level."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vibsim.core.record import Record
from vibsim.report.data import Floats, known, steps_of, swept, time_unit, whole
from vibsim.report.tables.table import Cell, Column, Table
from vibsim.report.tables.theory import OF_LEVEL, everyone

COUNT, FIRST, LAST, REST = "event_count", "first_event_time", "last_event_time", "rest_time"


def table(record: Record) -> Table | None:
    """Return number and times of events for every scheme, member and level; None where there are none."""
    if COUNT not in record or not (known(record, COUNT, OF_LEVEL) > 0.0).any():
        return None
    rests = bool(np.isfinite(known(record, REST, OF_LEVEL)).any())
    seconds = time_unit(record, FIRST)
    columns = (
        Column("scheme"), *([Column("member")] if swept(record) else []), Column("level", form="integer"),
        Column("dt", time_unit(record, "dt"), "step"), Column("events", form="integer"),
        Column("first", seconds, "value"), Column("last", seconds, "value"),
        *([Column("at rest from", seconds, "value")] if rests else []),
        Column("last, less that of the next finer level", seconds, "small"),
    )  # fmt: skip
    caption = (
        "Events (impacts; turns and starts of a body under friction): where they are located, their times move with "
        "the level as the error of the scheme does, else by part of a step"
    )
    return Table("events", caption, columns, tuple(_rows(record, rests)), 2 * bool(swept(record)))


def _rows(record: Record, rests: bool) -> Iterator[tuple[Cell, ...]]:
    count, first, last, rest = (
        known(record, name, OF_LEVEL) for name in (COUNT, FIRST, LAST, REST)
    )
    levels = whole(record, "level")
    for member in everyone(record):
        dt = steps_of(record, member.case)
        who = [member.scheme_name, *([member.case_name] if swept(record) else [])]
        for i, level in enumerate(levels):
            at = member.scheme, member.case, i
            times = [first[at], last[at], *([rest[at]] if rests else [])]
            cells = (float(time) if np.isfinite(time) else None for time in times)
            yield (
                *who,
                level,
                float(dt[i]),
                int(count[at]),
                *cells,
                _change(count[at[:2]], last[at[:2]], i),
            )


def _change(count: Floats, last: Floats, i: int) -> Cell:
    """Return by how much the last event is later than on the next finer level; None where it is another event."""
    if i + 1 == len(last) or count[i] != count[i + 1] or not np.isfinite(last[i] - last[i + 1]):
        return None
    return float(last[i] - last[i + 1])
