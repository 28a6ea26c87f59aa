"""The picture of stability: w dt beside the limit of the scheme, the size of the solution, and its growth, by level.

The rules are those of `vibsim.checks.growth`: unstable is w dt beyond the limit, or a solution that has
grown beyond `BLOWN_UP` times the exact one without the next finer level halving that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vibsim.checks.growth import LIMIT_ROUNDING
from vibsim.convergence.thresholds import BLOWN_UP
from vibsim.core.record import Record
from vibsim.core.vocabulary import HIGHEST
from vibsim.report import style
from vibsim.report.choice import position
from vibsim.report.data import Floats, Member, at, known, whole
from vibsim.report.evidence.frame import (
    ALIKE,
    COLOUR,
    SECOND,
    Picture,
    Ticks,
    growth_scale,
    level_ticks,
    log_ticks,
    logarithms,
    measured,
    of_levels,
    short,
)
from vibsim.report.evidence.svg_plot import BAND, Panel, document
from vibsim.report.text import words

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

WIDTH = 150.0
MOST_LEVELS = 8
NEAR_LIMIT = 0.02
"""A step so near to the limit, as a part of it, is told with its distance."""
NO_LIMIT = {
    0.0: "The scheme grows at every step, so that w dt has no limit to be compared with. ",
    math.inf: "The scheme has no limit of w dt. ",
}
OCTAVE = math.log10(2.0)
SIDES = {1: ("Here",), 2: ("Left", "Right"), 3: ("Left", "Middle", "Right")}


@dataclass(frozen=True)
class _Levels:
    """The levels, and the one that is judged."""

    every: list[int]
    judged: int

    @property
    def counts(self) -> list[bool]:
        """Which of them is judged."""
        return [level == self.judged for level in self.every]

    @property
    def index(self) -> int:
        """Position of the one that is judged."""
        return self.every.index(self.judged)

    def panel(self, title: str, low: float, high: float, scale: Ticks) -> Panel:
        """Return a panel with its frame."""
        panel = of_levels(self.every, low, high, WIDTH)
        panel.frame(title, "level", level_ticks(self.every, MOST_LEVELS), scale)
        return panel


def picture(experiment: Experiment, record: Record, name: str, member: Member) -> Picture | None:
    """Draw what decides whether a run is stable, on every level."""
    level = int(measured(record, name, "level", member.scheme, member.case))
    levels = _Levels(whole(record, "level"), level)
    letter = words.symbol(position(experiment))
    found = [
        _steps(record, levels, member),
        _sizes(record, levels, member, letter),
        _growths(record, levels, member, name),
    ]
    drawn = [one for one in found if one is not None]
    if not drawn:
        return None
    told = " ".join(
        f"{side}: {text}" for side, (_, text) in zip(SIDES[len(drawn)], drawn, strict=True)
    )
    _, limit = _step_and_limit(record, levels, member)
    head = f"{member.title}, level by level; filled is level {level}, which is judged."
    caption = f"{head} {NO_LIMIT.get(limit, '')}{told}"
    return Picture(document([panel for panel, _ in drawn], f"Stability of {member.title}"), caption)


def _steps(record: Record, levels: _Levels, member: Member) -> tuple[Panel, str] | None:
    """Draw w dt beside the limit; None for a scheme without one, or one that grows at every step."""
    p = at(record, _step_name(record), member)
    limit = float(at(record, "stability_limit", member))
    if not 0.0 < limit < math.inf or not np.isfinite(logarithms(p)).any():
        return None
    logs, border = logarithms(p), math.log10(limit)
    around = np.array([border - OCTAVE, border + OCTAVE])
    low, high = style.limits(logs, around, margin=0.08)
    panel = levels.panel("w dt, and its limit (dashed)", low, high, log_ticks(low, high))
    panel.band(low, border, *panel.x, BAND)
    panel.level(border)
    panel.points(levels.every, logs, levels.counts, COLOUR)
    return panel, f"{_place(float(p[levels.index]), limit)}; grey is stable."


def _place(p: float, limit: float) -> str:
    """Say where w dt lies beside the limit."""
    text, away = f"w dt = {words.number(p, 'step')} is", abs(p / limit - 1.0)
    border = f"the limit {words.number(limit, 'step')}"
    if away <= LIMIT_ROUNDING:
        return f"{text} at {border}, where a solution may stay as it is or grow in proportion to the time"
    by = f" by {words.number(away, 'brief')} of it" if away < NEAR_LIMIT else ""
    return f"{text} {'beyond' if p > limit else 'below'} {border}{by}"


def _sizes(
    record: Record, levels: _Levels, member: Member, letter: str
) -> tuple[Panel, str] | None:
    """Draw how large the solution gets, over the exact one."""
    size = known(record, "size_over_exact", ("level",), scheme=member.scheme, case=member.case)
    if not np.isfinite(logarithms(size)).any():
        return None
    logs, border = logarithms(size), math.log10(BLOWN_UP)
    low, high = style.limits(logs, np.array([0.0, border]), margin=0.12)
    panel = levels.panel(f"largest |{letter}| / exact", low, high, log_ticks(low, high))
    panel.band(low, border, *panel.x, BAND)
    panel.level(border)
    panel.points(levels.every, logs, levels.counts, COLOUR)
    p, limit = _step_and_limit(record, levels, member)
    return panel, _size_told(levels, size, abs(p / (limit or math.inf) - 1.0) <= LIMIT_ROUNDING)


def _step_and_limit(record: Record, levels: _Levels, member: Member) -> tuple[float, float]:
    """Return w dt of the judged level, and the limit of the scheme."""
    p = at(record, _step_name(record), member, level=levels.index)
    return float(p), float(at(record, "stability_limit", member))


def _step_name(record: Record) -> str:
    """Name the variable of w dt that limits a scheme: of several coordinates that of their fastest oscillation."""
    return HIGHEST if HIGHEST in record else "omega_dt"


def _size_told(levels: _Levels, size: Floats, at_limit: bool) -> str:
    """Say whether the solution of the judged level is too large, and what refinement makes of that.

    At the limit it is no question whether that goes away.
    """
    one = float(size[levels.index])
    if not math.isfinite(one):
        return "the run of this level met a number that is too large."
    times = short(one)
    text = f"the solution is at most {'as large as' if times == '1' else f'{times} times'} the exact one"
    border = f"{BLOWN_UP:g} (dashed)"
    if one <= BLOWN_UP:
        return f"{text}; beyond {border} it would have blown up."
    if at_limit:
        return f"{text}, beyond {border}: it has blown up."
    coarse = max(0, min(levels.index, size.size - 2))
    pair = size[coarse : coarse + 2]
    if pair.size == 2 and pair[1] < 0.5 * pair[0]:
        between = f"from level {levels.every[coarse]} to {levels.every[coarse + 1]}"
        return f"{text}, beyond {border}, but that falls to less than half {between}."
    return f"{text}, beyond {border}, and no finer level halves that."


def _growths(
    record: Record, levels: _Levels, member: Member, name: str
) -> tuple[Panel, str] | None:
    """Draw the growth factor per period, measured and predicted."""
    seen = np.array(at(record, "measured_growth", member))
    told = np.array(at(record, "theory_growth", member))
    is_near = not math.isfinite(told[levels.index])
    for values, field in ((seen, "growth"), (told, "predicted_growth")):
        if not math.isfinite(values[levels.index]):
            values[levels.index] = measured(record, name, field, member.scheme, member.case)
    both = np.concatenate([seen, told])
    both = both[np.isfinite(both) & (both > 0.0)]
    if not both.size:
        return None
    scale = growth_scale(both)
    none = scale.change(np.ones(1))
    low, high = style.limits(scale.change(both), scale.change(ALIKE), margin=0.15)
    panel = levels.panel(scale.title, low, high, scale.ticks(low, high))
    panel.level(float(none[0]))
    for level, value in zip(levels.every, scale.change(told), strict=True):
        if math.isfinite(value):
            panel.curve(np.array([level - 0.35, level + 0.35]), np.full(2, value), SECOND, 2.4)
    panel.points(levels.every, scale.change(seen), levels.counts, COLOUR)
    return panel, _told(float(seen[levels.index]), float(told[levels.index]), is_near)


def _told(seen: float, told: float, is_near: bool) -> str:
    """Say what was measured and predicted, the latter perhaps of small oscillations only."""
    how = "predicted for small oscillations" if is_near else "predicted"
    numbers = [
        f"{words.PAGE.factor(value).replace(' - ', ' − ')} {word}"
        for value, word in ((seen, "measured (dot)"), (told, f"{how} (bar)"))
        if math.isfinite(value)
    ]
    if not numbers:
        return "the growth factor per period of the levels that have one."
    return (
        f"the amplitude is multiplied in each period by {', '.join(numbers)}; dashed is no growth."
    )
