"""The picture of a verdict: of the decisive result, which the sentence beside it names.

Each kind of check has its own module. If no series over time are stored, pictures of energy, equality and stability
show the decisive numbers of all members instead.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import DECISIVE
from vibsim.report import style, sweep_layout, words
from vibsim.report.choice import CheckedLadder
from vibsim.report.evidence import energy, equal, frame, order, stable, value
from vibsim.report.evidence.frame import GrowthScale, evidence, usable
from vibsim.report.style import Picture
from vibsim.report.types import ConservesCheck, EqualCheck, StableCheck

MANY = 60  # members up to which each has a dot; more are a line
ALONE = (
    "a run of so many samples keeps no time series, so nothing is drawn. The number alone decides."
)
BESIDE = {
    "stable": ("predicted_growth", "; orange is the prediction for small oscillations"),
    "equal": ("allowed", "; orange is the allowed distance"),
}
"""Kind of a check to the field that is drawn beside the decisive one, and the words for it."""


def picture(checked: CheckedLadder) -> Picture | None:
    """Return the picture of the decisive result of a check; None if there is nothing to draw."""
    record, asserted = checked.record, checked.asserted
    if asserted is None:
        return None
    draw = DRAWN[checked.kind]
    if record.is_lean and draw in (energy.picture, equal.picture, stable.picture):
        draw = _of_members
    with style.applied():
        drawn = draw(checked, asserted.measured)
    return drawn and replace(drawn, name=f"evidence_{asserted.id}")


def _of_members(
    checked: CheckedLadder, check: StableCheck | ConservesCheck | EqualCheck
) -> Picture:
    """Draw the decisive number of all members against the swept value, or against the number of the member."""
    record, member, count = checked.record, checked.member, checked.record.count
    if count == 1:
        return evidence(f"{member.title}: {ALONE}")

    def numbers(field: str) -> Floats:
        return np.asarray(record.pick(checked.variable(field), scheme=member.scheme), np.float64)

    other_field, remark = BESIDE.get(check.kind, ("", ""))
    values = numbers(DECISIVE[check.kind])
    beside = numbers(other_field) if other_field else np.full(count, np.nan)
    finite = usable(values)
    if not finite.size:
        return evidence(f"{member.title}: no member has a number to draw.")
    # on this range members that differ by rounding look alike
    around = np.median(finite) * 10.0 ** np.array([-0.5, 0.5])
    if check.kind == "stable":
        scale, around = frame.growth_scale(finite), frame.ALIKE
    elif check.kind == "conserves":
        scale = GrowthScale("largest energy error / E(0)", is_log=True)
    else:
        units = record.unit(f"{check.quantity}_difference_norm")
        text = f"largest difference of {words.symbol(check.quantity)}"
        scale = GrowthScale(style.label(text, units), is_log=True)
    keys = sweep_layout.keys(record)
    key = keys[0] if len(keys) == 1 and not keys[0].words else None
    x = key.values if key else np.arange(count, dtype=np.float64)
    figure = style.canvas(1.0)
    ax = frame.panel(figure, scale.title, key.label if key else "number of the member", frame.WIDE)
    if key and key.is_log:
        style.log_axis(ax, "x", *style.log_limits(x, margin=0.02))
    else:
        ax.set_xlim(*style.limits(x, margin=0.02))
    shown, shown_beside = values - scale.less, beside - scale.less
    frame.scale(ax, shown, shown_beside, around - scale.less, is_log=scale.is_log, margin=0.1)
    order = np.argsort(x, kind="stable")
    ax.plot(*style.thin(x[order], shown_beside[order], 160), color=frame.SECOND, linewidth=0.9)
    if count > MANY:
        ax.plot(*style.thin(x[order], shown[order], 160), color=frame.COLOUR, linewidth=0.8)
    else:
        frame.points(ax, x.tolist(), shown, [False] * count)
    frame.points(ax, [x[member.case]], shown[[member.case]], [True])
    caption = (
        f"{member.scheme_name}, all {words.number(count, 'integer')} members (no time series are kept). The one "
        f"that decides, {member.case_words}, is filled{remark if usable(beside).size else ''}."
    )
    return evidence(caption, scale.title, figure)


DRAWN: Mapping[str, Callable[..., Picture | None]] = {
    "accurate": value.of_error,
    "conserves": energy.picture,
    "converges": order.picture,
    "equal": equal.picture,
    "stable": stable.picture,
    "value": value.picture,
}
"""Kind of a check to its drawing, a function of the ladder with the check, and of what it measures."""
