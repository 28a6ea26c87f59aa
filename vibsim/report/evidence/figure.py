"""The picture that shows a verdict, of the result that decides: the one that the sentence beside it names.

Each kind of check has a module of its own. Where no series are kept over time, pictures of energy, equality and
stability show the number that decides of all members instead.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vibsim.checks.fields import name_of
from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import DECISIVE
from vibsim.report import style, sweep_layout, words
from vibsim.report.data import Member, case_position, is_lean, of_case, pick, unit
from vibsim.report.evidence import energy, equal, frame, order, stable, value
from vibsim.report.evidence.frame import GrowthScale, evidence, usable
from vibsim.report.style import Picture
from vibsim.report.types import Check, ConservesCheck, EqualCheck, Experiment, StableCheck

MANY = 60  # up to so many members each has a dot; of more the range is drawn
ALONE = (
    "a run of so many samples keeps no time series, so nothing is drawn. The number alone decides."
)
BESIDE = {
    "stable": ("predicted_growth", "; orange is the prediction for small oscillations"),
    "equal": ("allowed", "; orange is the allowed distance"),
}
"""Kind of a check to the field that is drawn beside the one that decides, and the words on it."""


def picture(
    experiment: Experiment, record: Record, asserted: Check | None, check: Mapping[str, Any]
) -> Picture | None:
    """Return the picture of the result that decides a check; None where there is nothing to draw."""
    results: Sequence[Mapping[str, Any]] = check.get("results") or []
    member = _member(record, results[0]) if results else None
    if asserted is None or member is None:
        return None
    check_of, name = asserted.measured, asserted.id
    draw = DRAWN[check_of.kind]
    if is_lean(record) and draw in (energy.picture, equal.picture, stable.picture):
        draw = _of_members
    with style.applied():
        found = draw(experiment, record, check_of, name, member)
    return found and replace(found, name=f"evidence_{name}")


def _member(record: Record, result: Mapping[str, Any]) -> Member | None:
    case = case_position(record, result.get("case", -1))
    every = [] if case is None else of_case(record, case)
    return next((one for one in every if one.scheme_name == result.get("scheme")), None)


def _of_members(
    _: Experiment, record: Record, check: StableCheck | ConservesCheck | EqualCheck, name: str, member: Member
) -> Picture:  # fmt: skip
    """Draw the number that decides a check against the swept value, or the number of the member."""
    count = len(record["case"])
    if count == 1:
        return evidence(f"{member.title}: {ALONE}")

    def of(field: str) -> Floats:
        return np.asarray(pick(record, name_of(name, field), scheme=member.scheme), np.float64)

    other_field, more = BESIDE.get(check.kind, ("", ""))
    values = of(DECISIVE[check.kind])
    beside = of(other_field) if other_field else np.full(count, np.nan)
    known = usable(values)
    if not known.size:
        return evidence(f"{member.title}: no member has a number to draw.")
    # members that differ by rounding are alike on the scale
    around = np.median(known) * 10.0 ** np.array([-0.5, 0.5])
    if check.kind == "stable":
        up, around = frame.growth_scale(known), frame.ALIKE
    elif check.kind == "conserves":
        up = GrowthScale("largest energy error / E(0)", is_log=True)
    else:
        measure = unit(record, f"{check.quantity}_difference_norm")
        text = f"largest difference of {words.symbol(check.quantity)}"
        up = GrowthScale(style.label(text, measure), is_log=True)
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
    ax.plot(*style.thin(x[order], other[order], 160), color=frame.SECOND, linewidth=0.9)
    if count > MANY:
        ax.plot(*style.thin(x[order], shown[order], 160), color=frame.COLOUR, linewidth=0.8)
    else:
        frame.points(ax, x.tolist(), shown, [False] * count)
    frame.points(ax, [x[member.case]], shown[[member.case]], [True])
    caption = (
        f"{member.scheme_name}, all {words.number(count, 'integer')} members (no time series are kept). The one "
        f"that decides, {member.case_words}, is filled{more if usable(beside).size else ''}."
    )
    return evidence(caption, up.title, figure)


DRAWN: Mapping[str, Callable[..., Picture | None]] = {
    "accurate": value.of_error,
    "conserves": energy.picture,
    "converges": order.picture,
    "equal": equal.picture,
    "stable": stable.picture,
    "value": value.picture,
}
"""What draws each kind of check: of an experiment, its record, the check with its id, and a member."""
