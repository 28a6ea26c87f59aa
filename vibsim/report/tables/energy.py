"""The table of energy errors by a scheme's own velocity and by the centred difference ``[D_2t u]``.

The text's tables (vibration text, sections 6.2 and 7.1) use ``[D_2t u]^n = (u^(n+1) - u^(n-1))/(2 dt)``, n = 1 .. N-1,
whatever the scheme; for many schemes what they show is the error of that difference and not the scheme's.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from vibsim.core.record import Record
from vibsim.report.data import Floats, flags, known, steps_of, swept, time_unit, whole
from vibsim.report.tables.table import Cell, Column, Table, Written
from vibsim.report.tables.theory import MEMBER, OF_LEVEL, everyone

OWN, CENTRED = "energy_deviation_max_abs", "energy_deviation_d2t_max_abs"


def velocities(record: Record) -> Table | None:
    """Return the largest relative energy error with both velocities; None where no scheme has one of its own."""
    if CENTRED not in record or not np.isfinite(known(record, CENTRED, OF_LEVEL)).any():
        return None
    named = "energy_drift_kind" in record
    columns = (
        Column("scheme"), *([Column("member")] if swept(record) else []), Column("level", form="integer"),
        Column("dt", time_unit(record, "dt"), "step"),
        Column("max |dE|/E(0), own velocity", form="small"), Column("max |dE|/E(0), [D₂ₜu]", form="small"),
        Column("second over first", form="norm"),
        *([Column("drift of the energy, own velocity")] if named else []),
    )  # fmt: skip
    caption = (
        "Energy error by the velocity that it is made with: the scheme's own, over every step; and [D₂ₜu], over every "
        "step but the first and the last, as in the tables of the text. Where the second is much larger, it shows the "
        "error of the centred difference and not that of the scheme; where both are alike, the scheme makes it; where "
        "the second is smaller, the own velocity is the less accurate one, as that of Euler-Cromer, which is of first "
        "order only"
    )
    rows = tuple(_rows(record, named))
    return Table("energy_velocities", caption, columns, rows, 2 * int(bool(swept(record))))


def relative(record: Record, name: str) -> Floats:
    """Return a number over the first energy of each member, shape (scheme, case, level); NaN where that vanishes."""
    values, first = known(record, name, OF_LEVEL), np.abs(known(record, "energy_initial", MEMBER))
    return np.asarray(values / np.where(first > 0.0, first, np.nan)[..., None])


def _rows(record: Record, named: bool) -> Iterator[tuple[Cell, ...]]:
    own, centred = relative(record, OWN), relative(record, CENTRED)
    interior = relative(record, f"{OWN}_interior")
    kinds = flags(record, "energy_drift_kind") if named else None
    rates = known(record, "energy_drift_rate", OF_LEVEL)
    for member in everyone(record):
        dt = steps_of(record, member.case)
        place = member.scheme, member.case
        is_same = np.isnan(centred[place]).all()
        for i, level in enumerate(whole(record, "level")):
            who = [member.scheme_name, *([member.case_name] if swept(record) else [])]
            a = float(own[(*place, i)])
            # the velocity of such a scheme is the centred difference, but at the last step
            b = float((interior if is_same else centred)[(*place, i)])
            kind = [] if kinds is None else [_drift(kinds[(*place, i)], float(rates[(*place, i)]))]
            is_noise = a <= ROUND_OFF or kind == ["none"]
            quotient = None if is_same or is_noise else _plain(b / a)
            yield (*who, level, float(dt[i]), a, b, quotient, *kind)


ROUND_OFF = 1e-13
"""A relative error that is no larger is rounding, and nothing is worth comparing with it."""


def _drift(kind: str, rate: float) -> str:
    """Return how the energy drifts, in words: an exponential drift with its direction."""
    if kind == "exponential":
        return "exponential decay" if rate < 0.0 else "exponential growth"
    return str(kind).replace("_", " ")


def _plain(quotient: float) -> Cell:
    """Return a quotient that is written without powers of ten, with three digits at least."""
    if not math.isfinite(quotient) or quotient <= 0.0:
        return quotient
    rounded = float(f"{quotient:.2e}")
    places = max(2 - math.floor(math.log10(rounded)), 0)
    return Written(quotient, f"{quotient:.{places}f}")
