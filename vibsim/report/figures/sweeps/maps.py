"""Maps over a grid of two swept parameters: verdict, order, error, period, amplitude, and the error bar of each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import REASONS, SEVERITY
from vibsim.report import finest_level, style, words
from vibsim.report.choice import tolerance
from vibsim.report.data import Results
from vibsim.report.figures.sweeps import view
from vibsim.report.figures.sweeps.view import View, Worst
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Grid
from vibsim.report.types import Axes, Figure

LEFT, WIDE, TALL, ABOVE, BELOW = 0.8, 5.4, 3.4, 0.32, 0.5
"""Left margin, width and height of a map, room above and below it [inch]."""
BAR = 0.14  # width of the colour bar, and half of the gap before it [inch]
BORDERED = 400  # most cells that are drawn one by one, with borders; more are one image
MOST_DECADES = 12.0  # of a logarithmic scale, from the largest value down
LOG_SPREAD = 20.0  # largest value over the 1 % quantile above which a scale is logarithmic
LOG_SPREAD_OF_PERIODS = 5.0  # the same for periods: those of rotation are much shorter
ORDER_RANGE = 0.5  # distance from the formal order at the ends of the colours
DOT_SPACING = 0.025  # smallest distance of the dots of a separatrix, as a fraction of the panel


@dataclass(frozen=True)
class Map:
    """One number of every member of a scheme."""

    stem: str
    name: str
    quantity: str
    values: Floats  # shape (case,); NaN if a member has no such number
    label: str = ""  # meaning of the colours, with the unit
    unit: str = ""
    caption: str = ""
    kind: str = "size"
    """``size`` (dark to light), ``distance`` (around 0, pale within `tolerance`), ``factor`` (around 1), ``code``."""
    tolerance: float = 0.0
    spread: float = LOG_SPREAD
    codes: tuple[tuple[str, str], ...] = ()  # of kind ``code``: text and colour of every number
    number: Floats | None = None  # the number, if the map shows its distance from another one
    shared: str | None = None
    """The sentence if all members share the value, else empty; None to derive it from the values."""


def views(
    record: Results, grid: Grid, quantities: list[str], worst: Worst, schemes: range
) -> Iterator[View | str]:  # fmt: skip
    """Yield a map of each number of each scheme, or a sentence if all members share it."""
    for scheme in schemes:
        several = record.of_several(scheme)
        for shown in _maps(record, quantities, scheme):
            text = shown.shared
            if text is None:
                text = view.shared(shown.name, shown.values, shown.unit)
            if text:
                yield f"{text}{several}"
            elif np.isfinite(shown.values).any():
                yield _view(record, grid, shown, scheme, worst(shown.quantity).case)


def _maps(record: Results, names: list[str], scheme: int) -> Iterator[Map]:
    """Yield the maps of a scheme: of the motion (a conservative one by its period first) and of each quantity."""
    both = [_period, _amplitude]
    for draw_motion in both if record.model.conservative else both[::-1]:
        yield from draw_motion(record, scheme)
    for quantity in names:
        yield from _order(record, quantity, scheme)
        yield from _errors(record, quantity, scheme)
    for name, text, check in view.value_checks(record):
        values, unit = view.of_check(record, name, check)[scheme], record.unit_of_number(check)
        yield Map(
            f"check_{name}", text, record.model.position, values, style.label(text, unit), unit,
            caption="The number that a check asks for.",
        )  # fmt: skip


def _period(record: Results, scheme: int) -> Iterator[Map]:
    time, exact = finest_level.measured(record, "period"), record.exact_periods
    quantity = record.model.position
    value, exact = time.value[scheme], np.where(np.isfinite(exact), exact, np.nan)
    if not np.isfinite(value).any():
        return
    label, caption = style.label("period", time.unit), _finest_level(record)
    with np.errstate(invalid="ignore", divide="ignore"):
        bar = time.error[scheme] / value
    error = finest_level.period_error(record, -1)[scheme]
    spread = LOG_SPREAD_OF_PERIODS
    yield Map("period", "period", quantity, value, label, time.unit, caption, spread=spread)
    name, text = "error of the period", "|period / exact − 1|"
    yield Map("period_error", name, quantity, error, text, caption=caption)
    trust = "From the two finest levels alone. Where it agrees with the error, it can be trusted."
    name, text = "error bar of the period", "estimated error / period"
    yield Map("period_bar", name, quantity, bar, text, caption=trust)
    label = f"exact {label}"
    yield Map("period_exact", "exact period", quantity, exact, label, time.unit, spread=spread)


def _finest_level(record: Results) -> str:
    return f"Of level {record.levels[-1]}."


def _amplitude(record: Results, scheme: int) -> Iterator[Map]:
    size, quantity = finest_level.measured(record, "amplitude"), record.model.position
    value, bar = size.value[scheme], size.error[scheme]
    if not np.isfinite(value).any():
        return
    label, caption = style.label("amplitude", size.unit), _finest_level(record)
    yield Map("amplitude", "amplitude", quantity, value, label, size.unit, caption)
    text = style.label("estimated error", size.unit)
    yield Map("amplitude_bar", "error bar of the amplitude", quantity, bar, text, size.unit)


def _order(record: Results, quantity: str, scheme: int) -> Iterator[Map]:
    """Yield the verdict on a quantity, its order, and the width of the interval."""
    letter = words.symbol(quantity)
    if f"{quantity}_reason" in record:
        yield _reasons(record, quantity, scheme)
    if not record.triples:
        return
    allowed = tolerance(record, quantity, record.schemes[scheme])
    order, low, high = (part[scheme] for part in record.stated_orders(quantity))
    away = order - record.formal_orders(quantity)[scheme]
    yield Map(
        f"{quantity}_order", f"order of {letter}", quantity, away,
        f"order of {letter} − {record.promised_text(quantity, scheme)}", kind="distance",
        tolerance=allowed, number=order, shared=view.shared(f"order of {letter}", order, form="order"),
        caption=f"Pale colours are orders within ± {allowed:g} of the {record.basis_of_order(quantity)} one, "
        "where the scale jumps.",
    )  # fmt: skip
    text = "width of the interval"
    yield Map(f"{quantity}_bar", f"error bar of the order of {letter}", quantity, high - low, text)


def _errors(record: Results, quantity: str, scheme: int) -> Iterator[Map]:
    """Yield the error of the finest level and the quality of its estimate."""
    error, letter = finest_level.error(record, quantity), words.symbol(quantity)
    unit = record.norm_unit(quantity)
    text = style.label(f"{error.kind} error of {letter} ({words.USUAL_NORM})", unit)
    best, estimate = style.positive(error.best[scheme]), error.estimate[scheme]
    yield Map(
        f"{quantity}_error", f"error of {letter}", quantity, best, text, unit, _finest_level(record)
    )
    if not np.isfinite(estimate).any():
        return
    with np.errstate(invalid="ignore", divide="ignore"):
        if error.kind == "true":
            ratio = style.positive(estimate / error.true[scheme])
            yield Map(
                f"{quantity}_trust", f"estimated over true error of {letter}", quantity, ratio,
                "estimated / true error", kind="factor",
                caption="Where it is pale, two levels alone tell the error.",
            )  # fmt: skip
            return
        width = style.positive((error.high - error.low)[scheme] / estimate)
    name = f"error bar of the error of {letter}"
    yield Map(f"{quantity}_error_bar", name, quantity, width, "relative width")


def _reasons(record: Results, quantity: str, scheme: int) -> Map:
    """Return the map of the reasons of the verdicts; a cell shows its worst member."""
    reason = record.pick(f"{quantity}_reason", scheme=scheme)
    meanings = record.meanings(f"{quantity}_reason")
    found, counts = (part.tolist() for part in np.unique(reason, return_counts=True))
    named = [(code, meanings[code], count) for code, count in zip(found, counts, strict=True)]
    # by severity, then the rarer last
    named.sort(key=lambda row: (SEVERITY[REASONS[row[1]]], -row[2]))
    positions, codes = np.full(reason.shape, np.nan), []
    for i, (code, word, number) in enumerate(named):
        positions[reason == code] = i
        text = f"{REASONS[word]}: {word} ({words.number(number, 'integer')})"
        codes.append((text, style.REASON_COLOURS[word]))
    return Map(
        f"{quantity}_verdict", f"verdict on {words.title(quantity)}", quantity, positions, kind="code",
        codes=tuple(codes), shared=view.shared_verdict(record, quantity, scheme),
    )  # fmt: skip


def _view(record: Results, grid: Grid, shown: Map, scheme: int, worst: int) -> View:
    """Draw a map; the caption explains grey cells, dots and blocks, if there are any."""
    # of several members a cell shows the one that is farthest from 0, or from the factor 1
    size = np.log(shown.values) if shown.kind == "factor" else shown.values
    table = grid.worst(shown.values, np.abs(size))
    figure = draw(grid, shown, table)
    ax, several = figure.axes[0], record.of_several(scheme)
    is_ringed = view.ring(ax, float(grid.x.values[worst]), float(grid.y.values[worst]), on_map=True)
    title = f"{words.capitalized(shown.name)}{several}"
    text = style.sentences(
        shown.caption,
        "Grey hatched cells have no such number." * (not np.isfinite(table).all()),
        "The dotted line is the separatrix, where the exact period is infinite."
        * bool(grid.separatrix[0].size),
        grid.note,
    )
    number = shown.values if shown.number is None else shown.number
    values = None if shown.kind == "code" else number[None]
    return View(
        shown.name, Picture(f"map_{shown.stem}_{scheme}", title, text, f"{title} over two swept parameters", figure),
        shown.quantity, values, None, shown.unit, (scheme,), several.removeprefix(", "), ((0, 1),),
        worst if is_ringed else None,
    )  # fmt: skip


def draw(grid: Grid, shown: Map, table: Floats) -> Figure:
    """Return a figure with one map and its scale or legend at the right."""
    height = ABOVE + TALL + BELOW
    figure = style.canvas(height)
    box = (LEFT / style.WIDTH, BELOW / height, WIDE / style.WIDTH, TALL / height)
    ax = figure.add_axes(box, gid=style.MEMBER)
    image = _cells(ax, grid, shown, table)
    _frame(ax, grid, shown.label or shown.name)
    _mark(ax, grid.separatrix)
    if shown.kind == "code":
        _legend(ax, shown)
    elif image is not None:
        left = (LEFT + WIDE + 2 * BAR) / style.WIDTH
        bar = figure.add_axes((left, box[1], BAR / style.WIDTH, box[3]))
        _scale(bar, image, shown, table)
    return figure


def _cells(ax: Axes, grid: Grid, shown: Map, table: Floats) -> Any:
    many = table.size > BORDERED
    ax.patch.set(facecolor=style.MISSING, hatch="////", edgecolor="#b4b4b4", linewidth=0.0)
    if not np.isfinite(table).any():
        style.remark(ax, "no value anywhere")
        return None
    cmap, norm = _colours(shown, table)
    border: Any = {"edgecolors": "none" if many else "#8c8c8c", "linewidth": 0.0 if many else 0.4}
    masked = np.ma.masked_invalid(table)
    return ax.pcolormesh(*grid.borders, masked, cmap=cmap, norm=norm, **border, rasterized=many)


def _colours(shown: Map, table: Floats) -> tuple[Any, Any]:
    from matplotlib import colormaps
    from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize

    if shown.kind == "code":
        borders = np.arange(len(shown.codes) + 1) - 0.5
        colours = [colour for _, colour in shown.codes]
        return ListedColormap(colours), BoundaryNorm(borders, len(shown.codes))
    if shown.kind == "distance":
        return pale_within(shown.tolerance), Normalize(-ORDER_RANGE, ORDER_RANGE)
    if shown.kind == "factor":
        return colormaps["PuOr"], LogNorm(0.5, 2.0)
    low, high, logarithmic = limits(style.finite(table), shown.spread)
    return colormaps["viridis"], (LogNorm if logarithmic else Normalize)(low, high)


def pale_within(tolerance: float) -> Any:
    """Return colours from -ORDER_RANGE to ORDER_RANGE that are pale within the tolerance and jump at its ends."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    x = np.linspace(-ORDER_RANGE, ORDER_RANGE, 401)
    size = np.abs(x)
    inner = 0.10 * size / max(tolerance, 1e-9)
    outer = 0.22 + 0.28 * (size - tolerance) / max(ORDER_RANGE - tolerance, 1e-9)
    place = 0.5 + np.sign(x) * np.where(size <= tolerance, inner, outer)
    return ListedColormap(colormaps["PuOr"](np.clip(place, 0.0, 1.0)))


def limits(values: Floats, spread: float = LOG_SPREAD) -> tuple[float, float, bool]:
    """Return the range of a scale, and whether it is logarithmic; then 1 % of the values may lie below it."""
    low, high = float(values.min()), float(values.max())
    if low >= 0.0 and high > 0.0:
        bottom = max(float(np.quantile(values[values > 0.0], 0.01)), high * 10.0**-MOST_DECADES)
        if high >= spread * bottom:
            return bottom, high, True
    room = 0.0 if high > low else 0.01 * abs(high) or 1.0
    return low - room, high + room, False


def _frame(ax: Axes, grid: Grid, title: str) -> None:
    for which, key in (("x", grid.x), ("y", grid.y)):
        if key.is_log:
            style.log_axis(ax, which, *getattr(ax, f"get_{which}lim")())
        if key.words:
            getattr(ax, f"{which}axis").set_ticks(key.distinct, key.words)
        getattr(ax, f"set_{which}label")(key.label)
    ax.set_title(words.capitalized(title))
    ax.grid(visible=False)


def _mark(ax: Axes, ridge: tuple[Floats, Floats]) -> None:
    """Draw the separatrix as dots that are visible on light and dark, `DOT_SPACING` apart."""
    if not ridge[0].size:
        return
    ends = ax.get_xlim(), ax.get_ylim()
    places = ax.transAxes.inverted().transform(ax.transData.transform(np.column_stack(ridge)))
    chosen: list[int] = []
    for i in np.lexsort((places[:, 1], places[:, 0])).tolist():
        if not chosen or np.hypot(*(places[chosen] - places[i]).T).min() >= DOT_SPACING:
            chosen.append(i)
    dot: Any = {"linestyle": "none", "marker": "o", "markeredgewidth": 0.0}
    for size, colour in ((3.0, "white"), (1.6, "black")):
        ax.plot(ridge[0][chosen], ridge[1][chosen], markersize=size, color=colour, **dot)
    ax.set(xlim=ends[0], ylim=ends[1])


def _legend(ax: Axes, shown: Map) -> None:
    from matplotlib.patches import Patch

    edge: Any = {"edgecolor": "#404040", "linewidth": 0.4}
    handles = [Patch(facecolor=colour, label=text, **edge) for text, colour in shown.codes]
    ax.legend(handles=handles[::-1], **style.BESIDE, handlelength=1.2)  # the worst on top


def _scale(ax: Axes, image: Any, shown: Map, table: Floats) -> None:
    from matplotlib.ticker import MaxNLocator

    values = style.finite(table)
    low, high = float(image.norm.vmin), float(image.norm.vmax)
    below, above = values.min() < low, values.max() > high
    extend = "both" if below and above else "min" if below else "max" if above else "neither"
    bar = ax.figure.colorbar(image, cax=ax, extend=extend)
    bar.outline.set_linewidth(0.5)
    bar.ax.grid(visible=False)
    if shown.kind == "distance":
        bar.set_ticks([-ORDER_RANGE, -shown.tolerance, 0.0, shown.tolerance, ORDER_RANGE])
        bar.ax.set_yticklabels([f"{x:+g}".replace("-", "−") if x else "0" for x in bar.get_ticks()])
    elif shown.kind == "factor":
        bar.set_ticks([0.5, 0.7, 1.0, 1.4, 2.0], labels=["0.5", "0.7", "1", "1.4", "2"])
        bar.ax.minorticks_off()
    elif type(image.norm).__name__ == "LogNorm":
        style.log_ticks(bar.ax.yaxis, low, high, most=5)
    else:
        bar.ax.yaxis.set_major_locator(MaxNLocator(5))
