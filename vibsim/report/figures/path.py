"""The path of a body with two coordinates or more: the second one against the first, both on the same scale.

Source: vibration text, exercise 22 (the motion of the mass at (x, y), with equal aspect ratio).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibsim.core.record import Record
from vibsim.report import style
from vibsim.report.data import Floats, Member, case_name, pick, swept, unit, whole
from vibsim.report.figures.panels import legend_above, rows_of
from vibsim.report.figures.phase import ACROSS, of_level
from vibsim.report.style import Picture
from vibsim.report.text import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from vibsim.experiment import Experiment

CUT = 1.3
"""What leaves the exact path by more than this factor is cut off."""
FLATTEST = 0.15
"""Least height of a frame over its width, or the other way round."""
TALLEST = 4.5
"""Largest height of a panel [inch]."""

Points = tuple[Floats, Floats]


def path(experiment: Experiment, record: Record, shown: list[Member]) -> Picture | None:
    """Draw the paths of the schemes shown: a panel for each level, or for each member of a sweep at its finest level.

    None of a model with one coordinate.
    """
    model = experiment.model.definition
    if model.coordinates < 2 or not shown:
        return None
    names = model.positions[:2]
    panels = _panels(record, shown)
    curves = [_curves(record, names, members, level) for _, members, level in panels]
    frame = _frame([points for panel in curves for _, points in panel])
    if frame is None:
        return None
    (left, right), (low, high) = frame
    wide = style.WIDTH - 1.0
    tall = min(wide * (high - low) / (right - left), TALLEST)
    figure, axes = rows_of(len(panels), [(0.75, wide)], tall, 0.4, 0.3)
    for ax, (title, _, _), panel in zip(axes, panels, curves, strict=True):
        _draw(ax, panel)
        ax.set_title(title)
        ax.set(xlim=frame[0], ylim=frame[1], aspect="equal")
        ax.set_ylabel(style.label(words.symbol(names[1]), unit(record, f"{names[1]}_finest")))
    axes[-1].set_xlabel(style.label(words.symbol(names[0]), unit(record, f"{names[0]}_finest")))
    legend_above(figure, max(axes, key=lambda ax: len(ax.get_lines())))
    return Picture(
        name="path",
        title=f"Path: {names[1]} against {names[0]}",
        caption="Both axes have the same scale. The marker is the end of the motion; black, dashed: the reference.",
        alt=f"{names[1]} against {names[0]} for each level or member, with the reference",
        figure=figure,
    )


def _panels(record: Record, shown: list[Member]) -> list[tuple[str, list[Member], int]]:
    """Return the panels: title, members, and place of the level."""
    levels = whole(record, "level")
    finest = len(levels) - 1
    if swept(record):
        cases = sorted({member.case for member in shown})[:ACROSS]
        return [
            (case_name(record, case), [m for m in shown if m.case == case], finest)
            for case in cases
        ]
    chosen = style.spaced(len(levels), ACROSS)
    return [(f"level {levels[i]}", shown, i) for i in chosen]


def _curves(
    record: Record, names: tuple[str, ...], members: list[Member], level: int
) -> list[tuple[str, Points]]:
    """Return the curves of a panel by name: the reference first, of which the name is empty, where there is one."""
    exact = [f"{name}_exact" for name in names]
    found: list[tuple[str, Points]] = []
    if all(name in record for name in exact):
        x, y = (np.asarray(pick(record, name, case=members[0].case), dtype=float) for name in exact)
        if np.isfinite(x).all() and np.isfinite(y).all():
            found.append(("", (x, y)))
    for member in members:
        x, y = (of_level(record, name, member, level) for name in names)
        found.append((member.scheme_name, (x, y)))
    return found


def _draw(ax: Axes, curves: list[tuple[str, Points]]) -> None:
    """Draw the schemes from thick to thin, so that none hides another, and the reference over them."""
    schemes = [curve for curve in curves if curve[0]]
    for k, (name, (x, y)) in enumerate(schemes):
        look, width = style.look(k), 1.0 + 1.8 * (len(schemes) - 1 - k) / len(schemes)
        ax.plot(x, y, color=look["color"], linewidth=width, alpha=0.8)
        last = np.flatnonzero(np.isfinite(x))[-1:]
        ax.plot(x[last], y[last], color=look["color"], marker=look["marker"], markersize=5,
                linestyle="-", linewidth=width, label=style.entry(name))  # fmt: skip
    for x, y in (points for name, points in curves if not name):
        ax.plot(x, y, **style.REFERENCE | {"zorder": 5, "linewidth": 0.8}, label="reference")


def _frame(seen: list[Points]) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return the limits of both axes: around the first path, with room for the others as far as they stay near it."""
    middle, half = [], []
    for axis in (0, 1):
        first = seen[0][axis][np.isfinite(seen[0][axis])]
        if first.size == 0:
            return None
        middle.append(0.5 * float(np.min(first) + np.max(first)))
        half.append(0.5 * float(np.ptp(first)))
    limits = []
    for axis in (0, 1):
        away = [np.abs(points[axis] - middle[axis]) for points in seen]
        reach = max(float(np.max(x[np.isfinite(x)], initial=0.0)) for x in away)
        room = max(min(reach, CUT * half[axis]), FLATTEST * max(half))
        limits.append((middle[axis] - 1.08 * room, middle[axis] + 1.08 * room))
    return (limits[0], limits[1]) if max(half) > 0.0 else None
