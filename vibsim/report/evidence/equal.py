"""The picture of equality: the difference of two solutions over time, beside the allowed one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibsim.report import style
from vibsim.report.choice import CheckedLadder
from vibsim.report.evidence import frame
from vibsim.report.evidence.frame import brief, evidence, short
from vibsim.report.style import Picture
from vibsim.report.text.assertions import SOLUTIONS
from vibsim.report.types import EqualCheck

DIPS = 10.0  # percentage of smallest differences, near zeros, that do not set the scale


def picture(checked: CheckedLadder, check: EqualCheck) -> Picture | None:
    """Draw the size of the difference of two solutions over time, on a logarithmic scale."""
    record, member, ladder = checked.record, checked.member, checked.of(check.quantity)
    distance = record.at(checked.variable("distance_over_time"), member)
    bound, level, most = checked.numbers("allowed", "level", "distance")
    second = SOLUTIONS.get(check.second, check.second)
    subject = f"{member.title}, level {level:.0f}: its {ladder.letter}"
    if not np.isfinite(distance).any():
        return None
    usable = frame.usable(distance)
    if not usable.size:
        return evidence(f"{subject} and that of {second} are identical bit by bit at every time.")
    title = style.label(f"difference of {ladder.letter}", ladder.unit())
    figure = style.canvas(1.0)
    ax = frame.panel(figure, title, record.time_label, frame.WIDE)
    ax.set_gid(style.TIME)
    t = np.linspace(0.0, record.ends[member.case], distance.size)
    ax.set_xlim(t[0], t[-1])
    typical = usable[usable >= np.percentile(usable, DIPS)]
    frame.scale(ax, typical, np.array([bound, 0.1 * typical.max()]), is_log=True, margin=0.12)
    if 0.0 < bound < math.inf:
        frame.below(ax, bound)
    lowest = ax.get_ylim()[0]  # zeros are drawn at the lower edge
    look: dict[str, Any] = {"color": frame.COLOUR, "linewidth": 0.9, "label": "difference"}
    ax.plot(t, np.where(distance == 0.0, lowest, distance), **look)
    i = int(np.nanargmax(np.where(np.isfinite(distance), distance, np.nan)))
    largest = float(distance[i])
    frame.points(ax, [t[i]], distance[[i]], [True])
    # NaN: the run breaks down
    if math.isnan(most):
        allowance = "; then the run breaks down"
    elif math.isnan(bound):
        allowance = "; the rounding error is not known"
    elif bound == 0.0:
        allowance = "; none is allowed"
    else:
        times = f"{brief(largest / bound)} times the allowed {short(bound)}"
        allowance = f", {times} (dashed; grey is below it)"
    where = f"It is largest at t = {short(float(t[i]))}, with {short(largest)} (dot)"
    return evidence(f"{subject} less that of {second}. {where}{allowance}.", title, figure)
