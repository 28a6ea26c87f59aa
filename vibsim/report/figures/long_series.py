"""A long series on several levels, or with several schemes, in panels that share a moving window.

The page shows some periods at a time, and the whole time in a strip below. A drag or a key moves the window. Without
scripts all panels show the whole time. Series are thinned without losing extremes.

Source: vibration text, section 3.3 (panels with linked panning), section 3.1 (a window where there are many periods).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.report import data, series, style, words
from vibsim.report.data import Ladder
from vibsim.report.figures import moments, panels
from vibsim.report.figures.moments import UNBOUNDED
from vibsim.report.style import Picture
from vibsim.report.types import Axes

MANY_PERIODS = 10.0  # a run of more periods is long
PERIODS = 4.0  # initial width of the window
MOST_POINTS = 24_000  # of all curves, about 300 kB
POINTS_A_PERIOD = 24  # of a curve; longer runs have fewer curves, and then fewer points
FEWEST_PANELS, MOST_PANELS = 2, 5
TALL, STRIP = 0.95, 0.4  # height of a panel and of the strip below [inch]
SPARSE = 12.0  # with fewer samples a period they are dots, and the reference is a spline through its samples
BEYOND = 1.25  # limit of the vertical axis over the largest value of the reference


class Row(NamedTuple):
    """The curve of a panel."""

    label: str
    values: Floats
    group: str | None


def long_series(ladder: Ladder) -> Picture | None:
    """Draw a long series; None with few periods, few samples a period, or nothing to compare with.

    One scheme is drawn on several levels, several schemes on the coarsest level.
    """
    record, t, reference = ladder.record, ladder.t, ladder.exact
    is_known = bool(np.isfinite(reference).all())
    reference = reference if is_known else ladder.finest
    size = data.largest(reference)
    if not np.isfinite(reference).all() or size == 0.0:
        return None
    span = float(t[-1] - t[0])
    period = moments.period(t, reference)
    count = MOST_POINTS / (POINTS_A_PERIOD * span / period)
    rows = _rows(ladder, int(np.clip(count / 2, FEWEST_PANELS, MOST_PANELS)))
    is_short = span <= MANY_PERIODS * period
    if (
        is_short
        or (len(rows) == 1 and not is_known)
        or moments.is_undersampled(record.steps[0], t, (t, reference))
    ):
        return None
    # thinning keeps two points of each group of neighbours
    width = max(style.THINNED_POINTS, MOST_POINTS // (4 * len(rows)))
    against = record.name_of_exact if is_known else f"level {record.levels[-1]}"
    gid = f"{style.LONG} {PERIODS * period:.6g}"
    axes = panels.stacked([*[TALL] * len(rows), STRIP], gid)
    look: dict[str, Any] = {"color": style.PALE, "linewidth": 3.5, "zorder": 1, "gid": "compared"}
    is_sparse, is_curve = t.size * period < SPARSE * span, False
    dots: dict[str, Any] = {"marker": "o", "markersize": 2.5} if is_sparse else {}
    pale_points = style.thin(t, reference, width)
    if is_sparse:
        smooth = series.exact_curve(ladder)
        is_curve = is_known and smooth[0].size > t.size
        pale_points = smooth if is_curve else _smooth(t, reference)
    for i, (ax, row) in enumerate(zip(axes, rows, strict=False)):
        _draw(ax, pale_points, against, look)
        line = {"color": style.COLOURS[i % style.MANY], "linewidth": 1.2, "gid": row.group} | dots
        _draw(ax, style.thin(t, row.values, width), style.entry(row.label), line)
        ax.set(xlim=(t[0], t[-1]), ylim=(-BEYOND * size, BEYOND * size))
        ax.set_ylabel(style.label(ladder.letter, ladder.unit()))
        style.beside(ax)
    axes[len(rows) - 1].tick_params(labelbottom=True)
    _draw_strip(axes[-1], t, rows[0], reference, size)
    axes[-1].set_xlabel(record.time_label)
    each = f"panel for each {'level' if rows[0].group else 'scheme'}"
    case = ladder.member.case_words or f"a {each}"
    return Picture(
        f"long_{ladder.stem}",
        f"{words.title(ladder.quantity)}(t) over {span / period:.0f} periods, {case}",
        f"A {each}, with the {f'{against} solution' if is_known else 'finest level'} in grey. "
        "The strip below has the error of the first panel over the whole time."
        + " Dots: the times that all levels share." * is_sparse
        + " Grey is a spline between them." * (is_sparse and not is_curve),
        f"{ladder.name} against time, a {each}, over {span / period:.0f} periods",
        axes[0].get_figure(root=True),
    )


def _rows(ladder: Ladder, most: int) -> list[Row]:
    levels, steps = ladder.record.levels, ladder.record.steps
    if len(ladder.record.schemes) > 1:
        members = ladder.record.of_case(ladder.case)
        members.sort(key=lambda one: one.scheme != ladder.scheme)
        return [
            Row(f"{one.scheme_name}, level {levels[0]}", ladder.with_member(one).on_level(0), None)
            for one in members[:most]
        ]
    return [
        Row(f"{words.number(steps[i], 'integer')} steps", ladder.on_level(i), style.of_level(levels[i]))
        for i in style.spaced(len(levels), most)
    ]  # fmt: skip


def _smooth(t: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Return a spline through few samples of an oscillation."""
    from scipy.interpolate import CubicSpline

    times = np.linspace(t[0], t[-1], 4 * (t.size - 1) + 1)
    return times, np.asarray(CubicSpline(t, x)(times))


def _draw(ax: Axes, points: tuple[Floats, Floats], label: str, look: dict[str, Any]) -> None:
    """Draw a curve with all its points, since a page shows a small part of it enlarged."""
    import matplotlib

    with matplotlib.rc_context({"path.simplify": False}):
        (line,) = ax.plot(*points, label=label, **look)
        line.get_path()


def _draw_strip(ax: Axes, t: Floats, row: Row, reference: Floats, size: float) -> None:
    ax.set_gid(style.OVERVIEW)
    error, most = row.values - reference, UNBOUNDED * size
    text = f"error, {row.label}"
    ax.plot(*style.thin(t, error), color=style.COLOURS[0], linewidth=0.8, label=text)
    # an error that grows without bound leaves the strip
    ax.set(xlim=(t[0], t[-1]), ylim=style.limits(np.clip(error, -most, most)))
    ax.set_yticks([])
    style.beside(ax)
