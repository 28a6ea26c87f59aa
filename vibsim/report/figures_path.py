"""The path of a body with two coordinates or more: the second one against the first, both on the same scale.

Source: vibration text, exercise 22 (the motion of the mass at (x, y), with equal aspect ratio).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.record import Record
from vibsim.report import style, words
from vibsim.report.data import Floats, Member, case_name, pick, swept, unit, whole
from vibsim.report.figures_phase import ACROSS, MOST, legend_above, of_level, square_axes
from vibsim.report.style import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from vibsim.spec import Experiment

CUT = 1.3
"""What leaves the exact path by more than this factor is cut off."""


def path(experiment: Experiment, record: Record, shown: list[Member]) -> Picture | None:
    """Draw the paths of the schemes shown: a panel for each level, or for each member of a sweep at its finest level.

    None of a model with one coordinate.
    """
    model = experiment.model.definition
    if model.coordinates < 2 or not shown:
        return None
    names = model.positions[:2]
    panels = _panels(record, shown)
    figure, axes = square_axes(len(panels))
    box = _draw(axes, record, names, panels)
    if box is None:
        return None
    across, along, half = box
    for n, (ax, (title, _, _)) in enumerate(zip(axes, panels, strict=True)):
        ax.set_title(title)
        ax.set(xlim=(across - half, across + half), ylim=(along - half, along + half))
        ax.set(aspect="equal")
        ax.set_xlabel(style.label(words.symbol(names[0]), unit(record, f"{names[0]}_finest")))
        if n % ACROSS == 0:
            measure = unit(record, f"{names[1]}_finest")
            ax.set_ylabel(style.label(words.symbol(names[1]), measure))
    legend_above(figure, axes[0])
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
        cases = sorted({member.case for member in shown})[:MOST]
        return [
            (case_name(record, case), [m for m in shown if m.case == case], finest)
            for case in cases
        ]
    chosen = sorted({round(x) for x in np.linspace(0, finest, min(ACROSS, len(levels)))})
    return [(f"level {levels[i]}", shown, i) for i in chosen]


def _draw(
    axes: list[Axes],
    record: Record,
    names: tuple[str, ...],
    panels: list[tuple[str, list[Member], int]],
) -> tuple[float, float, float] | None:
    """Draw every path; return the middle of the frame and half its side, None where nothing moves."""
    seen: list[tuple[Floats, Floats]] = []
    for ax, (_, members, level) in zip(axes, panels, strict=True):
        for k, member in enumerate(members):
            x, y = (of_level(record, name, member, level) for name in names)
            look = style.look(k)
            ax.plot(x, y, color=look["color"], linewidth=1.0, alpha=0.9)
            last = np.flatnonzero(np.isfinite(x))[-1:]
            ax.plot(x[last], y[last], color=look["color"], marker=look["marker"], markersize=5,
                    linestyle="-", linewidth=1.3, label=style.entry(member.scheme_name))  # fmt: skip
            seen.append((x, y))
        exact = _exact(record, names, members[0].case)
        if exact is not None:
            dashed: dict[str, Any] = {"color": "black", "linestyle": (0, (4, 3)), "linewidth": 0.8}
            ax.plot(*exact, **dashed, zorder=5, label="reference")
            seen.insert(0, exact)
    return _frame(seen)


def _exact(record: Record, names: tuple[str, ...], case: int) -> tuple[Floats, Floats] | None:
    """Return the exact path or the reference for it; None where there is none."""
    if any(f"{name}_exact" not in record for name in names):
        return None
    x, y = (np.asarray(pick(record, f"{name}_exact", case=case), dtype=float) for name in names)
    return (x, y) if np.isfinite(x).all() and np.isfinite(y).all() else None


def _frame(seen: list[tuple[Floats, Floats]]) -> tuple[float, float, float] | None:
    """Return a square around the first path, with room for the others as far as they stay near it."""
    x, y = (values[np.isfinite(values)] for values in seen[0])
    if x.size == 0:
        return None
    across, along = 0.5 * float(np.min(x) + np.max(x)), 0.5 * float(np.min(y) + np.max(y))
    size = 0.5 * max(float(np.ptp(x)), float(np.ptp(y)))
    reach = [
        float(np.nanmax(np.maximum(np.abs(x - across), np.abs(y - along)), initial=0.0))
        for x, y in seen
    ]
    half = 1.08 * min(max(reach), CUT * size)
    return (across, along, half) if half > 0.0 else None
