"""Tables of what theory predicts of every scheme beside what was measured.

Source: vibration text, sections 4.1 to 4.6 (frequency and growth on ``u'' + w^2 u = 0``), 5.6, 6.2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from vibsim.analysis.motion_variables import PEAKS
from vibsim.core.record import Record
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.report import choice, finest_level
from vibsim.report.data import (
    Floats,
    Member,
    case_name,
    formal_orders,
    known,
    swept,
    time_unit,
    unit,
    whole,
)
from vibsim.report.tables.table import Cell, Column, Table, Written
from vibsim.report.text import words
from vibsim.schemes import SCHEMES

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

MEMBER = ("scheme", "case")
OF_LEVEL = ("scheme", "case", "level")
LIMITS = {0.0: "never", math.inf: "any"}
"""Words for limits of stability that are no number."""
EDGE = 1e-9
"""Relative distance within which a step counts as lying on the limit of stability."""


def everyone(record: Record) -> list[Member]:
    """Return every scheme and member, all members of a scheme together."""
    return [
        Member(s, case, name, case_name(record, case))
        for s, name in enumerate(record.words("scheme"))
        for case in range(len(record["case"]))
    ]


def predicted(record: Record) -> bool:
    """Say whether theory predicts anything here: it does for linear models."""
    return bool(np.isfinite(known(record, "theory_growth", OF_LEVEL)).any())


def schemes(experiment: Experiment, record: Record) -> Table | None:
    """Return one row per scheme: what it states, and the orders found; None for one scheme alone."""
    names = record.words("scheme")
    if len(names) < 2:
        return None
    quantities = [choice.position(experiment)]
    if experiment.model.definition.conservative and "energy_deviation_order" in record:
        quantities.append("energy_deviation")
    columns = [
        Column("scheme"), Column("family"), Column("type"),
        Column("force evaluations per step", form="integer"), Column("stable up to w dt", form="step"),
    ]  # fmt: skip
    for quantity in quantities:
        letter = words.symbol(quantity)
        columns.append(Column(f"order of {letter}, stated", form="step"))
        if whole(record, "triple"):
            columns.append(Column("measured, ± half its interval", form="order"))
    rows = tuple(tuple(_scheme(experiment, record, s, quantities)) for s in range(len(names)))
    several = (
        "; of a sweep the member whose order is farthest from the stated one"
        if swept(record)
        else ""
    )
    measured = (
        f", and the order measured in the {TYPICAL_NORM} norm" if whole(record, "triple") else ""
    )
    caption = (
        f"Schemes: what each states (explicit or implicit, s: symplectic){measured} (order ∞: exact, there is no "
        f"error to shrink){several if measured else ''}"
    )
    return Table("schemes", caption, tuple(columns), rows)


def _scheme(
    experiment: Experiment, record: Record, s: int, quantities: list[str]
) -> Iterator[Cell]:
    spec = experiment.schemes[s]
    scheme = SCHEMES[spec.kind]
    words_of = ["adaptive" if scheme.adaptive else "explicit" if scheme.explicit else "implicit"]
    words_of += ["s"] if scheme.symplectic else []
    named = spec.name if spec.name.startswith(spec.kind) else f"{spec.name} ({spec.kind})"
    yield from (named, scheme.family, ", ".join(words_of))
    yield None if scheme.adaptive else scheme.force_evaluations
    limit = _alike(known(record, "stability_limit", MEMBER)[s])
    if isinstance(limit, float):
        limit = Written(limit, LIMITS.get(limit, words.number(limit, "step")))
    yield limit
    for quantity in quantities:
        formal = formal_orders(record, quantity)[s]
        value, low, high = (part[s] for part in finest_level.orders(record, quantity))
        with np.errstate(invalid="ignore"):
            away = np.abs(value - formal)
        case = int(np.argmax(np.where(np.isfinite(away), away, -1.0)))
        yield _alike(formal)
        if whole(record, "triple"):
            yield _with_interval(float(value[case]), 0.5 * float(high[case] - low[case]))


def _with_interval(order: float, half: float) -> Cell:
    """Return an order that is written with its interval, to no more digits than that leaves."""
    if not math.isfinite(order) or not math.isfinite(half):
        return order
    places = min(max(1 - math.floor(math.log10(half)), 1), 6) if half > 0.0 else 6
    return Written(order, f"{order:.{places}f} ± {half:.{places}f}".replace("-", "−"))


def _alike(values: Floats) -> Cell:
    """Return the one number that all members have, or a word where they differ; None where there is none."""
    found = np.unique(values[~np.isnan(values)])
    if found.size > 1:
        return "varies"
    return float(found[0]) if found.size else None


def predictions(record: Record) -> list[Table]:
    """Return what is predicted and measured of every scheme, member and level: growth; frequency and phase error."""
    if not predicted(record):
        return []
    time = time_unit(record)
    rate = unit(record, "theory_frequency") or f"rad/{time}"
    by_peaks = record.variable("measured_growth").attrs.get("method") == PEAKS
    peaks = (
        "The measured numbers come from peaks interpolated by a parabola, which leaves an error of its own on coarse "
        "levels"
        if by_peaks
        else "The measured numbers are those of the recurrence that the computed steps satisfy"
    )
    growth = (
        "Theory beside measurement: growth of the amplitude per natural period, predicted by the matrix of one step. "
        f"{peaks}"
    )
    phase = (
        "Theory beside measurement: frequency, and the time by which the peaks come early (+) or late (−) in each "
        f"period. {peaks}"
    )
    return [
        _predictions(record, "theory_growth", growth, {"growth": ("growth per period − 1", "")}),
        _predictions(
            record,
            "theory_phase",
            phase,
            {"frequency": ("frequency", rate), "phase_error": ("phase error", time)},
        ),
    ]


def _predictions(
    record: Record, name: str, caption: str, shown: dict[str, tuple[str, str]]
) -> Table:
    columns = [
        Column("scheme"), *([Column("member")] if swept(record) else []), Column("level", form="integer"),
        Column("w dt", form="step"), Column("stable"),
    ]  # fmt: skip
    for text, measure in shown.values():
        columns += [
            Column(f"{text}: predicted", measure, "close"),
            Column("measured", measure, "close"),
            Column(DIFFERENCE, measure, "brief"),
        ]
    rows = tuple(_prediction_rows(record, tuple(shown)))
    table = Table(name, caption, tuple(columns), rows, 2 * bool(swept(record)))
    kept = [
        i
        for i, column in enumerate(columns)
        if column.header != DIFFERENCE or any(row[i] is not None for row in rows)
    ]
    agree = ". Where no difference is shown, the two agree to round-off"
    return (
        table if len(kept) == len(columns) else replace(table.only(kept), caption=caption + agree)
    )


DIFFERENCE = "difference"
ROUNDINGS = 32.0
"""Predicted and measured numbers agree to round-off within so many of them for each step of a period."""


def _beside(name: str, told: float, seen: float, noise: float) -> Iterator[Cell]:
    """Yield a predicted and a measured number and their difference, None where it is round-off; growth less one."""
    difference = seen - told
    for value in (told, seen):
        shown = value - 1.0 if name == "growth" else value
        is_noise = 0.0 < abs(shown) <= noise
        yield Written(shown, words.number(shown, "brief")) if is_noise else shown
    yield None if abs(difference) <= noise else difference


def _prediction_rows(record: Record, names: tuple[str, ...]) -> Iterator[tuple[Cell, ...]]:
    levels, product = whole(record, "level"), omega_dt(record)
    limit = known(record, "stability_limit", MEMBER)
    theory = known(record, "theory_growth", OF_LEVEL)
    rates = known(record, "theory_frequency", OF_LEVEL)
    pairs = [
        (known(record, f"theory_{name}", OF_LEVEL), known(record, f"measured_{name}", OF_LEVEL))
        for name in names
    ]
    for member in everyone(record):
        place = member.scheme, member.case
        for i, level in enumerate(levels):
            if not math.isfinite(theory[(*place, i)]):
                continue
            who = [member.scheme_name, *([member.case_name] if swept(record) else [])]
            p = float(product[member.case, i])
            step = math.ulp(1.0) * ROUNDINGS * 2.0 * math.pi / p if p > 0.0 else 0.0
            rate = abs(float(rates[(*place, i)]))
            sizes = {"frequency": rate, "phase_error": 2.0 * math.pi / rate if rate > 0.0 else 1.0}
            numbers: list[Cell] = []
            for name, (told, seen) in zip(names, pairs, strict=True):
                a, b = float(told[(*place, i)]), float(seen[(*place, i)])
                size = sizes.get(name, max(abs(a), 1.0) if math.isfinite(a) else 1.0)
                numbers += _beside(name, a, b, step * size)
            yield (*who, level, p, is_stable(p, float(limit[place])), *numbers)


def is_stable(p: float, limit: float) -> str:
    """Say in a word whether ``w dt = p`` is within the limit of stability."""
    if math.isnan(limit) or math.isnan(p):
        return "–"
    if limit == 0.0:
        return "never"
    if abs(p - limit) <= EDGE * p:
        return "at the limit"
    return "yes" if p < limit else "no"


def omega_dt(record: Record) -> Floats:
    """Return w dt of every member and level, shape (case, level); NaN where the record does not have it."""
    if "omega_dt" not in record:
        return np.full((len(record["case"]), len(record["level"])), np.nan)
    variable = record.variable("omega_dt")
    values = np.asarray(variable.values, dtype=np.float64)
    values = values if "case" in variable.dims else values[None, :]
    return np.broadcast_to(values, (len(record["case"]), len(record["level"])))
