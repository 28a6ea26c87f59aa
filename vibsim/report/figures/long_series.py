"""A long series on several levels, or by several schemes, below each other: a window that all panels share moves along.

The page shows some periods at once, and a strip below all of the time. A drag or a key moves the window. Without
scripts all panels show the whole time. Series are thinned so that no extreme is lost.

Source: vibration text, section 3.3 (panels with linked panning), section 3.1 (a window where there are many periods).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.report import data, series, style, words
from vibsim.report.data import Member
from vibsim.report.figures import moments, panels
from vibsim.report.figures.moments import UNBOUNDED
from vibsim.report.style import Picture
from vibsim.report.types import Axes, Experiment

MANY_PERIODS = 10.0
"""A run of more periods is long."""
PERIODS = 4.0  # in the window at first
MOST_POINTS = 24_000  # of all curves together, about 300 kB
POINTS_A_PERIOD = 24  # of a curve; of a longer run fewer curves are drawn, and then fewer points
FEWEST_PANELS, MOST_PANELS = 2, 5  # panels
TALL, STRIP = 0.95, 0.4  # height of a panel and of the strip below [inch]
SPARSE = 12.0  # samples a period below which they have dots, and what they are compared with is smooth between them
BEYOND = 1.25  # how much of a panel lies above the largest value that is compared with


class Row(NamedTuple):
    """What a panel shows."""

    label: str
    values: Floats
    group: str | None


def long_series(
    experiment: Experiment, record: Record, quantity: str, member: Member
) -> Picture | None:
    """Draw a long series; None where there are few periods, few samples of each, or nothing to compare a run with.

    One scheme is drawn on several levels, several schemes each on the coarsest level.
    """
    t, finest = data.times(record, member.case), data.whole(record, "level")[-1]
    compared = data.exact_series(record, quantity, member)
    is_known = bool(np.isfinite(compared).all())
    if not is_known:
        compared = data.at(record, f"{quantity}_finest", member)
    size = data.largest(compared)
    if not np.isfinite(compared).all() or size == 0.0:
        return None
    span = float(t[-1] - t[0])
    period = moments.period(t, compared)
    curves = MOST_POINTS / (POINTS_A_PERIOD * span / period)
    rows = _rows(record, quantity, member, int(np.clip(curves / 2, FEWEST_PANELS, MOST_PANELS)))
    is_short = span <= MANY_PERIODS * period
    if (
        is_short
        or (len(rows) == 1 and not is_known)
        or moments.is_undersampled(int(record["steps"][0]), t, (t, compared))
    ):
        return None
    # a group of neighbours keeps two points
    width = max(style.THINNED_POINTS, MOST_POINTS // (4 * len(rows)))
    letter, measure = words.symbol(quantity), data.unit(record, f"{quantity}_finest")
    against = "exact" if is_known else f"level {finest}"
    gid = f"{style.LONG} {PERIODS * period:.6g}"
    axes = panels.stacked([*[TALL] * len(rows), STRIP], gid)
    look: dict[str, Any] = {"color": style.PALE, "linewidth": 3.5, "zorder": 1, "gid": "compared"}
    is_sparse, is_curve = t.size * period < SPARSE * span, False
    dots: dict[str, Any] = {"marker": "o", "markersize": 2.5} if is_sparse else {}
    pale = style.thin(t, compared, width)
    if is_sparse:
        smooth = series.exact_curve(experiment, record, quantity, member)
        is_curve = is_known and smooth[0].size > t.size
        pale = smooth if is_curve else _smooth(t, compared)
    for i, (ax, row) in enumerate(zip(axes, rows, strict=False)):
        _draw(ax, pale, against, look)
        own = {"color": style.COLOURS[i % style.MANY], "linewidth": 1.2, "gid": row.group} | dots
        _draw(ax, style.thin(t, row.values, width), style.entry(row.label), own)
        ax.set(xlim=(t[0], t[-1]), ylim=(-BEYOND * size, BEYOND * size))
        ax.set_ylabel(style.label(letter, measure))
        style.beside(ax)
    axes[len(rows) - 1].tick_params(labelbottom=True)
    _draw_strip(axes[-1], t, rows[0], compared, size)
    axes[-1].set_xlabel(data.time_label(record))
    of = "level" if rows[0].group else "scheme"
    return Picture(
        f"long_{quantity}_{member.stem}",
        f"{words.title(quantity)}(t) over {span / period:.0f} periods, {member.case_words or f'a panel for each {of}'}",
        f"A panel for each {of}, with the {'exact solution' if is_known else 'finest level'} in grey. "
        "The strip below has the error of the first panel over the whole time."
        + " Dots: the times that all levels share." * is_sparse
        + " Grey is a spline between them." * (is_sparse and not is_curve),
        f"{words.name(quantity)} against time, a panel for each {of}, over {span / period:.0f} periods",
        axes[0].get_figure(root=True),
    )


def _rows(record: Record, quantity: str, member: Member, most: int) -> list[Row]:
    levels, schemes = data.whole(record, "level"), record.words("scheme")
    if len(schemes) > 1:
        chosen = data.of_case(record, member.case)
        chosen.sort(key=lambda one: one.scheme != member.scheme)
        return [
            Row(f"{one.scheme_name}, level {levels[0]}", data.of_level(record, quantity, one, 0), None)
            for one in chosen[:most]
        ]  # fmt: skip
    rows = []
    for i in style.spaced(len(levels), most):
        steps = words.number(int(record["steps"][i]), "integer")
        values = data.of_level(record, quantity, member, i)
        rows.append(Row(f"{steps} steps", values, style.of_level(levels[i])))
    return rows


def _smooth(t: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Return a curve through few samples of an oscillation, a spline."""
    from scipy.interpolate import CubicSpline

    times = np.linspace(t[0], t[-1], 4 * (t.size - 1) + 1)
    return times, np.asarray(CubicSpline(t, x)(times))


def _draw(ax: Axes, points: tuple[Floats, Floats], label: str, look: dict[str, Any]) -> None:
    """Draw a curve of which a page shows a small part, so that every point counts."""
    import matplotlib

    with matplotlib.rc_context({"path.simplify": False}):
        (line,) = ax.plot(*points, label=label, **look)
        line.get_path()


def _draw_strip(ax: Axes, t: Floats, row: Row, compared: Floats, size: float) -> None:
    ax.set_gid(style.OVERVIEW)
    error, most = row.values - compared, UNBOUNDED * size
    text = f"error, {row.label}"
    ax.plot(*style.thin(t, error), color=style.COLOURS[0], linewidth=0.8, label=text)
    # one that grows without bound leaves the strip
    ax.set(xlim=(t[0], t[-1]), ylim=style.limits(np.clip(error, -most, most)))
    ax.set_yticks([])
    style.beside(ax)
