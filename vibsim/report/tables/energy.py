"""The table of energy errors by a scheme's own velocity and by the centred difference ``[D_2t u]``.

The text's tables (vibration text, sections 6.2 and 7.1) use ``[D_2t u]^n = (u^(n+1) - u^(n-1))/(2 dt)``, n = 1 .. N-1,
whatever the scheme; for many schemes what they show is the error of that difference and not the scheme's.
"""

from __future__ import annotations

import math

import numpy as np

from vibsim.core.record import Record
from vibsim.report.data import Floats, Member, flags, known
from vibsim.report.tables.by_level import by_level, cells, step_column
from vibsim.report.tables.table import Cell, Column, Table, Written
from vibsim.report.tables.theory import MEMBER, OF_LEVEL, everyone

OWN, CENTRED = "energy_deviation_max_abs", "energy_deviation_d2t_max_abs"


def velocities(record: Record) -> Table | None:
    """Return the largest relative energy error with both velocities; None where no scheme has one of its own."""
    if CENTRED not in record or not np.isfinite(known(record, CENTRED, OF_LEVEL)).any():
        return None
    own, centred = relative(record, OWN), relative(record, CENTRED)
    # the velocity of a scheme without another one is the centred difference, but at the last step
    is_same = np.asarray(np.isnan(centred).all(axis=-1))
    second = np.where(is_same[..., None], relative(record, f"{OWN}_interior"), centred)
    is_named = "energy_drift_kind" in record
    kinds = flags(record, "energy_drift_kind") if is_named else np.full(own.shape, "")
    rates = known(record, "energy_drift_rate", OF_LEVEL)

    def quotient(member: Member, i: int) -> Cell:
        at = member.scheme, member.case, i
        is_noise = own[at] <= ROUND_OFF or kinds[at] == "none"
        return None if is_same[at[:2]] or is_noise else _plain(float(second[at] / own[at]))

    def drift(member: Member, i: int) -> Cell:
        at = member.scheme, member.case, i
        return _drift(kinds[at], float(rates[at]))

    caption = (
        "Energy error by the velocity that it is made with: the scheme's own, over every step; and [D₂ₜu], over every "
        "step but the first and the last, as in the tables of the text. Where the second is much larger, it shows the "
        "error of the centred difference and not that of the scheme; where both are alike, the scheme makes it; where "
        "the second is smaller, the own velocity is the less accurate one, as that of Euler-Cromer, which is of first "
        "order only"
    )
    filled = (
        step_column(record),
        (Column("max |dE|/E(0), own velocity", form="small"), cells(own)),
        (Column("max |dE|/E(0), [D₂ₜu]", form="small"), cells(second)),
        (Column("second over first", form="norm"), quotient),
        (Column("drift of the energy, own velocity"), drift) if is_named else None,
    )
    return by_level(record, "energy_velocities", caption, everyone(record), filled)


def relative(record: Record, name: str) -> Floats:
    """Return a number over the first energy of each member, shape (scheme, case, level); NaN where that vanishes."""
    values, first = known(record, name, OF_LEVEL), np.abs(known(record, "energy_initial", MEMBER))
    return np.asarray(values / np.where(first > 0.0, first, np.nan)[..., None])


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
