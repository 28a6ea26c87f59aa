"""The picture of a number by level: beside its border, or how far it is from the number that it should equal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vibsim.record import Record
from vibsim.report import style, words
from vibsim.report.data import Floats, Member, at, norm_unit, unit, whole
from vibsim.report.exhibit import (
    COLOUR,
    Picture,
    Ticks,
    level_ticks,
    log_ticks,
    logarithms,
    of_levels,
    ticks,
)
from vibsim.report.stamp import BAND, Panel, document

if TYPE_CHECKING:
    from vibsim.spec.checks import ValueCheck

WIDE = 30.0
"""Positive numbers of which the largest is more than so many times the least have a logarithmic scale."""
OF_LEVEL = ("scheme", "case", "level")


def picture(record: Record, check: ValueCheck, member: Member) -> Picture | None:
    """Draw a number by level, or how far it is from the one that it should equal."""
    levels, found = whole(record, "level"), _values(record, check, member)
    elsewhere = check.at.t is not None or check.at.step is not None or check.at.level == "best"
    if found is None or elsewhere or len(levels) < 2:
        return None
    values, measure = found
    level = levels[-1] if check.at.level is None else check.at.level
    spoken = words.spoken(check.value)
    of = f" of {words.symbol(check.quantity)}" if check.quantity else ""
    by_level = ByLevel(
        name=style.label(f"{spoken}{of}", measure),
        levels=levels,
        values=values,
        counts=[one == level for one in levels],
        scheme=member.title,
    )
    if check.equals is None:
        return _beside_border(by_level, check)
    # what a coarser level has to give is no limit that the others approach
    return _distance(by_level, check.equals, check.allowed) if level == levels[-1] else None


def _values(record: Record, check: ValueCheck, member: Member) -> tuple[Floats, str] | None:
    """Return a number on every level with its unit; None where the record does not have it."""
    name = f"{check.quantity}_{check.value}" if check.quantity else check.value
    if name in record and record.variable(name).dims == OF_LEVEL:
        return at(record, name, member), unit(record, name)
    norm, errors = check.value.removeprefix("error_"), f"{check.quantity}_error_norm"
    if norm == check.value or errors not in record or norm not in record.words("norm"):
        return None
    index = record.words("norm").index(norm)
    return at(record, errors, member, norm=index), norm_unit(record, str(check.quantity), norm)


@dataclass(frozen=True)
class ByLevel:
    """A number on every level."""

    name: str
    levels: list[int]
    values: Floats
    counts: list[bool]
    """Whether it is the level that is asked for."""
    scheme: str

    def panel(self, low: float, high: float) -> Panel:
        """Return an empty panel for values in a range."""
        return of_levels(self.levels, low, high)

    def finish(self, panel: Panel, title: str, scale: Ticks, told: str) -> Picture:
        """Return the picture of a panel."""
        panel.frame(title, "level", level_ticks(self.levels), scale)
        caption = (
            f"{self.scheme}, level by level: filled the one that is asked for; grey is {told}."
        )
        return Picture(document([panel], title), caption)


def _beside_border(row: ByLevel, check: ValueCheck) -> Picture | None:
    """Draw a number by level beside the one that it must be below or above."""
    below = check.below is not None
    border = check.below if check.below is not None else check.above
    if border is None or not np.isfinite(row.values).any():
        return None
    is_log = _is_wide(np.append(row.values, border))
    values = logarithms(row.values) if is_log else row.values
    border = math.log10(border) if is_log else border
    low, high = style.limits(values, np.array([border]), margin=0.15)
    panel = row.panel(low, high)
    panel.band(*((low, border) if below else (border, high)), *panel.x, BAND)
    panel.level(border)
    panel.points(row.levels, values, row.counts, COLOUR)
    scale = log_ticks(low, high) if is_log else ticks(low, high)
    return row.finish(panel, row.name, scale, "where it should lie")


def _is_wide(values: Floats) -> bool:
    """Say whether numbers need a logarithmic scale."""
    known = values[np.isfinite(values)]
    return bool(known.size and known.min() > 0.0 and known.max() > WIDE * known.min())


def _distance(row: ByLevel, wanted: float, allowed: float) -> Picture | None:
    """Draw how far a number is from what it should be, on a logarithmic scale."""
    away = np.abs(row.values - wanted)
    known = away[np.isfinite(away) & (away > 0.0)]
    if not known.size or allowed <= 0.0:
        return None
    logs, border = np.log10(np.where(away > 0.0, away, np.nan)), math.log10(allowed)
    low, high = style.limits(np.log10(known), np.array([border]), margin=0.15)
    panel = row.panel(min(low, high - 1.0), high)
    panel.band(panel.y[0], border, *panel.x, BAND)
    panel.level(border)
    panel.points(row.levels, logs, row.counts, COLOUR)
    title = f"distance of {row.name} from {words.number(wanted, 'step')}"
    return row.finish(panel, title, log_ticks(*panel.y), "what the tolerance allows")
