"""Panels of figures, and curves over time that may coincide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.report import data, frame, style
from vibsim.report.types import Axes, Figure

LOG_RATIO = 1e6  # largest value over the median above which curves have a logarithmic scale
STILL_GROWS = 0.9  # part of the time after which a largest value means that values still grow
DEEPEST = (
    1e-12  # smallest part of the largest value on a logarithmic axis of values that do not grow
)
LOG_SPREAD = 8.0  # ratio of largest to smallest spread above which their scale is logarithmic
LONG_LABEL = 36  # characters; longer labels have the unit on a second line
LEGEND_COLUMNS = 7  # most columns of a legend above panels


@dataclass(frozen=True)
class Curve:
    """One curve of an overlay."""

    label: str
    values: Floats
    sound: bool = True  # whether it is above round-off
    lost: str = ""  # why it is not sound, in words; empty means round-off
    group: str | None = None  # group id of the elements of a page that are switched off together

    @property
    def is_whole(self) -> bool:
        """Whether its runs lasted to the end; a centred formula has no value at the first and last time."""
        inner = self.values[1:-1] if self.values.size > 2 else self.values
        return self.lost != frame.BROKE_DOWN and bool(np.isfinite(inner).all())

    @property
    def is_readable(self) -> bool:
        """Whether its runs lasted to the end and it is above round-off."""
        return self.sound and self.is_whole

    @property
    def fate(self) -> str:
        """Remark in the legend on a curve that is not sound or not whole; else empty."""
        if not self.is_whole:
            return frame.BROKE_DOWN
        return "" if self.sound else self.lost or frame.ROUND_OFF


def note(ax: Axes, text: str, height: float = 0.9) -> None:
    """Write a remark on the scale of a panel at its right."""
    ax.text(0.99, height, text, transform=ax.transAxes, ha="right", fontsize=8.5)


def move_label_left(ax: Axes) -> None:
    """Make room for the long tick labels of values that hardly differ."""
    ax.yaxis.set_label_coords(-0.115, 0.5)


def stacked(heights: list[float], over: str | None = None) -> list[Axes]:
    """Return axes of some heights [inch] below each other with a shared x axis and room for a legend at the right.

    `over` is the group id of axes whose curves a page can read.
    """
    total = sum(heights) + 0.28 * len(heights) + 0.42
    figure = style.canvas(total)
    axes: list[Any] = []
    top = total
    for height in heights:
        top -= 0.28
        box = (0.088, (top - height) / total, 0.652, height / total)
        axes.append(figure.add_axes(box, sharex=axes[0] if axes else None, gid=over))
        top -= height
        axes[-1].yaxis.set_label_coords(-0.088, 0.5)
    for ax in axes[:-1]:
        ax.tick_params(labelbottom=False)
    return axes


def rows_of(
    count: int, columns: Sequence[tuple[float, float]], tall: float, above: float, below: float
) -> tuple[Figure, list[Axes]]:
    """Return a figure and its `count` panels, row by row.

    `columns` are left edge and width of each, `tall` is the height of a panel, with room `above` and `below` it [inch].
    """
    height = -(-count // len(columns)) * (above + tall + below)
    figure = style.canvas(height)
    axes = []
    for i in range(count):
        row, column = divmod(i, len(columns))
        left, width = (x / style.WIDTH for x in columns[column])
        bottom = height - row * (above + tall + below) - above - tall
        axes.append(figure.add_axes((left, bottom / height, width, tall / height)))
    return figure, axes


def legend_above(figure: Figure, ax: Axes) -> None:
    """Write the legend of a panel above all panels, in as many columns as fit."""
    handles, texts = ax.get_legend_handles_labels()
    # one row fits below the upper edge; more rows extend above it
    place: dict[str, Any] = {"bbox_to_anchor": (0.07, 1.0 - 0.24 / figure.get_figheight())}
    for count in range(min(len(texts), LEGEND_COLUMNS), 0, -1):
        legend = figure.legend(
            handles, texts, loc="lower left", borderaxespad=0.0, ncols=count, fontsize=8, **place
        )
        if count == 1 or legend.get_window_extent().width <= 0.92 * figure.bbox.width:
            return
        legend.remove()


def draw_curves(ax: Axes, t: Floats, curves: list[Curve], text: str, measure: str) -> None:
    """Draw curves that may coincide: from wide and solid below to narrow and dashed above, with staggered markers.

    The axis is fitted to the sound curves that last to the end, since a run that blew up would hide all others.
    """
    sound = [curve for curve in curves if curve.sound] or curves
    shown = [curve.values for curve in sound if curve.is_whole] or [curve.values for curve in sound]
    scale = Scale.of(shown)
    for i, curve in enumerate(curves):
        x, y = style.thin(t, scale.scaled(curve.values))
        fate = f"\n({curve.fate})" if curve.fate else ""
        look = _look(i, len(curves), x.size)
        if not curve.sound and any(c.sound for c in curves):
            look = {"color": "#a0a0a0", "linewidth": 0.6, "zorder": 1.5}
        ax.plot(x, y, label=curve.label + fate, gid=curve.group, **look)
    stop_at_breakdown(ax, t, [curve.values for curve in curves])
    scale.apply(ax)
    words = style.label(f"|{text}|" if scale.is_log else text, measure, scale.exponent)
    # a long label would extend into the panel below
    ax.set_ylabel(words.replace(f"{text} [", f"{text}\n[") if len(words) > LONG_LABEL else words)
    style.beside(ax)


def stop_at_breakdown(ax: Axes, t: Floats, series: list[Floats]) -> None:
    """End the time axis at the last finite value of all series, with a note if that is not the end of the run."""
    finite = np.flatnonzero(np.any([np.isfinite(values) for values in series], axis=0))
    last = max(int(finite[-1]), 1) if finite.size else t.size - 1
    # a centred formula has no value at the last time
    last = t.size - 1 if last >= t.size - 2 else last
    ax.set_xlim(float(t[0]), float(t[last]))
    if last < t.size - 1:
        note(ax, f"ends with the breakdown, of {t[-1]:g} in all", 0.03)


def fit_values(ax: Axes, shown: list[Floats], *others: Floats) -> None:
    """Fit an axis to values; if they grow without bound, change its lines to sizes on a logarithmic scale."""
    if explosive(shown):
        for line in ax.lines:
            line.set_ydata(style.no_zeros(np.asarray(line.get_ydata(), dtype=np.float64)))
        style.log_axis(ax, "y", *decades(shown))
        note(ax, "size, without the sign", 0.11)
    else:
        ax.set_ylim(*style.limits(*shown, *others))


class Scale(NamedTuple):
    """The vertical scale of series: linear with a power of ten, or logarithmic for growth without bound."""

    series: list[Floats]
    is_log: bool
    exponent: int = 0

    @classmethod
    def of(cls, series: list[Floats]) -> Scale:
        """Return a scale on which the series are readable."""
        is_log = explosive(series)
        return cls(series, is_log, 0 if is_log else style.scale(*series))

    def scaled(self, values: Floats) -> Floats:
        """Return values as the axis shows them."""
        return style.no_zeros(values) if self.is_log else values / 10.0**self.exponent

    def apply(self, ax: Axes, most: int = 7) -> None:
        """Give an axis this scale; a logarithmic one has about `most` labelled ticks."""
        if self.is_log:
            style.log_axis(ax, "y", *decades(self.series), most=most)
        else:
            ax.set_ylim(*style.limits(*map(self.scaled, self.series)))


def explosive(series: list[Floats]) -> bool:
    """Return whether values grow without bound, so that a linear scale would show only the last of them."""
    sizes = _sizes(series)
    typical = min((np.median(s) for s in sizes), default=np.inf)
    return bool(max((s.max() for s in sizes), default=0.0) > LOG_RATIO * typical)


def decades(series: list[Floats]) -> tuple[float, float]:
    """Return limits of a logarithmic axis over growing values, from their initial size.

    Values that are largest before the end did not grow from their initial size, which may be of any smallness.
    """
    sizes = _sizes(series)
    high = min(max(float(s.max()) for s in sizes), style.LARGEST)
    low = min(float(s[:2].max()) for s in sizes)
    if all(np.argmax(s) < STILL_GROWS * s.size for s in sizes):
        low = max(low, DEEPEST * high)
    return max(min(low, high) / 2, style.TINIEST), 2 * high


def _sizes(series: list[Floats]) -> list[Floats]:
    sizes = [np.abs(style.finite(values[values != 0.0])) for values in series]
    return [size for size in sizes if size.size]


def _look(i: int, count: int, points: int) -> dict[str, Any]:
    """Return the look of the i-th line, which leaves earlier ones visible beneath it."""
    part = i / max(1, count - 1)
    stride = max(1, points // 9)
    return {
        "color": style.COLOURS[i],
        "linestyle": style.DASHES[i],
        "linewidth": 4.6 - 3.4 * part if count > 1 else 1.6,
        "alpha": 0.55 + 0.45 * part if count > 1 else 1.0,
        "marker": style.MARKERS[i],
        "markersize": 5.0,
        "markerfacecolor": "white",
        "markeredgewidth": 1.0,
        "markevery": (i * stride // count, stride),
        "zorder": 2 + 0.1 * i,
    }


def comparable(curves: list[Curve]) -> bool:
    """Return whether at least two curves are readable, so that a spread has a meaning."""
    return sum(curve.is_readable for curve in curves) > 1


def draw_spread(ax: Axes, t: Floats, curves: list[Curve], measure: str) -> None:
    """Draw the distance of every readable curve from the finest one; logarithmic if the distances differ much."""
    sound = [i for i, curve in enumerate(curves) if curve.is_readable]
    reference = curves[sound[-1]]
    gaps = {i: curves[i].values - reference.values for i in sound[:-1]}
    shown = list(gaps.values())
    # the quantile ignores end points, which have their own formulas
    typical = [float(np.nanquantile(np.abs(gap), 0.9)) for gap in shown]
    sizes = [size for size in typical if size > 0]
    is_log = bool(sizes) and max(sizes) > LOG_SPREAD * min(sizes)
    scale = Scale(shown, is_log, 0 if is_log else style.scale(*shown))
    for i, gap in gaps.items():
        x, y = style.thin(t, scale.scaled(gap))
        look = _look(i, len(curves), x.size) | {"linewidth": 1.3, "alpha": 1.0, "markersize": 4.0}
        ax.plot(x, y, label=f"_{curves[i].label}", gid=curves[i].group, **look)
    if is_log:
        highest = min(max(map(data.largest, shown)), style.LARGEST)
        style.log_axis(ax, "y", max(0.02 * min(sizes), style.TINIEST), 2 * highest)
    else:
        ax.axhline(0.0, color=style.GREY, linewidth=0.7, zorder=1)
        scale.apply(ax)
    ax.set_ylabel(style.label("|spread|" if is_log else "spread", measure, scale.exponent))
    ax.set_title(f"Spread: distance from {reference.label}", fontweight="normal", fontsize=9)
