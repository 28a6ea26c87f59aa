"""The picture of stability, energy and equality where no series are kept: the number that decides, of all members."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibsim.checks.fields import name_of
from vibsim.core.record import Record
from vibsim.core.vocabulary import DECISIVE
from vibsim.report import style, sweep_layout
from vibsim.report.data import Floats, Member, pick, unit
from vibsim.report.evidence import frame
from vibsim.report.evidence.frame import ALIKE, COLOUR, SECOND, GrowthScale, Picture, usable
from vibsim.report.text import words

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ConservesCheck, EqualCheck, StableCheck

MANY = 60
"""Up to so many members each has a dot; of more the range is drawn."""
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
        return Picture(f"{member.title}: {ALONE}")
    other_field, words_on_it = BESIDE[check.kind]
    values, beside = (
        np.asarray(pick(record, name_of(name, field), scheme=member.scheme), np.float64)
        if field
        else np.full(count, np.nan)
        for field in (DECISIVE[check.kind], other_field)
    )
    if not usable(values).size:
        return Picture(f"{member.title}: no member has a number that could be drawn.")
    up = _scale(record, check, usable(values))
    # members that differ by rounding are alike on the scale
    around = (
        ALIKE
        if check.kind == "stable"
        else np.median(usable(values)) * 10.0 ** np.array([-0.5, 0.5])
    )
    keys = sweep_layout.keys(record)
    key = keys[0] if len(keys) == 1 and not keys[0].words else None
    x = key.values if key else np.arange(count, dtype=np.float64)
    figure = style.canvas(1.0)
    ax = frame.panel(figure, up.title, key.label if key else "number of the member", frame.WIDE)
    if key and key.is_log:
        style.log_axis(ax, "x", *style.log_limits(x, margin=0.02))
    else:
        ax.set_xlim(*style.limits(x, margin=0.02))
    shown, other = values - up.less, beside - up.less
    frame.scale(ax, shown, other, around - up.less, is_log=up.is_log, margin=0.1)
    order = np.argsort(x, kind="stable")
    ax.plot(*style.thin(x[order], other[order], 160), color=SECOND, linewidth=0.9)
    if count > MANY:
        ax.plot(*style.thin(x[order], shown[order], 160), color=COLOUR, linewidth=0.8)
    else:
        frame.points(ax, x.tolist(), shown, [False] * count)
    frame.points(ax, [x[member.case]], shown[[member.case]], [True])
    more = f"; {words_on_it}" if usable(beside).size else ""
    caption = (
        f"{member.scheme_name}, all {words.number(count, 'integer')} members, of which no series are kept: filled is "
        f"the one that decides, {member.case_name}{more}."
    )
    return Picture(caption, up.title, figure)


def _scale(
    record: Record, check: StableCheck | ConservesCheck | EqualCheck, values: Floats
) -> GrowthScale:
    """Return the vertical scale."""
    if check.kind == "stable":
        return frame.growth_scale(values)
    if check.kind == "conserves":
        return GrowthScale("largest energy error / E(0)", is_log=True)
    measure = unit(record, f"{check.quantity}_difference_norm")
    title = style.label(f"largest difference of {words.symbol(check.quantity)}", measure)
    return GrowthScale(title, is_log=True)
