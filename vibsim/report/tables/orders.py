"""What the tables of a report hold."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from vibsim.core.record import Record
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.report import frame
from vibsim.report.data import (
    Member,
    at,
    case_name,
    exact_periods,
    floor_norm,
    norm_unit,
    place_of,
    sound_pairs,
    steps_of,
    swept,
    time_unit,
    unit,
    whole,
)
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
            words.expectation(check.get("expected")))  # fmt: skip
    for result in check.get("results") or [{}]:
        low, high = words.interval_of(result) or (None, None)
        window = words.levels_of(result)
        yield (
            *head, result.get("scheme"), result.get("case"), result.get("status"), result.get("reason"),
            words.fact(result, "order"), low, high, words.levels(window) if window else None,
            _number(words.decisive_number(result)),
        )  # fmt: skip


def _number(value: Any) -> Cell:
    return value if value is None or isinstance(value, int | float | str) else str(value)


def orders(
    record: Record, quantity: str, shown: Sequence[Member], norm: str = TYPICAL_NORM
) -> Table:
    """Return norms, ratios and orders of a quantity, one row per scheme, member and level."""
    measure, sweep = norm_unit(record, quantity, norm), bool(swept(record))
    columns = (
        Column("scheme"), *([Column("member")] if sweep else []), Column("level", form="integer"),
        Column("steps", form="integer"), Column("dt", time_unit(record, "dt"), "step"),
        Column("difference", measure, "norm"), Column("ratio", form="order"), Column("order", form="order"),
        Column("true error", measure, "norm"), Column("floor", measure, "norm"), Column("counts"),
    )  # fmt: skip
    rows = [row for member in shown for row in _order_rows(record, quantity, member, norm, sweep)]
    letter = words.symbol(quantity)
    pairs, triples = bool(whole(record, "pair")), bool(whole(record, "triple"))
    missing = () if triples else ("ratio", "order", "counts") if pairs else COMPARED
    caption = f"{letter}: {norm} norm of {letter}(level) − {letter}(next level)"
    caption += "; ratio and order from three levels starting here" if triples else ""
    columns, rows = without(missing, columns, rows)
    return Table(
        f"orders_{quantity}_{norm}",
        caption if pairs else f"{letter}: {norm} norm of its error",
        columns,
        tuple(rows),
        heads=2 if sweep else 0,
    )


COMPARED = ("difference", "ratio", "order", "counts")
"""Columns that take several levels."""


def without(
    names: Sequence[str], columns: tuple[Column, ...], rows: Iterable[tuple[Cell, ...]]
) -> tuple[tuple[Column, ...], list[tuple[Cell, ...]]]:
    """Return columns and rows without the columns of these headers."""
    kept = [i for i, column in enumerate(columns) if column.header not in names]
    return tuple(columns[i] for i in kept), [tuple(row[i] for i in kept) for row in rows]


def _order_rows(
    record: Record, quantity: str, member: Member, norm: str, sweep: bool
) -> Iterator[tuple[Cell, ...]]:
    n = record.words("norm").index(norm)
    levels, dt = whole(record, "level"), steps_of(record, member.case)
    columns = [
        _padded(record, f"{quantity}_{name}", member, n, len(levels))
        for name in ("difference_norm", "ratio_norm", "observed_order", "error_norm")
    ]
    floor = floor_norm(record, quantity, member, norm)
    note = _notes(record, quantity, member)
    for i, level in enumerate(levels):
        who: list[Cell] = [member.scheme_name, *([member.case_name] if sweep else [])]
        yield (
            *who,
            level,
            int(record["steps"][i]),
            float(dt[i]),
            *(column[i] for column in columns),
            float(floor[i]),
            note[i],
        )


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
    columns = [Column("scheme"), Column("level", form="integer")]
    for text in known.values():
        ratio = f"ratio, {text.split()[0]}" if text else "ratio"
        columns += [
            Column(f"max |dE| {text}".strip(), measure, "norm"),
            Column(ratio, form="order"),
        ]
    rows: list[tuple[Cell, ...]] = []
    for member in shown:
        found = [at(record, name, member) for name in known]
        whole_runs = at(record, "status", member) == 0
        for i, level in enumerate(whole(record, "level")):
            sound = whole_runs[i : i + 2].all()
            cells = [
                cell
                for values in found
                for cell in (float(values[i]), _ratio(values, i) if sound else math.nan)
            ]
            rows.append((member.title, level, *cells))
    caption = (
        "Largest energy deviation over every step; the last point has an end formula of its own"
    )
    several = len(whole(record, "level")) > 1
    missing = [c.header for c in columns if c.header.startswith("ratio") and not several]
    shown_columns, shown_rows = without(missing, tuple(columns), rows)
    heads = int(bool(swept(record)))
    return Table("energy_maxima", caption, shown_columns, tuple(shown_rows), heads)


def _ratio(values: Any, i: int) -> float:
    return (
        float(values[i] / values[i + 1]) if i + 1 < len(values) and values[i + 1] != 0 else math.nan
    )


def scalars(record: Record, shown: Sequence[Member]) -> Table | None:
    """Return period, amplitude and the period's error on every level."""
    if "period" not in record or not np.isfinite(np.asarray(record["period"], dtype=float)).any():
        return None
    time, angle = unit(record, "period"), unit(record, "amplitude")
    columns = (
        Column("scheme"), Column("level", form="integer"), Column("period", time, "full"),
        Column("exact period", time, "full"), Column("relative error", form="norm"),
        Column("amplitude", angle, "full"),
    )  # fmt: skip
    rows: list[tuple[Cell, ...]] = []
    for member in shown:
        period, amplitude = at(record, "period", member), at(record, "amplitude", member)
        exact = float(exact_periods(record)[member.case])
        for i, level in enumerate(whole(record, "level")):
            error = float(period[i]) / exact - 1.0 if math.isfinite(exact) else math.nan
            # the peak of a run that grows without bound may have either sign
            size = abs(float(amplitude[i]))
            rows.append((member.title, level, float(period[i]), exact, error, size))
    caption = "Period (interpolated) and amplitude"
    return Table("scalars", caption, columns, tuple(rows), int(bool(swept(record))))


def failures(summary: Mapping[str, Any], record: Record) -> Table | None:
    """Return the runs that broke down; None where there is none."""
    found = summary.get("failures") or []
    if not found:
        return None
    columns = (
        Column("scheme"), Column("level", form="integer"), Column("case", form="integer"), Column("member"),
        Column("t", time_unit(record), "step"), Column("step", form="integer"), Column("error"),
    )  # fmt: skip
    rows = tuple(
        (
            f["scheme"],
            f["level"],
            f["case"],
            _member(record, f["case"]),
            f["t"],
            f["step"],
            f["error"],
        )
        for f in found
    )
    return Table(
        "failures",
        "Runs that broke down: the first moment at which the solution was not finite",
        columns,
        rows,
    )


def _member(record: Record, case: int) -> str:
    place = place_of(record, case)
    return "" if place is None else case_name(record, place)
