"""The table of the most accurate values of the ladder, each with two error bars.

One is a calibrated bound for the extrapolated value (`vibsim.convergence.extrapolation.numbers`), the other the grid
convergence index of the value of the finest level (`vibsim.convergence.extrapolation.gci`).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence

from vibsim.comparison.best_values import WORDS, Scalar, scalars
from vibsim.models import Model
from vibsim.report import style, words
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.tables.table import Cell, Column, Table, Written
from vibsim.schemes.orders import is_autonomous

CLASSES = {
    "unknown": "–",
    "monotone": "monotone",
    "oscillating": "oscillating",
    "monotone_divergence": "diverging",
    "oscillating_divergence": "diverging, alternating",
    "round_off": "round-off",
}
"""Kind of convergence over the levels to its words."""
MOST_DIGITS = 16  # significant digits of a double
OF_A_PERIODIC_MOTION = "period", "frequency", "growth_per_period"
"""Numbers that are meaningful for a free motion in one coordinate; for others only if a check names them."""
NEVER_NEGATIVE = *OF_A_PERIODIC_MOTION, "amplitude", "relative_energy_error"
PER_NUMBER = ("finest level", "GCI", "GCI relative", "order", "levels", "convergence")
"""Columns whose data are stored only with series."""


def table(record: Results, shown: Sequence[Member], checked: Collection[str] = ()) -> Table | None:
    """Return the best value of every number of the members; None without numbers, or for a single level.

    `checked` are the names of the numbers of checks.
    """
    if len(record.levels) < 2 or "period_richardson" not in record:
        return None
    columns = (
        Column("number"), Column("scheme"), *([Column("member")] if record.swept else []),
        Column("finest level", form="full"), Column("GCI", form="small"), Column("GCI relative", form="small"),
        Column("best value", form="full"), Column("bound", form="small"), Column("true error", form="small"),
        Column("order", form="order"), Column("levels"), Column("convergence"),
    )  # fmt: skip
    rows = tuple(_rows(record, shown, checked))
    if not rows:
        return None
    text = (
        "Best values from the ladder: extrapolated over the levels named, with a bound of the error that held in more "
        "than 95 % of a large random set; “unknown” where changes from level to level do not shrink steadily"
    )
    if "scalar" in record:
        text += (
            "; “not extrapolated” where that cannot be trusted. The grid convergence index (GCI) is the usual error "
            "bar of the finest level's value, not of the best one; relative to it where it is not near zero"
        )
    missing = ["true error", *(() if "scalar" in record else PER_NUMBER)]
    return Table("best_values", text, columns, rows, 1).without_empty(missing)


def numbers(model: Model, is_lean: bool, checked: Collection[str]) -> list[tuple[int, Scalar]]:
    """Return the numbers that are meaningful for a motion, each with its position in the record."""
    is_periodic = model.is_alone and is_autonomous(model)
    return [
        (k, row)
        for k, row in enumerate(scalars(model, is_lean))
        if is_periodic or row.value in checked or row.value not in OF_A_PERIODIC_MOTION
    ]


def _rows(
    record: Results, shown: Sequence[Member], checked: Collection[str]
) -> Iterator[tuple[Cell, ...]]:
    has_series = "scalar" in record
    for k, row in numbers(record.model, not has_series, checked):
        name, nothing = row.variable, (None, None, None)
        is_named = row.quantity in words.NAMES or (row.quantity and record.model.coordinates > 1)
        text = f"{words.symbol(row.quantity)} {WORDS[row.value]}" if is_named else row.words
        title = style.label(text, record.unit(f"{name}_richardson"))
        for member in shown:
            value, bound = best_value(record, name, member)
            if not math.isfinite(value):
                continue
            if row.value in OF_A_PERIODIC_MOTION and abs(value) <= bound:
                continue  # its levels do not tell whether there is a period at all
            index = float(record.at(f"{name}_gci", member)) if has_series else math.nan
            yield (
                title,
                member.scheme_name,
                *([member.case_name] if record.swept else []),
                *(_finest(record, index, k, member) if has_series else nothing),
                best(row.value, value, bound if math.isfinite(bound) else index),
                Written(bound, "unknown") if math.isnan(bound) else error_size(bound),
                error_size(abs(value - _exact(record, name, member))),
                *(_approach(record, k, member) if has_series else nothing),
            )


def best_value(record: Results, name: str, member: Member) -> tuple[float, float]:
    """Return the best value of a number with its bound."""
    field = f"{name}_richardson"
    return float(record.at(field, member)), float(record.at(f"{field}_error", member))


def _finest(record: Results, index: float, k: int, member: Member) -> tuple[Cell, Cell, Cell]:
    """Return the value of the finest level and its grid convergence index, absolute and relative."""
    value, relative = (
        float(record.at(f"scalar_{field}", member, scalar=k)) for field in ("finest", "gci")
    )
    return rounded(value, index), error_size(index), error_size(relative)


def error_size(size: float) -> Written | None:
    """Write the size of an error with two digits; None if it is not finite."""
    if not math.isfinite(size):
        return None
    return Written(size, words.number(size, "brief"))


def best(name: str, value: float, bound: float) -> Written:
    """Write a best value; one that is never negative and may be 0 as an upper bound."""
    if name in NEVER_NEGATIVE and abs(value) <= bound:
        return Written(value, f"below {words.ceiling(value + bound)}")
    return rounded(value, bound)


def rounded(value: float, error: float) -> Written:
    """Write a number up to the second significant digit of its error."""
    if not (math.isfinite(error) and error > 0.0):
        return Written(value, words.printed(f"{value:.12g}"))
    size = math.floor(math.log10(abs(value))) if value else 0
    decimals = min(1 - math.floor(math.log10(error)), MOST_DIGITS - 1 - size)
    if -3 <= size < MOST_DIGITS:
        return Written(value, f"{value:.{max(decimals, 0)}f}".replace("-", "−"))
    return Written(value, words.printed(f"{value:.{max(decimals + size, 0)}e}"))


def used_levels(record: Results, k: int, member: Member) -> tuple[int, int]:
    """Return the coarsest and the finest level that the best value of the k-th number uses."""
    first, last = (int(record.at(f"scalar_{end}", member, scalar=k)) for end in ("first", "last"))
    return first, last


def _approach(record: Results, k: int, member: Member) -> tuple[Cell, Cell, Cell]:
    """Return the observed order, the levels used, and the kind of convergence."""
    first, last = used_levels(record, k, member)
    used = words.levels((first, last)) if first < last else f"{last}, not extrapolated"
    order = float(record.at("scalar_order", member, scalar=k))
    kind = str(record.flags("scalar_convergence")[k, *member.place])
    return order if math.isfinite(order) else None, used, CLASSES[kind]


def _exact(record: Results, name: str, member: Member) -> float:
    """Return the exact value of a number; NaN if it is unknown."""
    if name == "period":
        return float(record.exact_periods[member.case])
    quantity, _, which = name.rpartition("_")
    ladder = Ladder(record, quantity, member)
    # the common times need not include the end
    has_end = which == "end" and record.attrs.get("end_included")
    return float(ladder.exact[-1]) if has_end and "exact" in ladder else math.nan
