"""The picture of a number by level: beside its border, or how far it is from the number that it should equal.

One that is extrapolated over the levels stands to the right of them, with the bound of its error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vibsim.checks.fields import name_of
from vibsim.checks.value import criteria
from vibsim.checks.value.by_level import own_levels
from vibsim.checks.value.units import unit_of
from vibsim.checks.words.value import what
from vibsim.core.record import Record
from vibsim.report import style
from vibsim.report.data import Floats, Member, at, norm_unit, pick, pretty_unit, unit, whole
from vibsim.report.evidence.frame import (
    COLOUR,
    Picture,
    Ticks,
    level_ticks,
    log_ticks,
    logarithms,
    measured,
    of_levels,
    ticks,
)
from vibsim.report.evidence.svg_plot import BAND, Panel, document
from vibsim.report.text import words

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import ValueCheck

WIDE = 30.0
"""Positive numbers of which the largest is more than so many times the least have a logarithmic scale."""
NOWHERE = -400.0
"""The logarithm that stands for a distance of 0: below every frame."""
OF_LEVEL = ("scheme", "case", "level")


def picture(
    experiment: Experiment, record: Record, check: ValueCheck, name: str, member: Member
) -> Picture | None:
    """Draw a number by level, or how far it is from the one that it should equal; None where no level has one."""
    found = _values(experiment, record, check, name, member)
    if found is None or not np.isfinite(found[0]).any():
        return None
    values, measure = found
    row = _row(record, check, name, member, style.label(_spoken(check), measure), values)
    if not np.isfinite(row.values[row.counts]).any():
        return None
    if check.equals is None:
        return _beside_border(row, check)
    # what a coarser level has to give is no limit that the others approach
    is_limit = row.counts[-1] or check.at.level is None
    drawn = _distance(row, check.equals, check.allowed) if is_limit else None
    return drawn or _within(row, check.equals, check.allowed)


def _spoken(check: ValueCheck) -> str:
    """Return the name of a number as a title has it."""
    told = what(check, words.PAGE)
    if check.value in criteria.SAMPLED or (check.at.t is None and check.at.step is None):
        return told
    return f"{told} up to {f't = {check.at.t:g}' if check.at.t is not None else f'step {check.at.step}'}"


def _values(
    experiment: Experiment, record: Record, check: ValueCheck, name: str, member: Member
) -> tuple[Floats, str] | None:
    """Return a number on every level with its unit; None where the record does not have it."""
    if (field := name_of(name, "value_by_level")) in record:
        found = np.asarray(
            pick(record, field, scheme=member.scheme, case=member.case), dtype=np.float64
        )
        return found, pretty_unit(unit_of(experiment, record, check)).replace("sqrt(s)", "√s")
    if check.at.t is not None or check.at.step is not None:
        return None
    kept = f"{check.quantity}_{check.value}" if check.quantity else check.value
    if kept in record and record.variable(kept).dims == OF_LEVEL:
        return at(record, kept, member), unit(record, kept)
    norm, errors = check.value.removeprefix("error_"), f"{check.quantity}_error_norm"
    if norm == check.value or errors not in record or norm not in record.words("norm"):
        return None
    index = record.words("norm").index(norm)
    return at(record, errors, member, norm=index), norm_unit(record, str(check.quantity), norm)


@dataclass(frozen=True)
class ByLevel:
    """A number on every level, and behind them perhaps the one that is extrapolated."""

    name: str
    levels: list[int]
    values: Floats
    counts: list[bool]
    """Whether it is the one that is asked for."""
    scheme: str
    bound: float = math.nan
    """Of the error of the extrapolated number; NaN where there is none."""

    @property
    def places(self) -> list[float]:
        """Where the numbers stand: at their levels, the extrapolated one behind the last."""
        return [*map(float, self.levels), self.levels[-1] + 1.0][: len(self.values)]

    def panel(self, low: float, high: float) -> Panel:
        """Return an empty panel for values in a range."""
        extra = [self.levels[-1] + 1] if len(self.values) > len(self.levels) else []
        return of_levels([*self.levels, *extra], low, high)

    def draw(self, panel: Panel, shown: Floats, ends: tuple[float, float]) -> None:
        """Draw the numbers as they are `shown`, and the error bar of the extrapolated one from end to end."""
        if all(map(math.isfinite, ends)):
            low, high = (min(max(end, panel.y[0]), panel.y[1]) for end in ends)
            panel.curve(np.full(2, self.places[-1]), np.array([low, high]), COLOUR, 1.6)
        panel.points(self.places, shown, self.counts, COLOUR)

    def finish(self, panel: Panel, title: str, scale: Ticks, told: str) -> Picture:
        """Return the picture of a panel."""
        across = level_ticks(self.levels)
        if len(self.values) > len(self.levels):
            across = [*across, (self.places[-1], "best")]
        panel.frame(title, "level", across, scale)
        one = len(self.levels) == 1 and len(self.values) == 1
        head = f"{self.scheme}, level {self.levels[0]}" if one else f"{self.scheme}, level by level"
        bar = "; the bar is the bound of its error" if math.isfinite(self.bound) else ""
        caption = f"{head}: filled the one that is asked for{bar}; grey is {told}."
        return Picture(document([panel], title), caption)


def _row(
    record: Record, check: ValueCheck, name: str, member: Member, title: str, values: Floats
) -> ByLevel:
    """Return the numbers of the levels, and behind them the extrapolated one where that is asked for."""
    levels = whole(record, "level")
    if check.at.level != "best":
        own = own_levels(check.value, levels) or levels
        level = own[-1] if check.at.level is None else check.at.level
        return ByLevel(title, levels, values, [one == level for one in levels], member.title)
    place = member.scheme, member.case
    best, bound = (measured(record, name, field, *place) for field in ("value", "error_bound"))
    counts = [False] * len(levels) + [True]
    return ByLevel(title, levels, np.append(values, best), counts, member.title, bound)


def _beside_border(row: ByLevel, check: ValueCheck) -> Picture | None:
    """Draw a number by level beside the one that it must be below or above."""
    below = check.below is not None
    border = check.below if check.below is not None else check.above
    if border is None:
        return None
    is_log = _is_wide(np.append(row.values, border))
    ends = row.values[-1] + np.array([-row.bound, row.bound])
    values = row.values
    if is_log:
        values, ends = logarithms(values), np.where(ends > 0.0, logarithms(ends), NOWHERE)
    border = math.log10(border) if is_log else border
    low, high = style.limits(values, ends[ends > NOWHERE], np.array([border]), margin=0.15)
    panel = row.panel(low, high)
    panel.band(*((low, border) if below else (border, high)), *panel.x, BAND)
    panel.level(border)
    row.draw(panel, values, (float(ends[0]), float(ends[1])))
    scale = log_ticks(low, high) if is_log else ticks(low, high)
    return row.finish(panel, row.name, scale, "where it should lie")


def _is_wide(values: Floats) -> bool:
    """Say whether numbers need a logarithmic scale."""
    known = values[np.isfinite(values)]
    return bool(known.size and known.min() > 0.0 and known.max() > WIDE * known.min())


def _distance(row: ByLevel, wanted: float, allowed: float) -> Picture | None:
    """Draw how far a number is from what it should be, on a logarithmic scale; None where nothing is allowed."""
    away = np.abs(row.values - wanted)
    known = away[np.isfinite(away) & (away > 0.0)]
    if not known.size or allowed <= 0.0:
        return None
    with np.errstate(divide="ignore"):
        logs = np.where(away > 0.0, np.log10(away), NOWHERE)
        ends = np.log10(np.maximum(away[-1] + np.array([-row.bound, row.bound]), 0.0))
    border = math.log10(allowed)
    around = np.array([border, ends[1] if math.isfinite(ends[1]) else border])
    low, high = style.limits(np.log10(known), around, margin=0.15)
    panel = row.panel(min(low, high - 1.0), high)
    panel.band(panel.y[0], border, *panel.x, BAND)
    panel.level(border)
    row.draw(panel, logs, (max(float(ends[0]), NOWHERE), float(ends[1])))
    title = f"distance of {row.name} from {words.number(wanted, 'step')}"
    told = "what the tolerance allows"
    if np.any(away == 0.0):
        told += "; a triangle at the lower edge has no distance at all"
    return row.finish(panel, title, log_ticks(*panel.y), told)


def _within(row: ByLevel, wanted: float, allowed: float) -> Picture:
    """Draw a number by level beside the one that it should equal."""
    around = wanted + np.array([-allowed, allowed])
    low, high = style.limits(row.values, around, margin=0.15)
    panel = row.panel(low, high)
    panel.band(wanted - allowed, wanted + allowed, *panel.x, BAND)
    panel.level(wanted)
    ends = row.values[-1] + np.array([-row.bound, row.bound])
    row.draw(panel, row.values, (float(ends[0]), float(ends[1])))
    told = f"what the tolerance allows around {words.number(wanted, 'step')} (dashed)"
    return row.finish(panel, row.name, ticks(low, high), told)
