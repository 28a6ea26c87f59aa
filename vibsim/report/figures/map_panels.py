"""Panels of a map: a table over two swept parameters as colours, with the scale below it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.report import style
from vibsim.report.data import Floats
from vibsim.report.figures.panels import rows_of
from vibsim.report.sweep_layout import Grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 3
LEFT, WIDE, TALL, GAP = 0.68, 2.52, 2.1, 0.27
"""Left margin, width and height of a panel, gap between panels [inch]."""
ABOVE, BELOW = 0.32, 1.12
"""Room for the title above a panel, for ticks and the scale below it [inch]."""
BORDERED = 400
"""Most cells that are drawn one by one, with borders; more are one image."""
DECADES = 12.0
"""Most decades that a logarithmic scale spans, from the largest value down."""
SPREAD = 20.0
"""Positive values that spread by more than this factor, but for a hundredth, have a logarithmic scale."""


@dataclass(frozen=True)
class Panel:
    """One map."""

    title: str
    table: Floats
    """Shape (y, x) of cells or blocks; NaN where there is nothing."""
    label: str
    """What the colours mean, with the unit."""
    kind: str = "size"
    """``size`` (dark to light), ``distance`` (around 0, pale within `tolerance`), ``factor`` (around 1), ``code``."""
    tolerance: float = 0.0
    scale: Floats | None = None
    """Values that set the range of the colours, where it is that of another panel."""
    spread: float = SPREAD
    codes: tuple[tuple[str, str], ...] = ()
    """Of kind ``code``: text and colour of every number."""

    @property
    def has_gaps(self) -> bool:
        """Whether some cell has no value."""
        return not bool(np.isfinite(self.table).all())


def draw(grid: Grid, panels: list[Panel], ridge: tuple[Floats, Floats]) -> Figure:
    """Return a figure with the panels in rows of three, all over the same two parameters."""
    columns = [(LEFT + i * (WIDE + GAP), WIDE) for i in range(COLUMNS)]
    figure, axes = rows_of(len(panels), columns, TALL, ABOVE, BELOW)
    for i, (ax, panel) in enumerate(zip(axes, panels, strict=True)):
        image = _cells(ax, grid, panel)
        _frame(ax, grid, panel.title, first=i % COLUMNS == 0)
        _mark(ax, ridge)
        if panel.kind == "code":
            _legend(ax, panel)
        elif image is not None:
            box, high = ax.get_position(), figure.get_figheight()
            bar = figure.add_axes((box.x0, box.y0 - 0.62 / high, box.width, 0.11 / high))
            _scale(bar, image, panel)
    return figure


def _cells(ax: Axes, grid: Grid, panel: Panel) -> Any:
    x, y = grid.borders
    many = panel.table.size > BORDERED
    ax.patch.set(facecolor=style.MISSING, hatch="////", edgecolor="#b4b4b4", linewidth=0.0)
    if not np.isfinite(panel.table).any():
        style.remark(ax, "no value anywhere")
        return None
    cmap, norm = _colours(panel)
    return ax.pcolormesh(
        x,
        y,
        np.ma.masked_invalid(panel.table),
        cmap=cmap,
        norm=norm,
        edgecolors="none" if many else "#8c8c8c",
        linewidth=0.0 if many else 0.4,
        rasterized=many,
    )


def _colours(panel: Panel) -> tuple[Any, Any]:
    """Return the colour map of a panel and how values become its numbers."""
    from matplotlib import colormaps
    from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize

    if panel.kind == "code":
        count = len(panel.codes)
        return ListedColormap([c for _, c in panel.codes]), BoundaryNorm(
            np.arange(count + 1) - 0.5, count
        )
    if panel.kind == "distance":
        return _pale_within(panel.tolerance), Normalize(-RANGE, RANGE)
    if panel.kind == "factor":
        return colormaps["PuOr"], LogNorm(0.5, 2.0)
    values = panel.table if panel.scale is None else panel.scale
    low, high, logarithmic = limits(values[np.isfinite(values)], panel.spread)
    return colormaps["viridis"], (LogNorm if logarithmic else Normalize)(low, high)


RANGE = 0.5
"""Distance from the promised order at which the colours end."""


def _pale_within(tolerance: float) -> Any:
    """Return colours around zero from -RANGE to RANGE that jump where the tolerance ends."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    x = np.linspace(-RANGE, RANGE, 401)
    size = np.abs(x)
    inner = 0.10 * size / max(tolerance, 1e-9)
    outer = 0.22 + 0.28 * (size - tolerance) / max(RANGE - tolerance, 1e-9)
    place = 0.5 + np.sign(x) * np.where(size <= tolerance, inner, outer)
    return ListedColormap(colormaps["PuOr"](np.clip(place, 0.0, 1.0)))


def limits(values: Floats, spread: float = SPREAD) -> tuple[float, float, bool]:
    """Return the range of a scale, and whether it is logarithmic: then a hundredth of the values may lie below it."""
    low, high = float(values.min()), float(values.max())
    if low >= 0.0 and high > 0.0:
        usual = max(float(np.quantile(values[values > 0.0], 0.01)), high * 10.0**-DECADES)
        if high >= spread * usual:
            return usual, high, True
    room = 0.0 if high > low else 0.01 * abs(high) or 1.0
    return low - room, high + room, False


def _frame(ax: Axes, grid: Grid, title: str, first: bool) -> None:
    for which, key, shown in (("x", grid.x, True), ("y", grid.y, first)):
        axis = getattr(ax, f"{which}axis")
        if key.is_log:
            ends = getattr(ax, f"get_{which}lim")()
            style.log_axis(ax, which, *ends)
        if key.words:
            axis.set_ticks(key.distinct, key.words)
        if shown:
            getattr(ax, f"set_{which}label")(key.label, fontsize=8.5, labelpad=2)
        else:
            axis.set_tick_params(labelleft=False)
    ax.set_title(title, fontsize=9)
    ax.grid(visible=False)
    ax.tick_params(labelsize=7.5)


APART = 0.025
"""Distance between the dots of a separatrix, as part of the panel."""


def _mark(ax: Axes, ridge: tuple[Floats, Floats]) -> None:
    """Draw the separatrix as dots that stand out from light and dark."""
    if not ridge[0].size:
        return
    ends = ax.get_xlim(), ax.get_ylim()
    places = ax.transAxes.inverted().transform(ax.transData.transform(np.column_stack(ridge)))
    kept = _spaced(places)
    for size, colour in ((3.0, "white"), (1.6, "black")):
        ax.plot(
            ridge[0][kept],
            ridge[1][kept],
            linestyle="none",
            marker="o",
            markersize=size,
            color=colour,
            markeredgewidth=0.0,
        )
    ax.set(xlim=ends[0], ylim=ends[1])


def _spaced(places: Floats) -> list[int]:
    """Return which of the points within a panel to draw, so that no two are closer than `APART`."""
    kept: list[int] = []
    for i in np.lexsort((places[:, 1], places[:, 0])).tolist():
        gaps = np.hypot(*(places[kept] - places[i]).T) if kept else np.ones(1)
        if gaps.min() >= APART:
            kept.append(i)
    return kept


def _legend(ax: Axes, panel: Panel) -> None:
    from matplotlib.patches import Patch

    ax.legend(
        handles=[
            Patch(facecolor=c, edgecolor="#404040", linewidth=0.4, label=t) for t, c in panel.codes
        ],
        loc="upper left",
        bbox_to_anchor=(-0.02, -0.19),
        ncols=1 if len(panel.codes) <= 4 else 2,
        fontsize=7.5,
        handlelength=1.2,
        borderaxespad=0.0,
        columnspacing=0.8,
        labelspacing=0.3,
    )


def _scale(ax: Axes, image: Any, panel: Panel) -> None:
    """Draw the colour bar below a panel."""
    values = panel.table[np.isfinite(panel.table)]
    low, high = float(image.norm.vmin), float(image.norm.vmax)
    ends = {
        (False, False): "neither",
        (True, False): "min",
        (False, True): "max",
        (True, True): "both",
    }
    beyond = ends[bool(values.min() < low), bool(values.max() > high)]
    bar = ax.figure.colorbar(image, cax=ax, orientation="horizontal", extend=beyond)
    bar.set_label(panel.label, fontsize=8.5, labelpad=2)
    bar.ax.tick_params(labelsize=7.5)
    bar.outline.set_linewidth(0.5)
    bar.ax.grid(visible=False)
    if panel.kind == "distance":
        bar.set_ticks([-RANGE, -panel.tolerance, 0.0, panel.tolerance, RANGE])
        bar.ax.set_xticklabels([f"{x:+g}".replace("-", "−") if x else "0" for x in bar.get_ticks()])
    elif panel.kind == "factor":
        bar.set_ticks([0.5, 0.7, 1.0, 1.4, 2.0], labels=["0.5", "0.7", "1", "1.4", "2"])
        bar.ax.minorticks_off()
    elif type(image.norm).__name__ == "LogNorm":
        style.log_ticks(bar.ax.xaxis, low, high, most=5)
    else:
        from matplotlib.ticker import MaxNLocator

        bar.ax.xaxis.set_major_locator(MaxNLocator(5))
