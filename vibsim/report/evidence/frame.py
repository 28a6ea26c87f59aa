"""Common parts of the pictures of checks: panels of one size, filled and hollow dots, round ticks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.report import frame, style, words
from vibsim.report.style import Picture
from vibsim.report.types import Axes, Figure

INK, SOFT, BAND = "#1b1b1b", "#555555", "#e4e4e4"
COLOUR, SECOND = style.COLOURS[0], style.COLOURS[1]
LEFT, RIGHT, ABOVE, BELOW, HEIGHT = 0.6, 0.35, 0.2, 0.38, 1.0  # room around a panel, height [inch]
WIDE = 3.3  # width of a panel over time [inch]
SIZE = 8.0  # of the font [point]
MOST_LEVELS = 12  # levels up to which all have a label
FEWEST_TICKS = 2  # on a linear scale: a single number does not show the size of a curve
DASHED: dict[str, Any] = {"color": INK, "linewidth": 0.8, "linestyle": (0, (4, 3))}
ALIKE = np.array([1.0 - 1e-11, 1.0 + 1e-11])
"""Range of growth factors that differ from 1 by rounding only; a scale shows at least this range."""
NEAR_ONE = 0.02  # growth factors that all lie within this distance of 1 are shown minus 1
FACTOR = 3.0  # growth factors beyond this, or below its inverse, have a logarithmic scale


def evidence(caption: str, alt: str = "", figure: Figure | None = None) -> Picture:
    """Return a figure with its caption, or only a caption that says why there is nothing to draw."""
    return Picture("", "", caption, alt, figure)


def panel(figure: Figure, title: str, x_name: str, width: float = 2.5) -> Axes:
    """Add a panel to the right of the panels of a figure, all of one `width` [inch], and return it."""
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    place(figure, LEFT + width + RIGHT, HEIGHT)
    ax.set_title(title, fontsize=SIZE, fontweight="normal")
    ax.set_xlabel(x_name, fontsize=SIZE, color=SOFT)
    ax.tick_params(labelsize=SIZE, color=SOFT, labelcolor=SOFT)
    ax.grid(visible=False)
    round_ticks(ax.xaxis, 5)
    return ax


def place(figure: Figure, pitch: float, height: float) -> None:
    """Arrange the panels of a figure side by side, with their distance `pitch` and their height [inch]."""
    total, high = pitch * len(figure.axes), ABOVE + height + BELOW
    figure.set_size_inches(total, high)
    for i, ax in enumerate(figure.axes):
        left, bottom = (i * pitch + LEFT) / total, BELOW / high
        ax.set_position((left, bottom, (pitch - LEFT - RIGHT) / total, height / high))
        # a fixed position is faster than one that matplotlib computes
        ax.xaxis.set_label_coords(0.5, -0.24 / height)


def round_ticks(axis: Any, most: int = 4) -> None:
    """Put about `most` round numbers on a linear axis, at least `FEWEST_TICKS`."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10], min_n_ticks=FEWEST_TICKS))
    axis.set_major_formatter(FuncFormatter(lambda value, _: words.number(value, "value")))


def scale(ax: Axes, *shown: Floats, is_log: bool = False, margin: float = 0.15) -> None:
    """Fit the vertical axis to values, or a logarithmic one to the positive values, and set its ticks."""
    if is_log:
        style.log_axis(ax, "y", *style.log_limits(*shown, margin=margin), most=5)
        return
    low, high = style.limits(*shown, margin=margin)
    ax.set_ylim(low, high)
    round_ticks(ax.yaxis)
    if words.number(low, "step") == words.number(high, "step"):
        ax.set_yticks([0.5 * (low + high)])  # several ticks would have the same label


def allowed(ax: Axes, low: float, high: float) -> None:
    """Fill the band between two values, which may be infinite, within the frame."""
    bottom, top = ax.get_ylim()
    ax.axhspan(max(low, bottom), min(high, top), color=BAND, linewidth=0.0, zorder=0)


def below(ax: Axes, limit: float) -> None:
    """Draw the limit that a number must stay below."""
    allowed(ax, 0.0, limit)
    ax.axhline(limit, **DASHED)


def points(ax: Axes, x: Sequence[float], y: Floats, counts: Sequence[bool]) -> None:
    """Draw dots, filled if they count, else hollow; those beyond the frame are triangles on its edge."""
    low, high = ax.get_ylim()
    for is_full, face in ((False, "white"), (True, COLOUR)):
        subset = np.array(counts) == is_full
        place, value = np.asarray(x, dtype=np.float64)[subset], y[subset]
        inside = (value >= low) & (value <= high)
        look: dict[str, Any] = {"color": COLOUR, "markerfacecolor": face}
        if inside.any():
            dot: Any = {"markersize": 5.0, "clip_on": False, "zorder": 4}
            ax.plot(place[inside], value[inside], "o", **look, **dot)
        frame.mark_leaving(ax, place, value, each=True, **look)


def level_axis(ax: Axes, levels: Sequence[int], most: int = MOST_LEVELS, extra: str = "") -> None:
    """Label the levels, if there are many every second or third, and with `extra` the position after the last."""
    labels = {float(level): str(level) for level in levels[:: 1 + len(levels) // (most + 1)]}
    labels |= {levels[-1] + 1.0: extra} if extra else {}
    ax.set_xlim(levels[0] - 0.5, levels[-1] + (1.5 if extra else 0.5))
    ax.set_xticks(list(labels), list(labels.values()))


class GrowthScale(NamedTuple):
    """The vertical scale of growth factors."""

    title: str
    less: float = 0.0  # subtracted from each factor
    is_log: bool = False


def growth_scale(factors: Floats) -> GrowthScale:
    """Return a scale that separates positive finite growth factors from each other and from 1."""
    if np.all(np.abs(factors - 1.0) <= NEAR_ONE):
        return GrowthScale("growth per period, less 1", less=1.0)
    is_wide = factors.max() > FACTOR or factors.min() < 1.0 / FACTOR
    return GrowthScale("growth per period", is_log=bool(is_wide))


def usable(values: Floats) -> Floats:
    """Return the positive finite values."""
    return style.finite(values[values > 0.0])


def short(value: float) -> str:
    """Write a number with up to four significant digits, without trailing zeros."""
    return words.number(float(f"{value:.4g}"), "step")


def brief(value: float) -> str:
    """Write a number with two significant digits."""
    return words.number(value, "brief")
