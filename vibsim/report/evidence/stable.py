"""The picture of stability: w dt beside the limit of the scheme, the size of the solution, and its growth, by level.

The rules are those of `vibsim.checks.stable`: a run is unstable if w dt is beyond the limit, or if the solution exceeds
`BLOWN_UP` times the exact one and the next finer level does not halve that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vibsim.convergence.thresholds import BLOWN_UP, LIMIT_ROUNDING
from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import HIGHEST
from vibsim.report import style, words
from vibsim.report.choice import CheckedLadder
from vibsim.report.evidence import frame
from vibsim.report.evidence.frame import brief, evidence, short, usable
from vibsim.report.style import Picture
from vibsim.report.types import Axes, Figure, StableCheck

WIDTH = 1.56  # of a panel [inch]
MOST_LEVELS = 8
NEAR_LIMIT = 0.02  # relative distance from the limit up to which the text states it
NO_LIMIT = {
    0.0: "The scheme grows at every step, so there is no limit to compare w dt with. ",
    math.inf: "The scheme has no limit on w dt. ",
}
SIDES = {1: ("Here",), 2: ("Left", "Right"), 3: ("Left", "Middle", "Right")}


@dataclass(frozen=True)
class _Run:
    """A run on its levels, one of which is judged."""

    levels: list[int]
    index: int  # position of the judged level
    p: Floats  # w dt of every level, of the fastest oscillation
    limit: float
    figure: Figure

    def panel(self, title: str) -> Axes:
        ax = frame.panel(self.figure, title, "level", WIDTH)
        frame.level_axis(ax, self.levels, MOST_LEVELS)
        return ax

    def points(self, ax: Axes, values: Floats) -> None:
        frame.points(ax, self.levels, values, [i == self.index for i in range(len(self.levels))])


def picture(checked: CheckedLadder, _: StableCheck) -> Picture | None:
    """Draw the numbers that decide whether a run is stable, by level."""
    record, member = checked.record, checked.member
    level, levels = int(*checked.numbers("level")), record.levels
    p = record.at(HIGHEST if HIGHEST in record else "omega_dt", member)
    limit = float(record.at("stability_limit", member))
    run = _Run(levels, levels.index(level), p, limit, style.canvas(1.0))
    size = record.optional("size_over_exact", ("level",), scheme=member.scheme, case=member.case)
    letter = words.symbol(record.model.position)
    drawn = [_steps(run), _sizes(run, size, letter), _growths(run, checked)]
    texts = [text for text in drawn if text]
    if not texts:
        return None
    sides = " ".join(f"{s}: {text}" for s, text in zip(SIDES[len(texts)], texts, strict=True))
    head = f"{member.title}, level by level; the judged level {level} is filled."
    caption = f"{head} {NO_LIMIT.get(limit, '')}{sides}"
    return evidence(caption, f"Stability of {member.title}", run.figure)


def _steps(run: _Run) -> str:
    """Draw w dt beside the limit of the scheme; nothing without a limit, or if the scheme is never stable."""
    p, limit = float(run.p[run.index]), run.limit
    if not 0.0 < limit < math.inf or not usable(run.p).size:
        return ""
    text, away = f"w dt = {words.number(p, 'step')} is", abs(p / limit - 1.0)
    if away > LIMIT_ROUNDING and np.all(np.abs(run.p / limit - 1.0) < NEAR_LIMIT):
        # beside the limit itself no distance would be seen
        ax = run.panel("w dt / limit − 1")
        frame.scale(ax, run.p / limit - 1.0, np.array([-away, away]), margin=0.5)
        frame.allowed(ax, -math.inf, 0.0)
        ax.axhline(0.0, **frame.DASHED)
        run.points(ax, run.p / limit - 1.0)
    else:
        ax = run.panel("w dt (limit dashed)")
        frame.scale(ax, run.p, limit * np.array([0.5, 2.0]), is_log=True, margin=0.08)
        frame.below(ax, limit)
        run.points(ax, run.p)
    border = f"the limit {words.number(limit, 'step')}"
    if away <= LIMIT_ROUNDING:
        edge = "where a solution may keep its size or grow linearly with time"
        return f"{text} at {border}, {edge}; grey is stable."
    by = f" by {brief(away)} of it" if away < NEAR_LIMIT else ""
    return f"{text} {'beyond' if p > limit else 'below'} {border}{by}; grey is stable."


def _sizes(run: _Run, size: Floats, letter: str) -> str:
    """Draw the largest size of the solution over the exact one; say whether refinement reduces it.

    Beyond the limit of w dt a size that is still small decides nothing, and is left out.
    """
    is_beyond = run.p[run.index] > run.limit * (1.0 + LIMIT_ROUNDING)
    if not usable(size).size or (is_beyond and size[run.index] <= BLOWN_UP):
        return ""
    ax = run.panel(f"largest |{letter}| / exact")
    frame.scale(ax, size, np.array([1.0, BLOWN_UP]), is_log=True, margin=0.12)
    frame.below(ax, BLOWN_UP)
    run.points(ax, size)
    ratio = float(size[run.index])
    if not math.isfinite(ratio):
        return "the run of this level produced a number that is too large."
    times = short(ratio)
    text = f"the solution is at most {'as large as' if times == '1' else f'{times} times'} the exact one"
    border = f"{BLOWN_UP:g} (dashed)"
    if ratio <= BLOWN_UP:
        return f"{text}; beyond {border} it would have blown up."
    if abs(run.p[run.index] / (run.limit or math.inf) - 1.0) <= LIMIT_ROUNDING:
        # at the limit refinement does not matter
        return f"{text}, beyond {border}: it has blown up."
    coarse = max(0, min(run.index, size.size - 2))
    pair = size[coarse : coarse + 2]
    if pair.size == 2 and pair[1] < 0.5 * pair[0]:
        between = f"from level {run.levels[coarse]} to {run.levels[coarse + 1]}"
        return f"{text}, beyond {border}, but that falls to less than half {between}."
    return f"{text}, beyond {border}, and no finer level halves that."


def _growths(run: _Run, checked: CheckedLadder) -> str:
    """Draw the measured and predicted growth factors per period; a prediction may be for small oscillations only."""
    names = "measured_growth", "theory_growth"
    observed, predicted = (np.array(checked.record.at(name, checked.member)) for name in names)
    is_near = not math.isfinite(predicted[run.index])
    for values, field in ((observed, "growth"), (predicted, "predicted_growth")):
        if not math.isfinite(values[run.index]):
            (values[run.index],) = checked.numbers(field)
    both = usable(np.concatenate([observed, predicted]))
    if not both.size:
        return ""
    scale = frame.growth_scale(both)
    ax = run.panel(scale.title)
    frame.scale(ax, both - scale.less, frame.ALIKE - scale.less, is_log=scale.is_log)
    ax.axhline(1.0 - scale.less, **frame.DASHED)
    ends = np.array(run.levels) + np.array([[-0.35], [0.35]])
    ax.plot(
        ends, np.stack([predicted - scale.less] * 2), color=frame.SECOND, linewidth=1.8, zorder=3
    )
    run.points(ax, observed - scale.less)
    how = "predicted for small oscillations" if is_near else "predicted"
    numbers = [
        f"{words.PAGE.factor(float(values[run.index])).replace(' - ', ' − ')} {word}"
        for values, word in ((observed, "measured (dot)"), (predicted, f"{how} (bar)"))
        if math.isfinite(values[run.index])
    ]
    if not numbers:
        return "the growth factor per period of the levels that have one."
    return f"each period multiplies the amplitude by {', '.join(numbers)}; dashed is no growth."
