"""What the tables of a report hold."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from vibsim.core.record import Record
from vibsim.core.vocabulary import TYPICAL_NORM, decisive_number
from vibsim.report import frame
from vibsim.report.data import (
    Floats,
    Member,
    at,
    case_name,
    exact_periods,
    floor_norm,
    norm_unit,
    place_of,
    sound_pairs,
    time_unit,
    unit,
    whole,
)
from vibsim.report.tables.by_level import Fill, by_level, cells, step_column
from vibsim.report.tables.table import Cell, Column, Table
from vibsim.report.text import words


def checks(summary: Mapping[str, Any]) -> Table:
    """Return every check with every result that the summary lists."""
    columns = (
        Column("check"), Column("kind"), Column("quantity"), Column("status"), Column("reason"), Column("expected"),
        Column("scheme"), Column("case", form="integer"), Column("measured status"), Column("measured reason"),
        Column("order", form="order"), Column("order, low", form="order"), Column("order, high", form="order"),
        Column("levels"), Column("value", form="full"),
    )  # fmt: skip
    rows = [row for check in summary["checks"] for row in _check_rows(check)]
    return Table("checks", "Checks: expected and measured", columns, tuple(rows))


def _check_rows(check: Mapping[str, Any]) -> Iterator[tuple[Cell, ...]]:
    head = (check["id"], check["kind"], check.get("quantity"), check["status"], check["reason"],
            check.get("expected"))  # fmt: skip
    for result in check.get("results") or [{}]:
        low, high = words.interval_of(result) or (None, None)
        window = words.levels_of(result)
        yield (
            *head, result.get("scheme"), result.get("case"), result.get("status"), result.get("reason"),
            words.fact(result, "order"), low, high, words.levels(window) if window else None,
            decisive_number(result.get("facts") or {}),
        )  # fmt: skip


def orders(
    record: Record, quantity: str, shown: Sequence[Member], norm: str = TYPICAL_NORM
) -> Table:
    """Return norms, ratios and orders of a quantity, one row per scheme, member and level."""
    measure, n = norm_unit(record, quantity, norm), record.words("norm").index(norm)
    letter, pairs = words.symbol(quantity), bool(whole(record, "pair"))
    triples, count = bool(whole(record, "triple")), len(whole(record, "level"))
    floors = {member: floor_norm(record, quantity, member, norm) for member in shown}
    notes = {member: _notes(record, quantity, member) for member in shown}

    def of(name: str) -> Fill:
        found = {m: _padded(record, f"{quantity}_{name}", m, n, count) for m in shown}
        return lambda member, i: found[member][i]

    filled = (
        (Column("steps", form="integer"), lambda member, i: int(record["steps"][i])),
        step_column(record),
        (Column("difference", measure, "norm"), of("difference_norm")) if pairs else None,
        (Column("ratio", form="order"), of("ratio_norm")) if triples else None,
        (Column("order", form="order"), of("observed_order")) if triples else None,
        (Column("true error", measure, "norm"), of("error_norm")),
        (Column("floor", measure, "norm"), lambda member, i: float(floors[member][i])),
        (Column("counts"), lambda member, i: notes[member][i]) if triples else None,
    )
    caption = f"{letter}: {norm} norm of {f'{letter}(level) − {letter}(next level)' if pairs else 'its error'}"
    caption += "; ratio and order from three levels starting here" if triples else ""
    return by_level(record, f"orders_{quantity}_{norm}", caption, shown, filled)


def _padded(record: Record, name: str, member: Member, norm: int, count: int) -> list[float]:
    values = at(record, name, member, norm=norm).tolist() if name in record else []
    return [*values, *[math.nan] * (count - len(values))]


def _notes(record: Record, quantity: str, member: Member) -> list[str]:
    """Say of every row whether the stated order rests on the three levels that start there."""
    levels = whole(record, "level")
    first, last = (int(at(record, f"{quantity}_window_{end}", member)) for end in ("first", "last"))
    notes = []
    for i, level in enumerate(levels):
        finest = levels[min(i + 2, len(levels) - 1)]
        if first <= level and finest <= last and i + 2 < len(levels):
            notes.append("yes")
        elif 0 <= level < first:
            notes.append("too coarse")
        else:
            notes.append(_why_not(record, quantity, member, i))
    return notes


def _why_not(record: Record, quantity: str, member: Member, i: int) -> str:
    """Say what is known of a row that the stated order does not rest on: the levels from the i-th on."""
    count = len(whole(record, "level"))
    places = list(range(i, min(i + 3, count)))
    above = sound_pairs(record, quantity, member) if len(places) > 1 else []
    if not all(above[k] for k in places[:-1]):
        lost = frame.why_lost(record, quantity, member, places, np.zeros(1))
        return lost.removeprefix("lost in ")
    return "no" if i + 2 < count else "–"


def maxima(record: Record, shown: Sequence[Member]) -> Table | None:
    """Return max|dE| over every step with and without the last point, and their ratios from level to level."""
    if "energy_deviation_max_abs" not in record:
        return None
    measure = unit(record, "energy_deviation_max_abs")
    # lean records leave the second out
    known = {
        name: text
        for name, text in (
            ("energy_deviation_max_abs", ""),
            ("energy_deviation_max_abs_interior", "without the last point"),
        )
        if name in record
    }
    several = len(whole(record, "level")) > 1
    filled: list[tuple[Column, Fill] | None] = []
    for name, text in known.items():
        header = f"ratio, {text.split()[0]}" if text else "ratio"
        values = np.asarray(record[name], dtype=np.float64)
        filled.append((Column(f"max |dE| {text}".strip(), measure, "norm"), cells(values)))
        filled.append((Column(header, form="order"), _ratio(record, values)) if several else None)
    caption = (
        "Largest energy deviation over every step; the last point has an end formula of its own"
    )
    return by_level(record, "energy_maxima", caption, shown, filled, titled=True)


def _ratio(record: Record, values: Floats) -> Fill:
    """Return what fills a column with the ratio of a level's value to that of the next one."""

    def fill(member: Member, i: int) -> Cell:
        found = values[member.scheme, member.case]
        is_sound = (at(record, "status", member)[i : i + 2] == 0).all()
        is_there = i + 1 < len(found) and found[i + 1] != 0
        return float(found[i] / found[i + 1]) if is_sound and is_there else math.nan

    return fill


def scalars(record: Record, shown: Sequence[Member]) -> Table | None:
    """Return period, amplitude and the period's error on every level."""
    if "period" not in record or not np.isfinite(np.asarray(record["period"], dtype=float)).any():
        return None
    time, angle = unit(record, "period"), unit(record, "amplitude")
    period = np.asarray(record["period"], dtype=np.float64)
    exact = exact_periods(record)

    def error(member: Member, i: int) -> Cell:
        known = float(exact[member.case])
        measured = float(period[member.scheme, member.case, i])
        return measured / known - 1.0 if math.isfinite(known) else math.nan

    filled = (
        (Column("period", time, "full"), cells(period)),
        (Column("exact period", time, "full"), lambda member, i: float(exact[member.case])),
        (Column("relative error", form="norm"), error),
        # the peak of a run that grows without bound may have either sign
        (Column("amplitude", angle, "full"), cells(np.abs(record["amplitude"]))),
    )
    caption = "Period (interpolated) and amplitude"
    return by_level(record, "scalars", caption, shown, filled, titled=True)


def failures(summary: Mapping[str, Any], record: Record) -> Table | None:
    """Return the runs that broke down; None where there is none."""
    found = summary.get("failures") or []
    if not found:
        return None
    columns = (
        Column("scheme"), Column("level", form="integer"), Column("case", form="integer"), Column("member"),
        Column("t", time_unit(record), "step"), Column("step", form="integer"), Column("error"),
    )  # fmt: skip
    keys = ("scheme", "level", "case", "member", "t", "step", "error")
    rows = tuple(
        tuple({**row, "member": _member(record, row["case"])}[key] for key in keys) for row in found
    )
    caption = "Runs that broke down: the first moment at which the solution was not finite"
    return Table("failures", caption, columns, rows)


def _member(record: Record, case: int) -> str:
    place = place_of(record, case)
    return "" if place is None else case_name(record, place)
