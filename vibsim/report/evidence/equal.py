"""The picture of equality: the difference of two solutions over time, beside the allowed one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibsim.checks.fields import name_of
from vibsim.report import style
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.evidence import frame
from vibsim.report.evidence.frame import brief, evidence, measured, short
from vibsim.report.style import Picture
from vibsim.report.text.assertions import SOLUTIONS
from vibsim.report.types import EqualCheck

DIPS = 10.0
"""Percentage of smallest differences, near zeros, that do not set the scale."""


def picture(record: Results, check: EqualCheck, name: str, member: Member) -> Picture | None:
    """Draw the size of the difference of two solutions over time, on a logarithmic scale."""
    distance = record.at(name_of(name, "distance_over_time"), member)
    bound, level, most = (
        measured(record, name, field, member) for field in ("allowed", "level", "distance")
    )
    ladder = Ladder(record, check.quantity, member)
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
    # zeros are drawn at the lower edge
    lowest = ax.get_ylim()[0]
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
