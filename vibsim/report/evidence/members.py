"""The picture of stability, energy and equality where no series are kept: the number that decides, of all members."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from vibsim.checks.fields import name_of
from vibsim.core.record import Record
from vibsim.core.vocabulary import DECISIVE
from vibsim.report import style
from vibsim.report.data import Floats, Member, pick, swept, swept_label, unit
from vibsim.report.evidence.frame import (
    ALIKE,
    COLOUR,
    SECOND,
    Picture,
    Scale,
    Ticks,
    growth_scale,
    log_ticks,
    logarithms,
    ticks,
)
from vibsim.report.evidence.svg_plot import Panel, document
from vibsim.report.text import words

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ConservesCheck, EqualCheck, StableCheck

MANY = 60
"""Up to so many members each has a dot; of more the range is drawn."""
DECADE = 10.0
"""Swept values may have a logarithmic scale where the largest is so many times the least."""
WIDTH = 320.0
ALONE = "a run of so many samples keeps no series over time, so that nothing is drawn: the number alone decides."
BESIDE = {
    "stable": ("predicted_growth", "orange is what theory predicts, for small oscillations"),
    "equal": ("allowed", "orange is what is allowed"),
    "conserves": ("", ""),
}
"""Kind of a check to the field that is drawn beside the one that decides, and the words on it."""


def picture(
    record: Record, check: StableCheck | ConservesCheck | EqualCheck, name: str, member: Member
) -> Picture:
    """Draw the number that decides a check against the swept value, or the number of the member."""
    count = len(record["case"])
    if count == 1:
        return Picture("", f"{member.title}: {ALONE}")
    other, words_on_it = BESIDE[check.kind]
    values, beside = (
        np.asarray(pick(record, name_of(name, field), scheme=member.scheme), np.float64)
        if field
        else np.full(count, np.nan)
        for field in (DECISIVE[check.kind], other)
    )
    if not np.isfinite(logarithms(values)).any():
        return Picture("", f"{member.title}: no member has a number that could be drawn.")
    x, title, scale = _across(record)
    up = _up(record, check, np.concatenate([values, beside]))
    # members that differ by rounding are alike on the scale
    around = up.change(ALIKE) if check.kind == "stable" else _decade(up.change(values))
    panel = _panel(x, up, values, beside, member.case, around)
    panel.frame(up.title, title, scale, up.ticks(*panel.y))
    more = f"; {words_on_it}" if np.isfinite(up.change(beside)).any() else ""
    return Picture(
        document([panel], up.title),
        f"{member.scheme_name}, all {words.number(count, 'integer')} members, of which no series are kept: filled is "
        f"the one that decides, {member.case_name}{more}.",
    )


def _up(record: Record, check: StableCheck | ConservesCheck | EqualCheck, values: Floats) -> Scale:
    """Return the vertical scale."""
    if check.kind == "stable":
        return growth_scale(values[np.isfinite(logarithms(values))])
    if check.kind == "conserves":
        return Scale("largest energy error / E(0)", logarithms, log_ticks)
    measure = unit(record, f"{check.quantity}_difference_norm")
    title = style.label(f"largest difference of {words.symbol(check.quantity)}", measure)
    return Scale(title, logarithms, log_ticks)


def _across(record: Record) -> tuple[Floats, str, Ticks]:
    """Return the place of every member, the name of the axis, and its ticks."""
    names = swept(record)
    numbers = len(names) == 1 and record[names[0]].dtype.kind in "iuf"
    if not numbers:
        x = np.arange(len(record["case"]), dtype=np.float64)
        return x, "number of the member", ticks(0.0, float(x[-1]), 5)
    x = np.asarray(record[names[0]], dtype=np.float64)
    title = style.label(*swept_label(record, names[0]))
    low, high = float(x.min()), float(x.max())
    if low > 0.0 and high > DECADE * low and _is_geometric(x):
        x = np.log10(x)
        return x, title, log_ticks(float(x.min()), float(x.max()))
    return x, title, ticks(low, high, 5) if high > low else [(low, words.number(low, "step"))]


def _is_geometric(x: Floats) -> bool:
    """Say whether values lie about evenly on a logarithmic scale rather than on a linear one."""
    middle = math.log(float(np.median(x)))
    of_logs, of_values = float(np.mean(np.log(x))), math.log(float(np.mean(x)))
    return abs(middle - of_logs) < abs(middle - of_values)


def _decade(logs: Floats) -> Floats:
    """Return the ends of a decade around values."""
    return float(np.nanmedian(logs)) + np.array([-0.5, 0.5])


def _panel(
    x: Floats, up: Scale, values: Floats, beside: Floats, case: int, around: Floats
) -> Panel:
    """Return the panel with the numbers of all members, those beside them, and room for more."""
    order = np.argsort(x, kind="stable")
    shown, other = up.change(values), up.change(beside)
    low, high = style.limits(shown, other, around, margin=0.1)
    panel = Panel(style.limits(x, margin=0.02), (low, high), WIDTH)
    half = int(WIDTH) // 2
    panel.curve(*style.thin(x[order], other[order], half), SECOND, 1.2)
    if x.size > MANY:
        panel.curve(*style.thin(x[order], shown[order], half), COLOUR, 1.0)
    else:
        panel.points(x.tolist(), shown, [False] * x.size, COLOUR)
    panel.points([float(x[case])], shown[[case]], [True], COLOUR)
    return panel
