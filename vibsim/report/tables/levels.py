"""Tables with a row for every scheme, member and level: orders, periods, energy errors, events.

Source of the two energy errors: vibration text, sections 6.2 and 7.1. The text uses ``[D_2t u]^n = (u^(n+1) -
u^(n-1))/(2 dt)``, n = 1 .. N-1, for every scheme, which often shows the error of this difference, not of the scheme.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.core.vocabulary import MEMBER, OF_LEVEL, ORDER_TOLERANCE, TYPICAL_NORM
from vibsim.report import frame, style, words
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.tables.table import Cell, Column, Table, Written

OWN, CENTRED = "energy_deviation_max_abs", "energy_deviation_d2t_max_abs"
ROUND_OFF = 1e-13  # relative errors up to this are rounding, and no quotient of them is shown
Fill = Callable[[Member, int], Cell]  # returns the cell for a member and the position of a level


def by_level(
    record: Results,
    name: str,
    caption: str,
    members: Sequence[Member],
    filled: Sequence[tuple[Column, Fill] | None],
    *,
    titled: bool = False,
    included: Flags | None = None,
) -> Table:
    """Return a table with a row for every member and level, or for the `included` ones, shape (scheme, case, level).

    `filled` are the columns after scheme, member and level, each with its fill function (None is left out). In a
    `titled` table scheme and member share a column.
    """
    names = ["scheme", "member"] if record.swept and not titled else ["scheme"]
    shown = [column for column in filled if column is not None]
    columns = (*map(Column, names), Column("level", form="integer"), *(c for c, _ in shown))
    rows = []
    for member in members:
        # with the dotted keys of the experiment file
        heads = [text for text in (member.scheme_name, member.case_name) if text]
        heads = [", ".join(heads)] if titled else heads
        for i, level in enumerate(record.levels):
            if included is None or included[member.scheme, member.case, i]:
                rows.append((*heads, level, *(fill(member, i) for _, fill in shown)))
    return Table(name, caption, columns, tuple(rows), len(names) if record.swept else 0)


def _cells(values: Floats, kind: type[int] | type[float] = float) -> Fill:
    """Return a function that fills a column with numbers of shape (scheme, case, level)."""
    return lambda member, i: kind(values[member.scheme, member.case, i])


def _step_column(record: Results) -> tuple[Column, Fill]:
    column = Column("dt", record.time_unit, "step")
    return column, lambda member, i: float(record.dt(member.case)[i])


def orders(
    record: Results, quantity: str, shown: Sequence[Member], norm: str = TYPICAL_NORM
) -> Table:
    """Return norms, ratios and orders of a quantity, one row per scheme, member and level."""
    measure, letter = record.norm_unit(quantity, norm), words.symbol(quantity)
    pairs, triples = bool(record.pairs), bool(record.triples)
    floors = {member: Ladder(record, quantity, member).floor(norm) for member in shown}
    notes = {member: _notes(Ladder(record, quantity, member), norm) for member in shown}

    def cells(name: str) -> Fill:
        values = record.optional(f"{quantity}_{name}", (*MEMBER, "level"), norm)
        return lambda m, i: float(values[m.scheme, m.case, i]) if i < values.shape[2] else math.nan

    filled = (
        (Column("steps", form="integer"), lambda member, i: record.steps[i]),
        _step_column(record),
        (Column("difference", measure, "norm"), cells("difference_norm")) if pairs else None,
        (Column("ratio", form="order"), cells("ratio_norm")) if triples else None,
        (Column("order", form="order"), cells("observed_order")) if triples else None,
        (Column("true error", measure, "norm"), cells("error_norm")),
        (Column("floor", measure, "norm"), lambda member, i: float(floors[member][i])),
        (Column("counts"), lambda member, i: notes[member][i]) if triples else None,
    )
    what = "difference from the next level" if pairs else "error"
    caption = f"{letter}: {words.NORMS[norm]} of its {what}"
    caption += "; ratio and order from three levels starting here" if triples else ""
    return by_level(record, f"orders_{quantity}_{norm}", caption, shown, filled)


def _notes(ladder: Ladder, norm: str) -> list[str]:
    """Return for every level whether the stated order uses the three levels from there on, or why not."""
    levels, (first, last) = ladder.record.levels, ladder.window
    stated, *_ = ladder.stated_order(norm)
    local = ladder.optional("observed_order", ("level",), norm)
    above = ladder.sound_pairs if len(levels) > 1 else []
    notes = []
    for i, level in enumerate(levels):
        positions, has_three = list(range(i, min(i + 3, len(levels)))), i + 2 < len(levels)
        if has_three and first <= level and levels[i + 2] <= last and math.isfinite(stated):
            notes.append("yes")
        elif 0 <= level < first:
            is_like = has_three and abs(local[i] - stated) <= ORDER_TOLERANCE
            notes.append("not needed" if is_like else "too coarse")
        elif all(above[k] for k in positions[:-1]):
            notes.append("no" if has_three else "–")
        else:
            notes.append(frame.why_lost(ladder, positions, np.zeros(1)).removeprefix("lost in "))
    return notes


def maxima(record: Results, shown: Sequence[Member]) -> Table | None:
    """Return max|ΔE| over all steps, with and without the last point, and the ratios of successive levels."""
    if OWN not in record:
        return None
    measure, several = record.unit(OWN), len(record.levels) > 1
    filled: list[tuple[Column, Fill]] = []
    for name, text, ratio in (
        (OWN, "max |ΔE|", "ratio"),
        (f"{OWN}_interior", "max |ΔE| without the last point", "ratio, without"),
    ):
        # lean records lack the second
        if name in record:
            values, is_sound = record.optional(name, OF_LEVEL), record["status"] == 0
            filled.append((Column(text, measure, "norm"), _cells(values)))
            if several:
                filled.append((Column(ratio, form="order"), _cells(_ratios(values, is_sound))))
    caption = "Largest energy deviation over every step; the last point has its own end formula"
    return by_level(record, "energy_maxima", caption, shown, filled, titled=True)


def _ratios(values: Floats, is_sound: Flags) -> Floats:
    """Return the ratio of each level's value to that of the next one, shape (scheme, case, level); NaN without one."""
    ratios = np.full(values.shape, np.nan)
    coarser, finer = values[..., :-1], values[..., 1:]
    is_defined = is_sound[..., :-1] & is_sound[..., 1:] & (finer != 0.0)
    np.divide(coarser, finer, out=ratios[..., :-1], where=is_defined)
    return ratios


def scalars(record: Results, shown: Sequence[Member]) -> Table | None:
    """Return period, amplitude and the period's error on every level."""
    period, exact = record.optional("period", OF_LEVEL), record.exact_periods
    if not np.isfinite(period).any():
        return None
    time, angle = record.unit("period"), record.unit("amplitude")
    usable = np.where(np.isfinite(exact), exact, np.nan)[:, None]
    filled = (
        (Column("period", time, "full"), _cells(period)),
        (Column("exact period", time, "full"), lambda member, i: float(exact[member.case])),
        (Column("relative error", form="norm"), _cells(period / usable - 1.0)),
        # in a run that grows without bound the sign is arbitrary
        (Column("amplitude", angle, "full"), _cells(np.abs(record["amplitude"]))),
    )
    caption = "Period (interpolated) and amplitude"
    return by_level(record, "scalars", caption, shown, filled, titled=True)


def velocities(record: Results) -> Table | None:
    """Return the largest relative energy error with both velocities; None if no scheme has its own velocity."""
    if CENTRED not in record or not np.isfinite(record.optional(CENTRED, OF_LEVEL)).any():
        return None
    first = style.positive(np.abs(record.optional("energy_initial", MEMBER)))[..., None]
    own, centred, interior = (
        record.optional(name, OF_LEVEL) / first for name in (OWN, CENTRED, f"{OWN}_interior")
    )
    # a scheme without its own velocity uses the centred difference, except at the last step
    is_same = np.asarray(np.isnan(centred).all(axis=-1))
    second = np.where(is_same[..., None], interior, centred)
    is_named = "energy_drift_kind" in record
    kinds = record.flags("energy_drift_kind") if is_named else np.full(own.shape, "")
    rates = record.optional("energy_drift_rate", OF_LEVEL)

    def quotient(member: Member, i: int) -> Cell:
        place = member.scheme, member.case, i
        is_noise = own[place] <= ROUND_OFF or kinds[place] == "none"
        return None if is_same[place[:2]] or is_noise else _plain(float(second[place] / own[place]))

    def drift(member: Member, i: int) -> Cell:
        place = member.scheme, member.case, i
        if kinds[place] == "exponential":
            return "exponential decay" if rates[place] < 0.0 else "exponential growth"
        return str(kinds[place]).replace("_", " ")

    caption = (
        "Energy error by velocity: the scheme's own, over every step; and [D₂ₜu], over every step but the first and "
        "the last, as in the tables of the text. If the second is much larger, it shows the error of the centred "
        "difference, not that of the scheme. If both are alike, the scheme makes the error. If the second is smaller, "
        "the own velocity is less accurate, as with Euler-Cromer, whose velocity is of first order only"
    )
    filled = (
        _step_column(record),
        (Column("max |ΔE|/E(0), own velocity", form="small"), _cells(own)),
        (Column("max |ΔE|/E(0), [D₂ₜu]", form="small"), _cells(second)),
        (Column("second over first", form="norm"), quotient),
        (Column("drift of the energy, own velocity"), drift) if is_named else None,
    )
    return by_level(record, "energy_velocities", caption, record.all_members, filled)


def _plain(quotient: float) -> Cell:
    """Write a quotient without a power of ten, with at least three digits."""
    if not math.isfinite(quotient) or quotient <= 0.0:
        return quotient
    rounded = float(f"{quotient:.2e}")
    places = max(2 - math.floor(math.log10(rounded)), 0)
    return Written(quotient, f"{quotient:.{places}f}")


def events(record: Results) -> Table | None:
    """Return number and times of impacts, turns under friction and rest; None if there are none."""
    count, first, last, rest_time = (
        record.optional(name, OF_LEVEL)
        for name in ("event_count", "first_event_time", "last_event_time", "rest_time")
    )
    if not (count > 0.0).any():
        return None
    caption = (
        "Events (impacts; turns and starts of a body under friction; events of the file): where they are located, "
        "their times move with the level as the error of the scheme does, else by part of a step"
    )
    seconds, has_rest = record.time_unit, np.isfinite(rest_time).any()

    def change(member: Member, i: int) -> Cell:
        """Return the time of the last event minus that on the next finer level; None if it is a different event."""
        counts, times = (part[member.scheme, member.case, i : i + 2] for part in (count, last))
        is_same = counts.size == 2 and counts[0] == counts[1] and np.isfinite(times[0] - times[1])
        return float(times[0] - times[1]) if is_same else None

    filled = (
        _step_column(record),
        (Column("events", form="integer"), _cells(count, int)),
        (Column("first", seconds, "value"), _cells(first)),
        (Column("last", seconds, "value"), _cells(last)),
        (Column("at rest from", seconds, "value"), _cells(rest_time)) if has_rest else None,
        (Column("last, less that of the next finer level", seconds, "small"), change),
    )
    return by_level(record, "events", caption, record.all_members, filled)
