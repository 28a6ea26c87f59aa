"""Tables of theory beside measurement for every scheme.

Source: vibration text, sections 4.1 to 4.6 (frequency and growth on ``u'' + w^2 u = 0``), 5.6, 6.2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import MEMBER, OF_LEVEL, PEAKS
from vibsim.report import words
from vibsim.report.data import Member, Results
from vibsim.report.tables.levels import Fill, by_level
from vibsim.report.tables.table import Cell, Column, Table, Written

LIMITS = {0.0: "never", math.inf: "any"}  # words for special limits of stability
EDGE = 1e-9  # relative distance within which a step is at the limit of stability
ROUNDINGS = 32.0  # rounding errors per step within which a prediction and a measurement agree


def predicted(record: Results) -> bool:
    """Return whether the record has predictions of theory, as for linear models."""
    return bool(np.isfinite(record.optional("theory_growth", OF_LEVEL)).any())


def schemes(record: Results) -> Table | None:
    """Return one row per scheme with its stated properties and measured orders; None for a single scheme."""
    names = record.schemes
    if len(names) < 2:
        return None
    quantities = [record.model.position]
    if record.model.conservative and "energy_deviation_order" in record:
        quantities.append("energy_deviation")
    columns = [
        Column("scheme"), Column("family"), Column("type"),
        Column("force evaluations per step", form="integer"), Column("stable up to w dt", form="step"),
    ]  # fmt: skip
    for quantity in quantities:
        letter = words.symbol(quantity)
        columns.append(Column(f"order of {letter}, stated", form="step"))
        if record.triples:
            columns.append(Column("measured (95 % interval)", form="order"))
    rows = tuple(tuple(_scheme(record, s, quantities)) for s in range(len(names)))
    is_measured = bool(record.triples)
    caption = (
        "Schemes: stated properties (explicit or implicit, s: symplectic)"
        + f", and the order measured in the {words.USUAL_NORM}" * is_measured
        + " (order ∞: exact, no error to shrink)"
        + "; in a sweep, that of the member farthest from the stated order"
        * (is_measured and bool(record.swept))
    )
    return Table("schemes", caption, tuple(columns), rows)


def _scheme(record: Results, s: int, quantities: list[str]) -> Iterator[Cell]:
    spec, scheme = record.experiment.schemes[s], record.experiment.schemes[s].method
    kinds = ["adaptive" if scheme.adaptive else "explicit" if scheme.explicit else "implicit"]
    kinds += ["s"] if scheme.symplectic else []
    name = spec.name if spec.name.startswith(spec.kind) else f"{spec.name} ({spec.kind})"
    yield from (name, scheme.family, ", ".join(kinds))
    yield None if scheme.adaptive else scheme.evaluations
    limit = _common(record.optional("stability_limit", MEMBER)[s])
    if isinstance(limit, float):
        limit = Written(limit, LIMITS.get(limit, words.number(limit, "step")))
    yield limit
    for quantity in quantities:
        formal = record.formal_orders(quantity)[s]
        value, low, high = (part[s] for part in record.stated_orders(quantity))
        with np.errstate(invalid="ignore"):
            away = np.abs(value - formal)
        case = int(np.argmax(np.where(np.isfinite(away), away, -1.0)))
        yield _common(formal)
        if record.triples:
            order, *ends = (float(part[case]) for part in (value, low, high))
            yield Written(order, words.with_interval(order, ends))


def _common(values: Floats) -> Cell:
    """Return the number that all members share, or ``varies``; None if no member has one."""
    distinct = np.unique(values[~np.isnan(values)])
    if distinct.size > 1:
        return "varies"
    return float(distinct[0]) if distinct.size else None


def predictions(record: Results) -> list[Table]:
    """Return the predicted and measured growth, and frequency and phase error, of every scheme, member and level."""
    if not predicted(record):
        return []
    time = record.time_unit
    rate = record.unit("theory_frequency") or f"rad/{time}"
    by_peaks = record.variable("measured_growth").attrs.get("method") == PEAKS
    method = (
        "The measured numbers come from peaks interpolated by a parabola, which adds an error on coarse levels"
        if by_peaks
        else "The measured numbers are those of the recurrence that the computed steps satisfy"
    )
    growth = "growth of the amplitude per natural period, predicted by the matrix of one step"
    phase = "frequency, and the time by which the peaks come early (+) or late (−) in each period"
    alone = {"growth": ("growth per period − 1", "")}
    both = {"frequency": ("frequency", rate), "phase_error": ("phase error", time)}
    return [
        _predictions(record, "growth", f"{growth}. {method}", alone),
        _predictions(record, "phase", f"{phase}. {method}", both),
    ]


def _predictions(
    record: Results, stem: str, caption: str, shown: dict[str, tuple[str, str]]
) -> Table:
    p, limit = record.omega_dt, record.optional("stability_limit", MEMBER)
    rate = np.abs(record.optional("theory_frequency", OF_LEVEL))
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.where(p > 0.0, math.ulp(1.0) * ROUNDINGS * 2.0 * math.pi / p, 0.0)
        sizes = {"frequency": rate, "phase_error": np.where(rate > 0.0, 2.0 * math.pi / rate, 1.0)}

    def stable(member: Member, i: int) -> Cell:
        return is_stable(float(p[member.case, i]), float(limit[member.scheme, member.case]))

    filled: list[tuple[Column, Fill]] = [
        (Column("w dt", form="step"), lambda member, i: float(p[member.case, i])),
        (Column("stable"), stable),
    ]
    for kind, (text, measure) in shown.items():
        from_theory, measured = (
            record.optional(f"{origin}_{kind}", OF_LEVEL) for origin in ("theory", "measured")
        )
        noise = step * sizes.get(kind, np.fmax(np.abs(from_theory), 1.0))
        less = float(kind == "growth")
        filled += [
            (Column(f"{text}: predicted", measure, "close"), _cells(from_theory - less, noise)),
            (Column("measured", measure, "close"), _cells(measured - less, noise)),
            (
                Column("difference", measure, "brief"),
                _cells(measured - from_theory, noise, hide=True),
            ),
        ]
    caption = f"Theory beside measurement: {caption}"
    included, name = np.isfinite(record.optional("theory_growth", OF_LEVEL)), f"theory_{stem}"
    table = by_level(record, name, caption, record.all_members, filled, included=included)
    short = table.without_empty(["difference"])
    agree = ". Where no difference is shown, the two agree to round-off"
    return short if short.columns == table.columns else replace(short, caption=caption + agree)


def _cells(values: Floats, noise: Floats, *, hide: bool = False) -> Fill:
    """Return a function that fills a column with numbers; those within the noise have two digits, or none (`hide`)."""

    def cell(member: Member, i: int) -> Cell:
        place = member.scheme, member.case, i
        value = float(values[place])
        if not abs(value) <= noise[place]:
            return value
        return None if hide else Written(value, words.number(value, "brief"))

    return cell


def is_stable(p: float, limit: float) -> str:
    """Say in a word whether ``w dt = p`` is below the limit of stability."""
    if math.isnan(limit) or math.isnan(p):
        return "–"
    if limit == 0.0:
        return "never"
    if abs(p - limit) <= EDGE * p:
        return "at the limit"
    return "yes" if p < limit else "no"
