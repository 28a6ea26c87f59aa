"""Motions in a plane with equal scales: the phase plane, and the path of a body with two coordinates.

Source: vibration text, sections 5.5 and 7 (figures 6, 8 and 10) for the phase plane, where velocities are divided by
the natural frequency w so that the orbit of a linear oscillation is a circle; exercise 22 for the path.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.report import data, style, words
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.figures.panels import legend_above, rows_of
from vibsim.report.style import Picture
from vibsim.report.types import Axes

PANELS_A_ROW = 3  # panels in a row of the phase plane, and most panels of the path
MOST_PANELS = 6  # most panels of the phase plane, and most schemes in them
CUT_ORBIT, CUT_PATH = 2.5, 1.3  # largest frame over the exact orbit, and over the first path
PERIODS = 3.0  # of a longer motion the first period and this many last ones are drawn
FEWEST_SAMPLES = 8  # fewest samples a period that draw an orbit
FLATTEST = 0.15  # smallest ratio of the sides of a path's frame
TALLEST = 4.5  # largest height of a panel [inch]
TICK = 0.8  # width of a tick label below a panel [inch]
SEEN = 0.01  # smallest visible difference of two paths, relative to their size

Points = tuple[Floats, Floats]


def phase(record: Results, shown: list[Member]) -> Picture | None:
    """Draw the phase plane of the schemes in `shown`, one panel per level.

    None for many schemes, without a natural frequency, for few samples a period, and for a body at rest.
    """
    model = record.model
    if not shown or len({member.scheme for member in shown}) > MOST_PANELS:
        return None
    case = shown[0].case
    members = [member for member in shown if member.case == case]
    w, t = record.natural_frequency(case), record.times(case)
    exact = float(record.exact_periods[case])
    period = exact if math.isfinite(exact) else 2.0 * math.pi / w if w > 0.0 else math.nan
    if not math.isfinite(w) or w <= 0.0 or period < FEWEST_SAMPLES * float(t[1] - t[0]):
        return None
    levels, dt = record.levels, record.dt(case)
    chosen = style.spaced(len(levels), MOST_PANELS)
    columns = [(0.62 + 2.75 * i, 2.35) for i in range(PANELS_A_ROW)]
    figure, axes = rows_of(len(chosen), columns, 2.35, 0.5, 0.45)
    is_long = bool(t[-1] > (PERIODS + 1.0) * period)
    parts = [(np.ones(t.size, dtype=bool), 1.2)]
    if is_long:
        parts = [(t <= t[0] + period, 0.9), (t >= t[-1] - PERIODS * period, 1.4)]
    # a closed orbit is drawn once, any other for the times of the levels
    closes = math.isfinite(exact)
    orbit = t <= 1.02 * period if closes else np.any([keep for keep, _ in parts], axis=0)
    size, largest = _draw_orbit(axes, record, case, w, orbit), 0.0
    for ax, i in zip(axes, chosen, strict=True):
        for k, member in enumerate(members):
            u, v = _points(record, (model.position, model.velocity), member, i)
            v = v / w
            for keep, width in parts:
                colour = style.look(k)["color"]
                ax.plot(u[keep], v[keep], color=colour, linewidth=width, alpha=0.9)
            _draw_end(ax, (u, v), k, 1.3, member.scheme_name)
            largest = max(largest, data.largest(np.hypot(u, v)))
        ax.set_title(f"level {levels[i]}, w dt = {words.number(w * float(dt[i]), 'step')}")
    edge = 1.12 * (min(largest, CUT_ORBIT * size) if size > 0.0 else largest)
    if edge == 0.0:
        return None  # at rest
    letter, measure = words.symbol(model.position), record.unit(f"{model.position}_finest")
    for n, ax in enumerate(axes):
        ax.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal")
        ax.set_xlabel(style.label(letter, measure))
        if n % PANELS_A_ROW == 0:
            ax.set_ylabel(style.label(f"{words.symbol(model.velocity)} / w", measure))
    legend_above(figure, axes[0])
    drawn_text = f"Of the whole motion the first period (thin) and the last {PERIODS:g} are drawn. "
    return Picture(
        name=f"phase_plane_{case}",
        title="Phase plane: velocity against position",
        caption=drawn_text
        * is_long
        + f"Black, dashed: the {record.name_of_exact} orbit. The marker is the end of the motion. "
        "A spiral outwards gains energy, one inwards loses it; an orbit that closes beside it conserves an energy of "
        "its own.",
        alt="Velocity over the natural frequency against position for each level",
        figure=figure,
    )


def _draw_orbit(axes: list[Axes], record: Results, case: int, w: float, drawn: Flags) -> float:
    """Draw the exact orbit or that of the reference, and return its size; 0 if it is unknown."""
    names = f"{record.model.position}_exact", f"{record.model.velocity}_exact"
    if any(name not in record for name in names):
        return 0.0
    series = (np.asarray(record.pick(name, case=case), np.float64) for name in names)
    u, v = (np.where(drawn, values, np.nan) for values in series)
    if record.model.linear:
        angle = np.linspace(0.0, 2.0 * np.pi, 121)
        radius = float(np.hypot(u[0], v[0] / w))
        u, v = radius * np.cos(angle), radius * w * np.sin(angle)
    for ax in axes:
        ax.plot(u, v / w, **style.REFERENCE | {"zorder": 5}, label=record.name_of_exact)
    return float(np.nanmax(np.hypot(u, v / w)))


def _draw_end(ax: Axes, points: Points, k: int, width: float, name: str) -> None:
    """Mark the last point of the k-th scheme, with its legend entry."""
    last = np.flatnonzero(np.isfinite(points[0]))[-1:]
    look: dict[str, Any] = style.look(k) | {"linestyle": "-", "linewidth": width, "markersize": 5}
    ax.plot(points[0][last], points[1][last], **look, label=style.entry(name))


def path(record: Results, shown: list[Member]) -> Picture | None:
    """Draw the paths of the schemes in `shown`: one panel per level, or per member of a sweep at the finest level.

    None unless the model has two coordinates, and if all paths run along a line, such as those of two points of a beam
    in one mode.
    """
    from matplotlib.ticker import MaxNLocator

    model = record.model
    if model.coordinates != 2 or not shown:
        return None
    names, levels = model.positions[:2], record.levels
    if record.swept:
        cases = sorted({member.case for member in shown})[:PANELS_A_ROW]
        groups = [[member for member in shown if member.case == case] for case in cases]
        panels = [(group[0].case_words, group, len(levels) - 1) for group in groups]
    else:
        panels = [(f"level {levels[i]}", shown, i) for i in style.spaced(len(levels), PANELS_A_ROW)]
    curves = [[_points(record, names, m, level) for m in members] for _, members, level in panels]
    if not record.swept:
        # levels that look like the finest one are left out
        last = len(curves) - 1
        distinct = [
            i for i, paths in enumerate(curves) if i == last or _differ(paths, curves[last])
        ]
        panels, curves = [panels[i] for i in distinct], [curves[i] for i in distinct]
    if all(_is_line(points) for paths in curves for points in paths):
        return None
    name = record.name_of_exact
    references = [_points(record, names, members[0], None) for _, members, _ in panels]
    is_known = [bool(np.isfinite(reference).all()) for reference in references]
    rows = zip(references, is_known, curves, strict=True)
    frame = _frame([points for exact, has, panel in rows for points in (*[exact] * has, *panel)])
    if frame is None:
        return None
    (left, right), (low, high) = frame
    wide = style.WIDTH - 1.0
    tall = min(wide * (high - low) / (right - left), TALLEST)
    figure, axes = rows_of(len(panels), [(0.75, wide)], tall, 0.5, 0.3)
    ticks = max(2, int(tall * (right - left) / (high - low) / TICK))
    labels = [style.label(words.symbol(name), record.unit(f"{name}_finest")) for name in names]
    for i, (title, members, _) in enumerate(panels):
        # from thick to thin, so that no scheme hides another
        for k, (member, (x, y)) in enumerate(zip(members, curves[i], strict=True)):
            width = 1.0 + 1.8 * (len(members) - 1 - k) / len(members)
            axes[i].plot(x, y, color=style.look(k)["color"], linewidth=width, alpha=0.8)
            _draw_end(axes[i], (x, y), k, width, member.scheme_name)
        if is_known[i]:
            dashed = style.REFERENCE | {"zorder": 5, "linewidth": 0.8}
            axes[i].plot(*references[i], **dashed, label=name)
        axes[i].set_title(title)
        axes[i].xaxis.set_major_locator(MaxNLocator(ticks, steps=[1, 2, 5, 10]))
        axes[i].set(xlim=frame[0], ylim=frame[1], aspect="equal", ylabel=labels[1])
    axes[-1].set_xlabel(labels[0])
    legend_above(figure, max(axes, key=lambda ax: len(ax.get_lines())))
    return Picture(
        name="path",
        title=f"Path: {names[1]} against {names[0]}",
        caption="Both axes have the same scale. The marker is the end of the motion; black, dashed: the "
        f"{name} solution. Levels that look like the finest one are left out.",
        alt=f"{names[1]} against {names[0]} for each level or member, with the {name} solution",
        figure=figure,
    )


def _points(record: Results, names: tuple[str, ...], member: Member, level: int | None) -> Points:
    """Return the path of a member on a level, or the exact one (None), which is NaN if unknown."""
    x, y = (Ladder(record, name, member) for name in names)
    return (x.exact, y.exact) if level is None else (x.on_level(level), y.on_level(level))


def _is_line(points: Points) -> bool:
    """Say whether a path runs along a line that is parallel to no axis: both coordinates move together."""
    x, y = (values - values.mean() for values in points)
    both, together = float(np.sum(x * x) * np.sum(y * y)), float(np.sum(x * y)) ** 2
    return both > 0.0 and both - together <= SEEN**2 * both


def _differ(panel: list[Points], finest: list[Points]) -> bool:
    """Return whether a path of a level looks different from that of the finest level."""
    distances = [data.largest(np.subtract(a, b)) for a, b in zip(panel, finest, strict=True)]
    return max(distances) > SEEN * max(data.largest(np.asarray(points)) for points in finest)


def _frame(paths: list[Points]) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return the limits of both axes around the first path, with room for others that stay near it."""
    first = [style.finite(values) for values in paths[0]]
    if not all(values.size for values in first):
        return None
    middle = [0.5 * float(np.min(values) + np.max(values)) for values in first]
    half = [0.5 * float(np.ptp(values)) for values in first]
    limits = []
    for axis in (0, 1):
        reach = max(data.largest(points[axis] - middle[axis]) for points in paths)
        half_width = max(min(reach, CUT_PATH * half[axis]), FLATTEST * max(half))
        limits.append((middle[axis] - 1.08 * half_width, middle[axis] + 1.08 * half_width))
    return (limits[0], limits[1]) if max(half) > 0.0 else None
