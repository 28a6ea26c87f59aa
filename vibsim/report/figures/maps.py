"""Maps over a grid of two swept parameters: verdict, order, error, period, amplitude, each beside its error bar."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from vibsim.checks.fields import measured
from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import REASONS, SEVERITY, TYPICAL_NORM
from vibsim.report import finest_level, style
from vibsim.report.choice import position, tolerance
from vibsim.report.data import due, exact_periods, norm_unit, of_several, pick, promised_text, whole
from vibsim.report.figures.panels import rows_of
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Grid
from vibsim.report.text import words
from vibsim.report.types import Axes, Experiment, Figure

PANELS_A_ROW = 3
LEFT, WIDE, TALL, GAP = 0.68, 2.52, 2.1, 0.27
"""Left margin, width and height of a panel, gap between panels [inch]."""
ABOVE, BELOW = 0.32, 1.12
"""Room for the title above a panel, for ticks and the scale below it [inch]."""
BORDERED = 400  # most cells that are drawn one by one, with borders; more are one image
MOST_DECADES = 12.0  # most decades that a logarithmic scale spans, from the largest value down
LOG_SPREAD = 20.0
"""Positive values that spread by more than this factor, but for a hundredth, have a logarithmic scale."""
LOG_SPREAD_OF_PERIODS = 5.0  # the same of periods: those of rotation are much shorter
ORDER_RANGE = 0.5  # distance from the promised order at which the colours end
DOT_SPACING = 0.025  # distance between the dots of a separatrix, as part of the panel
SHOWN_ALREADY = ("period", "period_error", "exact_period", "amplitude")
"""Values of checks that have maps of their own."""


@dataclass(frozen=True)
class Panel:
    """One map."""

    title: str
    table: Floats  # shape (y, x) of cells or blocks; NaN where there is nothing
    label: str = ""
    """What the colours mean, with the unit."""
    kind: str = "size"
    """``size`` (dark to light), ``distance`` (around 0, pale within `tolerance`), ``factor`` (around 1), ``code``."""
    tolerance: float = 0.0
    scale: Floats | None = None
    """Values that set the range of the colours, where it is that of another panel."""
    spread: float = LOG_SPREAD
    codes: tuple[tuple[str, str], ...] = ()  # of kind ``code``: text and colour of every number


def verdicts(
    experiment: Experiment, record: Record, grid: Grid, quantity: str, scheme: int
) -> Picture:
    """Draw verdict, order and error of a quantity with the width of their intervals."""
    letter, promise = words.symbol(quantity), due(record, quantity)
    allowed = tolerance(experiment, quantity, record.words("scheme")[scheme])
    panels = [_reasons(record, grid, quantity, scheme)]
    if whole(record, "triple"):
        away = finest_level.deviation(record, quantity)[scheme]
        _, low, high = (part[scheme] for part in finest_level.orders(record, quantity))
        text = f"order of {letter} − {promised_text(record, quantity, scheme)}"
        worst = grid.worst(away, np.abs(away))
        panels += [
            Panel(f"Order against the {promise} one", worst, text, "distance", allowed),
            Panel("Error bar of the order", grid.worst(high - low), "width of the interval"),
            _window(record, grid, quantity, scheme),
        ]
    panels += _errors(record, grid, quantity, scheme)
    several = of_several(record, scheme)
    kinds = {panel.kind for panel in panels}
    pale = (
        f"Pale colours are orders within ± {allowed:g} of the {promise} one, where the scale jumps."
    )
    return _picture(
        grid, panels, f"map_{quantity}_{scheme}",
        f"Where does it converge, how fast, how well? {letter}{several}",
        f"Maps over two swept parameters: verdict on {words.name(quantity)}, its order and its error{several}",
        pale if "distance" in kinds else "",
        "Where estimated over true error is pale, two levels alone tell the error." if "factor" in kinds else "",
    )  # fmt: skip


def motion(experiment: Experiment, record: Record, grid: Grid, scheme: int) -> Picture | None:
    """Draw period and amplitude with their errors; None where no member has either."""
    time, size = (
        finest_level.measured(record, name, position(experiment))
        for name in ("period", "amplitude")
    )
    value, exact = time.value[scheme], exact_periods(record)
    label = style.label("period", time.unit)
    both = {"scale": style.finite(value, exact), "spread": LOG_SPREAD_OF_PERIODS}
    with np.errstate(invalid="ignore", divide="ignore"):
        relative = time.error[scheme] / value
    rows: list[tuple[str, Floats, str, dict[str, Any]]] = []
    if np.isfinite(value).any():
        rows += [
            ("Period", value, label, both),
            ("Exact period", np.where(np.isfinite(exact), exact, np.nan), label, both),
            ("Relative error of the period", finest_level.period_error(record, -1)[scheme], "|period / exact − 1|", {}),
            ("Error bar of the period", relative, "estimated error / period", {}),
        ]  # fmt: skip
    if np.isfinite(size.value[scheme]).any():
        rows += [
            ("Amplitude", size.value[scheme], style.label("amplitude", size.unit), {}),
            ("Error bar of the amplitude", size.error[scheme], style.label("estimated error", size.unit), {}),
        ]  # fmt: skip
    panels = [
        Panel(title, grid.worst(values), text, **more)
        for title, values, text, more in rows
        # what is the same for all members is a number, no map
        if finest_level.varies(values)
    ]
    if not panels:
        return None
    several = of_several(record, scheme)
    bars = (
        f"Numbers of level {whole(record, 'level')[-1]}. The error bars come from the two finest levels alone: "
        "where they agree with the true error, they can be trusted where it is not known."
    )
    return _picture(
        grid, panels, f"map_period_{scheme}", f"Period and amplitude{several}",
        f"Maps of the period, the exact period, the error of the period and the amplitude{several}", bars,
    )  # fmt: skip


def numbers(experiment: Experiment, record: Record, grid: Grid, scheme: int) -> Picture | None:
    """Draw the numbers that checks are about and no other map shows; None where there are none."""
    name, panels = record.words("scheme")[scheme], []
    for check in experiment.checks:
        inner = check.measured
        if inner.kind == "value" and inner.at.case is None and inner.value not in SHOWN_ALREADY:
            values = measured(record, check.id, "value")[scheme]
            if inner.at.scheme in (None, name) and np.isfinite(values).any():
                of = f" of {words.symbol(inner.quantity)}" if inner.quantity else ""
                text = f"{inner.value}{of}".replace("_", " ")
                panels.append(Panel(check.id, grid.worst(values, np.abs(values)), text))
    if not panels:
        return None
    several = of_several(record, scheme)
    return _picture(
        grid, panels, f"map_checks_{scheme}", f"Numbers of the checks{several}",
        f"Maps of the numbers that checks ask for{several}", "Each panel has the name of its check.",
    )  # fmt: skip


def _picture(
    grid: Grid, panels: list[Panel], name: str, title: str, alt: str, *caption: str
) -> Picture:  # fmt: skip
    """Draw panels, and explain what is grey, dotted or gathered in blocks; nothing that is not there."""
    has_gaps = any(not np.isfinite(panel.table).all() for panel in panels)
    text = style.sentences(
        *caption,
        "Grey hatched cells have no such number." if has_gaps else "",
        "The dotted line is the separatrix, where the exact period is infinite." if grid.separatrix[0].size else "",
        grid.note,
    )  # fmt: skip
    return Picture(name, title, text, alt, draw(grid, panels))


def _codes(title: str, grid: Grid, values: Floats, codes: list[tuple[int, str, str]]) -> Panel:
    """Return a map of whole numbers, each with its text, to which its count is added, and colour; the last is worst."""
    place, texts = np.full(values.shape, np.nan), []
    for i, (code, text, colour) in enumerate(codes):
        place[values == code] = i
        count = words.number(int(np.sum(values == code)), "integer")
        texts.append((f"{text} ({count})", colour))
    return Panel(title, grid.worst(place), kind="code", codes=tuple(texts))


def _reasons(record: Record, grid: Grid, quantity: str, scheme: int) -> Panel:
    """Return the map of the reasons of the verdicts; of several members in a cell the worst."""
    reason = pick(record, f"{quantity}_reason", scheme=scheme)
    meanings = record.meanings(f"{quantity}_reason")
    counted = [
        (-int(n), int(code)) for code, n in zip(*np.unique(reason, return_counts=True), strict=True)
    ]
    # the milder first, of equal ones the rarer last
    ranked = sorted(counted, key=lambda row: (SEVERITY[REASONS[meanings[row[1]]]], row[0]))
    named = [(code, meanings[code]) for _, code in ranked]
    codes = [(code, f"{REASONS[word]}: {word}", style.REASON_COLOURS[word]) for code, word in named]
    return _codes("Verdict", grid, reason, codes)


def _window(record: Record, grid: Grid, quantity: str, scheme: int) -> Panel:
    """Return the map of the coarsest level that the stated order rests on."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    first = pick(record, f"{quantity}_window_first", scheme=scheme)
    levels = whole(record, "level")
    shades = zip(levels, np.linspace(1.0, 0.0, len(levels)), strict=True)
    codes = [
        (level, f"from level {level} on", to_hex(colormaps["viridis"](shade)))
        for level, shade in shades
        if np.any(first == level)
    ]
    return _codes("Levels used for the order", grid, first, codes)


def _errors(record: Record, grid: Grid, quantity: str, scheme: int) -> list[Panel]:
    found, level = finest_level.error(record, quantity), whole(record, "level")[-1]
    text = f"{found.kind} error of {words.symbol(quantity)} ({TYPICAL_NORM})"
    text = style.label(text, norm_unit(record, quantity))
    best, estimate = style.positive(found.best[scheme]), found.estimate[scheme]
    panels = [Panel(f"Error on level {level}", grid.worst(best), text)]
    if not np.isfinite(estimate).any():
        return panels
    with np.errstate(invalid="ignore", divide="ignore"):
        if found.kind == "true":
            ratio = style.positive(estimate / found.true[scheme])
            worst, text = grid.worst(ratio, np.abs(np.log(ratio))), "estimated / true error"
            return [*panels, Panel("Can the estimate be trusted?", worst, text, "factor")]
        width = style.positive((found.high - found.low)[scheme] / estimate)
    return [*panels, Panel("Error bar of the error", grid.worst(width), "relative width")]


def draw(grid: Grid, panels: list[Panel]) -> Figure:
    """Return a figure with the panels in rows of three, all over the same two parameters."""
    columns = [(LEFT + i * (WIDE + GAP), WIDE) for i in range(PANELS_A_ROW)]
    figure, axes = rows_of(len(panels), columns, TALL, ABOVE, BELOW)
    for i, (ax, panel) in enumerate(zip(axes, panels, strict=True)):
        image = _cells(ax, grid, panel)
        _frame(ax, grid, panel.title, first=i % PANELS_A_ROW == 0)
        _mark(ax, grid.separatrix)
        if panel.kind == "code":
            _legend(ax, panel)
        elif image is not None:
            box, high = ax.get_position(), figure.get_figheight()
            bar = figure.add_axes((box.x0, box.y0 - 0.62 / high, box.width, 0.11 / high))
            _scale(bar, image, panel)
    return figure


def _cells(ax: Axes, grid: Grid, panel: Panel) -> Any:
    many = panel.table.size > BORDERED
    ax.patch.set(facecolor=style.MISSING, hatch="////", edgecolor="#b4b4b4", linewidth=0.0)
    if not np.isfinite(panel.table).any():
        style.remark(ax, "no value anywhere")
        return None
    cmap, norm = _colours(panel)
    border: Any = {"edgecolors": "none" if many else "#8c8c8c", "linewidth": 0.0 if many else 0.4}
    table = np.ma.masked_invalid(panel.table)
    return ax.pcolormesh(*grid.borders, table, cmap=cmap, norm=norm, **border, rasterized=many)


def _colours(panel: Panel) -> tuple[Any, Any]:
    """Return the colour map of a panel and how values become its numbers."""
    from matplotlib import colormaps
    from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize

    if panel.kind == "code":
        borders = np.arange(len(panel.codes) + 1) - 0.5
        colours = [colour for _, colour in panel.codes]
        return ListedColormap(colours), BoundaryNorm(borders, len(panel.codes))
    if panel.kind == "distance":
        return pale_within(panel.tolerance), Normalize(-ORDER_RANGE, ORDER_RANGE)
    if panel.kind == "factor":
        return colormaps["PuOr"], LogNorm(0.5, 2.0)
    values = style.finite(panel.table if panel.scale is None else panel.scale)
    low, high, logarithmic = limits(values, panel.spread)
    return colormaps["viridis"], (LogNorm if logarithmic else Normalize)(low, high)


def pale_within(tolerance: float) -> Any:
    """Return colours around zero from -ORDER_RANGE to ORDER_RANGE that jump where the tolerance ends."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    x = np.linspace(-ORDER_RANGE, ORDER_RANGE, 401)
    size = np.abs(x)
    inner = 0.10 * size / max(tolerance, 1e-9)
    outer = 0.22 + 0.28 * (size - tolerance) / max(ORDER_RANGE - tolerance, 1e-9)
    place = 0.5 + np.sign(x) * np.where(size <= tolerance, inner, outer)
    return ListedColormap(colormaps["PuOr"](np.clip(place, 0.0, 1.0)))


def limits(values: Floats, spread: float = LOG_SPREAD) -> tuple[float, float, bool]:
    """Return the range of a scale, and whether it is logarithmic: then a hundredth of the values may lie below it."""
    low, high = float(values.min()), float(values.max())
    if low >= 0.0 and high > 0.0:
        usual = max(float(np.quantile(values[values > 0.0], 0.01)), high * 10.0**-MOST_DECADES)
        if high >= spread * usual:
            return usual, high, True
    room = 0.0 if high > low else 0.01 * abs(high) or 1.0
    return low - room, high + room, False


def _frame(ax: Axes, grid: Grid, title: str, first: bool) -> None:
    for which, key, shown in (("x", grid.x, True), ("y", grid.y, first)):
        axis = getattr(ax, f"{which}axis")
        if key.is_log:
            style.log_axis(ax, which, *getattr(ax, f"get_{which}lim")())
        if key.words:
            axis.set_ticks(key.distinct, key.words)
        if shown:
            getattr(ax, f"set_{which}label")(key.label, fontsize=8.5, labelpad=2)
        else:
            axis.set_tick_params(labelleft=False)
    ax.set_title(title, fontsize=9)
    ax.grid(visible=False)
    ax.tick_params(labelsize=7.5)


def _mark(ax: Axes, ridge: tuple[Floats, Floats]) -> None:
    """Draw the separatrix as dots that stand out from light and dark, no two of them closer than `DOT_SPACING`."""
    if not ridge[0].size:
        return
    ends = ax.get_xlim(), ax.get_ylim()
    places = ax.transAxes.inverted().transform(ax.transData.transform(np.column_stack(ridge)))
    kept: list[int] = []
    for i in np.lexsort((places[:, 1], places[:, 0])).tolist():
        if not kept or np.hypot(*(places[kept] - places[i]).T).min() >= DOT_SPACING:
            kept.append(i)
    dot: Any = {"linestyle": "none", "marker": "o", "markeredgewidth": 0.0}
    for size, colour in ((3.0, "white"), (1.6, "black")):
        ax.plot(ridge[0][kept], ridge[1][kept], markersize=size, color=colour, **dot)
    ax.set(xlim=ends[0], ylim=ends[1])


def _legend(ax: Axes, panel: Panel) -> None:
    from matplotlib.patches import Patch

    edge: Any = {"edgecolor": "#404040", "linewidth": 0.4}
    ax.legend(
        handles=[Patch(facecolor=colour, label=text, **edge) for text, colour in panel.codes],
        loc="upper left", bbox_to_anchor=(-0.02, -0.19), ncols=1 if len(panel.codes) <= 4 else 2, fontsize=7.5,
        handlelength=1.2, borderaxespad=0.0, columnspacing=0.8, labelspacing=0.3,
    )  # fmt: skip


def _scale(ax: Axes, image: Any, panel: Panel) -> None:
    """Draw the colour bar below a panel."""
    from matplotlib.ticker import MaxNLocator

    values = style.finite(panel.table)
    low, high = float(image.norm.vmin), float(image.norm.vmax)
    below, above = values.min() < low, values.max() > high
    beyond = "both" if below and above else "min" if below else "max" if above else "neither"
    bar = ax.figure.colorbar(image, cax=ax, orientation="horizontal", extend=beyond)
    bar.set_label(panel.label, fontsize=8.5, labelpad=2)
    bar.ax.tick_params(labelsize=7.5)
    bar.outline.set_linewidth(0.5)
    bar.ax.grid(visible=False)
    if panel.kind == "distance":
        bar.set_ticks([-ORDER_RANGE, -panel.tolerance, 0.0, panel.tolerance, ORDER_RANGE])
        bar.ax.set_xticklabels([f"{x:+g}".replace("-", "−") if x else "0" for x in bar.get_ticks()])
    elif panel.kind == "factor":
        bar.set_ticks([0.5, 0.7, 1.0, 1.4, 2.0], labels=["0.5", "0.7", "1", "1.4", "2"])
        bar.ax.minorticks_off()
    elif type(image.norm).__name__ == "LogNorm":
        style.log_ticks(bar.ax.xaxis, low, high, most=5)
    else:
        bar.ax.xaxis.set_major_locator(MaxNLocator(5))
