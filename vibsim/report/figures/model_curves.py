"""The setup of an experiment: the meshes of its levels, and the force of its spring.

Source: pendulum lecture, sections 2.1 and 2.5 (one mesh, and three with their common points); vibration text,
exercise 19 a (springs that yield).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.formula import values
from vibsim.models.base import tree
from vibsim.report import data, series, style, words
from vibsim.report.data import Results
from vibsim.report.figures import panels
from vibsim.report.style import Picture

MESHES = 4  # most levels whose meshes are drawn
INTERVALS = 4  # of the coarsest mesh
POINTS = 200  # of a curve


def grids(record: Results) -> Picture | None:
    """Draw the first points of the coarsest meshes, and their common points."""
    levels, dt = record.levels[:MESHES], record.dt(0)
    figure = style.canvas(0.75 + 0.36 * len(levels))
    height = figure.get_figheight()
    ax = figure.add_axes((0.2, 0.45 / height, 0.75, (height - 0.6) / height))
    count = min(INTERVALS, record.steps[0])
    common = dt[0] * np.arange(count + 1)
    for row, level in enumerate(levels):
        t = dt[row] * np.arange(count * round(dt[0] / dt[row]) + 1)
        colour, y = style.COLOURS[row % style.MANY], np.full(t.size, len(levels) - 1.0 - row)
        ax.plot(t, y, color=colour, marker="o", markersize=4, gid=style.of_level(level))
    top, bottom = len(levels) - 0.6, -0.4
    dashed: dict[str, Any] = {"linewidth": 0.8, "linestyle": (0, (2, 2)), "zorder": 1}
    for place in common.tolist():
        ax.plot([place, place], [bottom, top], color=style.GREY, **dashed)
    squares: dict[str, Any] = {"marker": "s", "markersize": 8, "linestyle": "none"}
    squares |= {"markerfacecolor": "none", "color": "black"}
    for row in range(len(levels)):
        ax.plot(common, np.full(common.size, len(levels) - 1.0 - row), **squares)
    texts = [f"level {level}, dt = {record.time_text(dt[i])}" for i, level in enumerate(levels)]
    ax.set_yticks(range(len(levels)), texts[::-1])
    ax.set_ylim(bottom, top)
    ax.grid(visible=False)
    ax.set_xlabel(record.time_label)
    end, steps = words.number(float(dt[0] * record.steps[0]), "step"), record.steps[0]
    return Picture(
        "grids",
        "The meshes of the levels and their common points",
        f"Each level halves the step of the one before. Squares: the points of the coarsest level, which all levels "
        f"have, so that their solutions can be compared there. Drawn are the first {count} of "
        f"{words.number(steps, 'integer')} steps of the coarsest level; the run ends at {end}.",
        f"Points in time of {len(levels)} levels, with the common ones marked",
        figure,
    )


def spring(record: Results) -> Picture | None:
    """Draw the force of every distinct spring of the members against the displacement."""
    model, position = record.model, record.model.position
    finest = f"{position}_finest"
    if model.coordinates != 1:
        return None
    largest = data.largest(np.asarray(record[finest])) if finest in record else 0.0
    if largest == 0.0:
        return None
    u = np.linspace(-largest, largest, POINTS)
    curves: dict[bytes, tuple[str, Floats]] = {}
    for case in range(record.count):
        numbers = series.parameters_of(record, case)
        state = {**numbers, model.velocity: 0.0, "t": 0.0}
        formula = tree(model, model.acceleration)
        pull = values(formula, {**state, position: 0.0}) - values(formula, {**state, position: u})
        force = np.broadcast_to(pull * numbers.get("m", 1.0), u.shape)
        text = words.swept(record.case_name(case)) or "spring"
        curves.setdefault(force.tobytes(), (text, force))
    (ax,) = panels.stacked([2.8])
    for k, (text, force) in enumerate(list(curves.values())[: style.MANY]):
        look = style.look(k)
        ax.plot(u, force, color=look["color"], linestyle=look["linestyle"], label=style.entry(text))
    letter = words.symbol(position)
    ax.set_xlim(-largest, largest)
    ax.set_xlabel(style.label(letter, record.unit(finest)))
    ax.set_ylabel(f"s({letter})")
    style.beside(ax)
    return Picture(
        "spring",
        f"The spring force s against {letter}",
        "The force that pulls back a body at rest, without friction and without driving, over the range of the motion.",
        f"Spring force against {letter} for each member",
        ax.get_figure(root=True),
    )
