"""The picture of equality: how far two solutions are from each other over time, beside what they may be."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibsim.checks.fields import name_of
from vibsim.core.record import Record
from vibsim.report import data, style, words
from vibsim.report.data import Member
from vibsim.report.evidence import frame
from vibsim.report.evidence.frame import brief, evidence, measured, short
from vibsim.report.style import Picture
from vibsim.report.text.assertions import SOLUTIONS
from vibsim.report.types import EqualCheck, Experiment

DIPS = 10.0
"""Percentage of the places whose difference is so small, near a zero, that the scale need not show it."""


def picture(
    _: Experiment, record: Record, check: EqualCheck, name: str, member: Member
) -> Picture | None:
    """Draw the size of the difference of two solutions over time, on a logarithmic scale."""
    distance = data.at(record, name_of(name, "distance_over_time"), member)
    bound, level, most = (
        measured(record, name, field, member) for field in ("allowed", "level", "distance")
    )
    second = SOLUTIONS.get(check.second, check.second)
    who = f"{member.title}, level {level:.0f}: its {words.symbol(check.quantity)}"
    if not np.isfinite(distance).any():
        return None
    usable = frame.usable(distance)
    if not usable.size:
        return evidence(f"{who} and that of {second} are identical bit by bit at every time.")
    measure = data.unit(record, f"{check.quantity}_finest")
    title = style.label(f"difference of {words.symbol(check.quantity)}", measure)
    figure = style.canvas(1.0)
    ax = frame.panel(figure, title, data.time_label(record), frame.WIDE)
    ax.set_gid(style.TIME)
    t = np.linspace(0.0, data.ends_of(record)[member.case], distance.size)
    ax.set_xlim(t[0], t[-1])
    usual = usable[usable >= np.percentile(usable, DIPS)]
    frame.scale(ax, usual, np.array([bound, 0.1 * usual.max()]), is_log=True, margin=0.12)
    if 0.0 < bound < math.inf:
        frame.below(ax, bound)
    # 0 lies below every frame
    lowest = ax.get_ylim()[0]
    look: dict[str, Any] = {"color": frame.COLOUR, "linewidth": 0.9, "label": "difference"}
    ax.plot(t, np.where(distance == 0.0, lowest, distance), **look)
    place = int(np.nanargmax(np.where(np.isfinite(distance), distance, np.nan)))
    largest = float(distance[place])
    frame.points(ax, [t[place]], distance[[place]], [True])
    # a number that is not finite is the largest of all
    if math.isnan(most):
        allowance = "; then the run breaks down"
    elif math.isnan(bound):
        allowance = "; the rounding error is not known"
    elif bound == 0.0:
        allowance = "; none is allowed"
    else:
        times = f"{brief(largest / bound)} times the allowed {short(bound)}"
        allowance = f", {times} (dashed; grey is below it)"
    where = f"It is largest at t = {short(float(t[place]))}, with {short(largest)} (dot)"
    return evidence(f"{who} less that of {second}. {where}{allowance}.", title, figure)
