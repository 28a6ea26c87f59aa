"""The picture of stability: w dt beside the limit of the scheme, the size of the solution, and its growth, by level.

The rules are those of `vibsim.checks.stable`: unstable is w dt beyond the limit, or a solution that has
grown beyond `BLOWN_UP` times the exact one without the next finer level halving that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vibsim.checks.stable import LIMIT_ROUNDING
from vibsim.convergence.thresholds import BLOWN_UP
from vibsim.core.record import Record
from vibsim.core.vocabulary import HIGHEST
from vibsim.report import style
from vibsim.report.choice import position
from vibsim.report.data import Floats, Member, at, known, whole
from vibsim.report.evidence import frame
from vibsim.report.evidence.frame import ALIKE, SECOND, Picture, measured, short, usable
from vibsim.report.text import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vibsim.experiment import Experiment

WIDTH = 1.56
"""Of a panel [inch]."""
MOST_LEVELS = 8
NEAR_LIMIT = 0.02
"""A step so near to the limit, as a part of it, is told with its distance."""
NO_LIMIT = {
    0.0: "The scheme grows at every step, so that w dt has no limit to be compared with. ",
    math.inf: "The scheme has no limit of w dt. ",
}
SIDES = {1: ("Here",), 2: ("Left", "Right"), 3: ("Left", "Middle", "Right")}


@dataclass(frozen=True)
class _Levels:
    """The levels, and the one that is judged."""

    every: list[int]
    judged: int
    figure: Figure

    @property
    def index(self) -> int:
        """Position of the one that is judged."""
        return self.every.index(self.judged)

    def panel(self, title: str) -> Axes:
        """Return a new panel over the levels."""
        ax = frame.panel(self.figure, title, "level", WIDTH)
        frame.level_axis(ax, self.every, MOST_LEVELS)
        return ax

    def points(self, ax: Axes, values: Floats) -> None:
        """Draw a number of every level."""
        frame.points(ax, self.every, values, [level == self.judged for level in self.every])


def picture(experiment: Experiment, record: Record, name: str, member: Member) -> Picture | None:
    """Draw what decides whether a run is stable, on every level."""
    level = int(measured(record, name, "level", member.scheme, member.case))
    levels = _Levels(whole(record, "level"), level, style.canvas(1.0))
    letter = words.symbol(position(experiment))
    found = [
        _steps(record, levels, member),
        _sizes(record, levels, member, letter),
        _growths(record, levels, member, name),
    ]
    told = [text for text in found if text is not None]
    if not told:
        return None
    sides = " ".join(f"{s}: {text}" for s, text in zip(SIDES[len(told)], told, strict=True))
    _, limit = _step_and_limit(record, levels, member)
    head = f"{member.title}, level by level; filled is level {level}, which is judged."
    caption = f"{head} {NO_LIMIT.get(limit, '')}{sides}"
    return Picture(caption, f"Stability of {member.title}", levels.figure)


def _steps(record: Record, levels: _Levels, member: Member) -> str | None:
    """Draw w dt beside the limit; None for a scheme without one, or one that grows at every step."""
    p = at(record, _step_name(record), member)
    limit = float(at(record, "stability_limit", member))
    if not 0.0 < limit < math.inf or not usable(p).size:
        return None
    ax = levels.panel("w dt, and its limit (dashed)")
    frame.scale(ax, p, limit * np.array([0.5, 2.0]), is_log=True, margin=0.08)
    _draw_limit(ax, limit)
    levels.points(ax, p)
    return f"{_place(float(p[levels.index]), limit)}; grey is stable."


def _draw_limit(ax: Axes, limit: float) -> None:
    """Draw the limit that a number must stay below."""
    frame.allowed(ax, 0.0, limit)
    ax.axhline(limit, **frame.DASHED)


def _place(p: float, limit: float) -> str:
    """Say where w dt lies beside the limit."""
    text, away = f"w dt = {words.number(p, 'step')} is", abs(p / limit - 1.0)
    border = f"the limit {words.number(limit, 'step')}"
    if away <= LIMIT_ROUNDING:
        return f"{text} at {border}, where a solution may stay as it is or grow in proportion to the time"
    by = f" by {words.number(away, 'brief')} of it" if away < NEAR_LIMIT else ""
    return f"{text} {'beyond' if p > limit else 'below'} {border}{by}"


def _sizes(record: Record, levels: _Levels, member: Member, letter: str) -> str | None:
    """Draw how large the solution gets, over the exact one."""
    size = known(record, "size_over_exact", ("level",), scheme=member.scheme, case=member.case)
    if not usable(size).size:
        return None
    ax = levels.panel(f"largest |{letter}| / exact")
    frame.scale(ax, size, np.array([1.0, BLOWN_UP]), is_log=True, margin=0.12)
    _draw_limit(ax, BLOWN_UP)
    levels.points(ax, size)
    p, limit = _step_and_limit(record, levels, member)
    return _size_told(levels, size, abs(p / (limit or math.inf) - 1.0) <= LIMIT_ROUNDING)


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


def _growths(record: Record, levels: _Levels, member: Member, name: str) -> str | None:
    """Draw the growth factor per period, measured and predicted."""
    seen = np.array(at(record, "measured_growth", member))
    told = np.array(at(record, "theory_growth", member))
    is_near = not math.isfinite(told[levels.index])
    for values, field in ((seen, "growth"), (told, "predicted_growth")):
        if not math.isfinite(values[levels.index]):
            values[levels.index] = measured(record, name, field, member.scheme, member.case)
    both = usable(np.concatenate([seen, told]))
    if not both.size:
        return None
    scale = frame.growth_scale(both)
    ax = levels.panel(scale.title)
    frame.scale(ax, both - scale.less, ALIKE - scale.less, is_log=scale.is_log)
    ax.axhline(1.0 - scale.less, **frame.DASHED)
    ends = np.array(levels.every) + np.array([[-0.35], [0.35]])
    ax.plot(ends, np.stack([told - scale.less] * 2), color=SECOND, linewidth=1.8, zorder=3)
    levels.points(ax, seen - scale.less)
    return _told(float(seen[levels.index]), float(told[levels.index]), is_near)


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
