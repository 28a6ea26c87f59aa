"""The picture of equality: how far two solutions are from each other over time, beside what they may be."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from vibsim.checks.fields import name_of
from vibsim.core.record import Record
from vibsim.report import style
from vibsim.report.data import Floats, Member, ends_of, pick, time_unit, unit
from vibsim.report.evidence.frame import (
    COLOUR,
    Picture,
    brief,
    log_ticks,
    logarithms,
    measured,
    over_time,
    short,
    ticks,
)
from vibsim.report.evidence.svg_plot import BAND, Panel, document
from vibsim.report.text import words

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import EqualCheck

OTHERS = {"exact": "the exact solution", "discrete": "the exact solution of its own steps"}
WIDTH = 320.0
DIPS = 10.0
"""Percentage of the places whose difference is so small, near a zero, that the scale need not show it."""


def picture(
    experiment: Experiment, record: Record, check: EqualCheck, name: str, member: Member
) -> Picture | None:
    """Draw the size of the difference of two solutions over time, on a logarithmic scale."""
    field = name_of(name, "distance_over_time")
    distance = np.asarray(pick(record, field, case=member.case), dtype=np.float64)
    allowed = measured(record, name, "allowed", member.scheme, member.case)
    level = int(measured(record, name, "level", member.scheme, member.case))
    second = OTHERS.get(check.second, check.second)
    who = f"{member.title}, level {level}: its {words.symbol(check.quantity)}"
    if not np.isfinite(distance).any():
        return None
    if not (np.isfinite(distance) & (distance > 0.0)).any():
        return Picture("", f"{who} and that of {second} are the same bit by bit at every time.")
    t = np.linspace(0.0, _end(record, member), distance.size)
    panel, nearest = _panel(t, distance, allowed)
    title = style.label(
        f"difference of {words.symbol(check.quantity)}", unit(record, f"{check.quantity}_finest")
    )
    seconds = style.label("t", time_unit(record))
    panel.frame(title, seconds, ticks(*panel.x, 5), log_ticks(*panel.y))
    most = (
        f"It is largest at t = {short(float(t[nearest]))}, {short(float(distance[nearest]))} (dot)"
    )
    # a number that is not finite is the largest of all
    if math.isnan(measured(record, name, "distance", member.scheme, member.case)):
        told = "; then the run breaks down"
    else:
        told = _allowed(float(distance[nearest]), allowed)
    return Picture(document([panel], title), f"{who} less that of {second}. {most}{told}.")


def _end(record: Record, member: Member) -> float:
    ends = ends_of(record)
    return float(ends[member.case if ends.size > 1 else 0])


def _panel(t: Floats, distance: Floats, allowed: float) -> tuple[Panel, int]:
    """Return the panel, and the place where the difference is largest."""
    logs = logarithms(distance)
    border = math.log10(allowed) if 0.0 < allowed < math.inf else math.nan
    usual = logs[logs >= np.nanpercentile(logs, DIPS)]
    low, high = style.limits(usual, np.array([border]), margin=0.12)
    panel = over_time(t, min(low, high - 1.0), high)
    panel.width = WIDTH
    if math.isfinite(border):
        panel.band(panel.y[0], border, *panel.x, BAND)
        panel.level(border)
    # 0 lies below every frame
    panel.curve(t, np.where(distance == 0.0, panel.y[0], logs), COLOUR, 1.2)
    nearest = int(np.nanargmax(logs))
    panel.points([t[nearest]], logs[[nearest]], [True], COLOUR)
    return panel, nearest


def _allowed(distance: float, allowed: float) -> str:
    """Say what the largest difference may be."""
    if math.isnan(allowed):
        return "; what rounding may make of it is not known"
    if allowed == 0.0:
        return "; none is allowed"
    return f", {brief(distance / allowed)} times the {short(allowed)} that is allowed (dashed; grey is below it)"
