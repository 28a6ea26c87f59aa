"""Quantities over time as a source shows them: several schemes, levels or members beside the exact solution.

The exact solution is drawn at its own times, so that it is smooth even if a scheme has few points a period. Where
impacts make the velocity jump, its curve has a gap.

Source: vibration text, figures 1, 4, 5, 7, 9 and 11, section 3.3, exercises 18 b, 20, 21 b and 22 a.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.experiment.schema.figures import LEVEL, MEMBER, FigureOfSource
from vibsim.formula import parse, values
from vibsim.report import choice, data, series, style, words
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.figures import panels
from vibsim.report.style import Picture
from vibsim.report.types import Axes

MOST = 6  # most panels of a figure, and most figures
FEW = 90  # points of a run up to which each has a marker
LEAVES_FRAME = 8.0  # values beyond this multiple of the exact solution leave the frame
SEEN = 0.2  # runs within `LEAVES_FRAME` for a smaller fraction of the time are drawn whole instead
SUBTLE: dict[str, Any] = {"linestyle": (0, (5, 2)), "linewidth": 1.2, "zorder": 1.5}
"""The look of further curves."""


@dataclass(frozen=True)
class _Panel:
    """The content of a panel."""

    title: str
    quantity: str
    runs: tuple[tuple[str, Member], ...]  # legend entry and member of each curve
    level: int


def pictures(record: Results, figure: FigureOfSource, name: str) -> list[Picture]:
    """Return one figure, or one for each value of the key `figure.each`."""
    groups = _grouped(record, choice.with_levels(record, record.all_members), figure.each)
    drawn = []
    for k, i in enumerate(style.spaced(len(groups), MOST)):
        text, members = groups[i]
        stem = f"{name}_{k}" if len(groups) > 1 else name
        drawn.append(_picture(record, figure, stem, text, members))
    return [picture for picture in drawn if picture is not None]


def _grouped(
    record: Results, members: list[Member], by: str | None
) -> list[tuple[str, list[Member]]]:
    """Group members by the value of a swept key, by member, or (None) all together; with the words for each group."""
    groups: dict[str, list[Member]] = {}
    for member in members:
        key = None if by == MEMBER else by
        text = "" if by is None else words.swept(record.case_name(member.case, key))
        groups.setdefault(text, []).append(member)
    return list(groups.items())


def _picture(
    record: Results, figure: FigureOfSource, name: str, text: str, members: list[Member]
) -> Picture | None:
    shown = _panels(record, figure, members)
    tall = 2.2 if len(shown) < 4 else 1.6
    axes = panels.stacked([tall] * len(shown), style.TIME)
    cases = {member.case for panel in shown for _, member in panel.runs}
    end = max(float(record.times(case)[-1]) for case in cases)
    end = end if figure.until is None else min(figure.until, end)
    for ax, panel in zip(axes, shown, strict=True):
        if not _draw(ax, record, figure, panel, end):
            return None
    axes[-1].set_xlabel(record.time_label)
    letters = ", ".join(dict.fromkeys(words.symbol(panel.quantity) for panel in shown))
    return Picture(
        name,
        f"{letters} over time" + (f", {text}" if text else ""),
        style.sentences(
            f"Wide and grey: the {record.name_of_exact} solution, where it is known.",
            f"Markers are steps. What grows beyond {LEAVES_FRAME:g} times its size leaves the frame.",
            f"At most {MOST} figures and {MOST} panels are drawn, and {style.MANY} runs in a panel."
            * _is_thinned(record, figure, members),
        ),
        f"{letters} against time, {len(shown)} {'panel' if len(shown) == 1 else 'panels'}",
        axes[0].get_figure(root=True),
    )


def _is_thinned(record: Results, figure: FigureOfSource, members: list[Member]) -> bool:
    """Return whether figures, panels or runs are left out."""
    is_by_level = figure.panels == LEVEL
    figures = _grouped(record, record.all_members, figure.each)
    groups = _grouped(record, members, None if is_by_level else figure.panels)
    levels = record.levels if is_by_level else []
    runs = max(len(group) for _, group in groups)
    return max(len(figures), len(groups), len(levels)) > MOST or runs > style.MANY


def _panels(record: Results, figure: FigureOfSource, members: list[Member]) -> list[_Panel]:
    quantities = figure.quantities or (record.model.position,)
    levels, finest = record.levels, len(record.levels) - 1
    if figure.panels == LEVEL:
        steps = [record.time_text(dt) for dt in record.dt(members[0].case)]
        runs = _named(record, members, figure)
        return [
            _Panel(f"level {levels[i]}, dt = {steps[i]}", quantities[0], runs, i)
            for i in style.spaced(len(levels), MOST)
        ]
    if figure.panels is not None:
        groups = _grouped(record, members, figure.panels)
        chosen = [groups[i] for i in style.spaced(len(groups), MOST)]
        return [
            _Panel(text, quantities[0], _named(record, group, figure), finest)
            for text, group in chosen
        ]
    runs = _named(record, members, figure)
    return [_Panel(words.title(name), name, runs, finest) for name in quantities]


def _named(
    record: Results, members: list[Member], figure: FigureOfSource
) -> tuple[tuple[str, Member], ...]:
    """Name runs by the scheme and the swept keys in which they differ."""
    several = len({member.scheme for member in members}) > 1
    divided = {figure.each, figure.panels}
    keys = [record.swept_label(name)[0] for name in record.swept]
    varying = [] if MEMBER in divided else [key for key in keys if key not in divided]
    named = []
    for i in style.spaced(len(members), style.MANY):
        member = members[i]
        parts = [member.scheme_name] if several else []
        parts += [words.swept(record.case_name(member.case, key)) for key in varying]
        named.append((", ".join(parts) or member.scheme_name, member))
    return tuple(named)


def _draw(ax: Axes, record: Results, figure: FigureOfSource, panel: _Panel, end: float) -> bool:
    """Draw a panel up to the time `end`; return whether its quantity is stored or computable."""
    first, events = Ladder(record, panel.quantity, panel.runs[0][1]), record.model.events
    exact: list[Floats] = []
    if len({member.case for _, member in panel.runs}) == 1:
        fine, reference = series.exact_curve(first, end)
        if np.isfinite(reference).any():
            wide: dict[str, Any] = {"color": style.PALE, "linewidth": 4.5, "zorder": 1}
            ax.plot(*style.thin(fine, reference), label=record.name_of_exact, **wide)
            exact.append(reference)
    size = max(map(data.largest, exact), default=0.0)
    drawn, jumps = [], events is not None and events.jumps
    for k, (text, member) in enumerate(panel.runs):
        t, y = record.times(member.case), series.on_level(first.with_member(member), panel.level)
        if y is None:
            return False
        shown = t <= end * (1.0 + 1e-12)
        t, y = t[shown], y[shown]
        within = np.abs(y) <= LEAVES_FRAME * size
        # never true for an exact solution of zero
        if within.mean() >= SEEN:
            y = np.where(within, y, np.nan)
        ax.plot(*style.thin(t, y), label=style.entry(text), **_look(k, t.size, jumps))
        drawn.append(y)
    fine = np.linspace(float(t[0]), end, series.SMOOTH)
    parameters = series.parameters_of(record, first.case)
    for k, (text, formula) in enumerate(figure.beside.items()):
        curve = values(parse(formula, ("t", *parameters)), {**parameters, "t": fine})
        curve = np.broadcast_to(curve, fine.shape)
        colour = style.COLOURS[(len(panel.runs) + k) % style.MANY]
        ax.plot(*style.thin(fine, curve), color=colour, label=style.entry(text), **SUBTLE)
        drawn.append(curve)
    panels.fit_values(ax, drawn, *exact)
    ax.set_xlim(float(t[0]), end if end > t[0] else float(t[0]) + 1.0)
    style.label_values(ax, first.letter, series.unit_of(first))
    panels.move_label_left(ax)
    ax.set_title(panel.title)
    style.beside(ax)
    return True


def _look(k: int, points: int, jumps: bool) -> dict[str, Any]:
    look: dict[str, Any] = style.look(k) | {"linewidth": 1.2, "markersize": 3.0}
    if points > FEW:
        return look | {"marker": "none"}
    # a line would hide impacts between points
    return look | ({"linestyle": "none"} if jumps else {})
