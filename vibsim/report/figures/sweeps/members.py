"""The distribution of numbers and verdicts over the members of a sweep: histograms, and each number against each key.

Few members are points; many are counted in cells, which limits the size of the page.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import SEVERITY
from vibsim.report import data, finest_level, style, words
from vibsim.report.choice import position, tolerance
from vibsim.report.data import bin_of, flags, norm_unit, of_several, promised_text, whole
from vibsim.report.figures.panels import rows_of
from vibsim.report.figures.sweeps.view import View, Worst, by_scheme, key_axis, ring, shared
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Key, bins
from vibsim.report.types import Axes, Experiment
from vibsim.report.words import power

Masks = dict[str, Flags]
"""Status to the members that have it, shape (case,)."""
FEWEST_MEMBERS, BARS = 60, 50  # fewest members and number of bars of a histogram
MOST_ROWS = 6  # most schemes with a row of histograms
MOST_PANELS = 6  # most keys with a panel; the table of members has all
MOST_POINTS = 4000  # most members that are drawn as points
ORDER_FRAME = 1.5  # distance from the formal order at the edges of the frame
SHARES = 24  # most bars of shares along a key
MESH = 160, 60  # cells in which members are counted, across and up


def histograms(experiment: Experiment, record: Record, quantity: str) -> Picture | None:
    """Draw the distributions of order, error and period error, one row per scheme; None for few members."""
    if len(record["case"]) < FEWEST_MEMBERS:
        return None
    schemes, letter = record.words("scheme")[:MOST_ROWS], words.symbol(quantity)
    error, away = finest_level.error(record, quantity), finest_level.deviation(record, quantity)
    period = finest_level.period_error(record, -1)
    has_period = quantity == position(experiment) and bool(np.isfinite(period).any())
    size = style.label(f"{error.kind} error", norm_unit(record, quantity))
    count = 3 if has_period else 2
    columns = [(0.68 + 2.83 * i, 2.45) for i in range(count)]
    figure, axes = rows_of(len(schemes) * count, columns, 1.5, 0.36, 0.56)
    status = flags(record, f"{quantity}_status")
    missing = 0
    level = whole(record, "level")[-1]
    for s, scheme in enumerate(schemes):
        allowed, several = tolerance(experiment, quantity, scheme), of_several(record, s)
        axis_label = f"order − {promised_text(record, quantity, s)}"
        drawn = (
            (f"Order of {letter}{several}", axis_label, away[s], (-allowed, allowed)),
            (f"Error of {letter}, level {level}", size, error.best[s], None),
            ("Error of the period", "|period / exact − 1|", period[s], None),
        )
        row = axes[s * count : (s + 1) * count]
        row[0].set_ylabel("members")
        for ax, (title, label, values, band) in zip(row, drawn[:count], strict=True):
            ax.set_title(title, fontsize=9)
            ax.set_xlabel(label, fontsize=8.5, labelpad=2)
            missing += _histogram(ax, values, status[s], band)
    counts = {word: int(np.sum(status == word)) for word in SEVERITY}
    texts = {word: f"{word} ({words.number(n, 'integer')})" for word, n in counts.items() if n}
    _legend(axes[0], texts, handlelength=1.0, loc="upper left", borderaxespad=0.2)
    return Picture(
        name=f"spread_{quantity}",
        title=f"How the members are spread: {letter}",
        caption="Histograms of the members. The counts are on a logarithmic scale, so that a single member is seen; "
        "the colour is the verdict on the order. A few far from the rest are the ones to look at."
        + (" Members without the number are left out." if missing else ""),
        alt=f"Histograms of the order and the error of {words.name(quantity)} over the members",
        figure=figure,
    )


def _legend(ax: Axes, texts: dict[str, str], **place: Any) -> None:
    """Draw the legend of the colours of verdicts, with a text for each."""
    from matplotlib.patches import Patch

    handles = [Patch(color=style.STATUS_COLOURS[word], label=text) for word, text in texts.items()]
    ax.legend(handles=handles, fontsize=7, **place)


def _histogram(
    ax: Axes, values: Floats, status: NDArray[Any], band: tuple[float, float] | None
) -> int:
    """Draw a histogram stacked by verdict, logarithmic without a band; return the number of members without a value."""
    usable = np.isfinite(values) & (values > 0.0 if band is None else True)
    ax.tick_params(labelsize=7.5)
    if not usable.any():
        style.remark(ax, "no such number")
        return values.size
    if band is None:
        low, high = float(values[usable].min()), min(float(values[usable].max()), style.LARGEST)
        borders = np.geomspace(max(low, high * 1e-18, style.TINIEST) / 1.2, high * 1.2, BARS + 1)
        style.log_axis(ax, "x", float(borders[0]), float(borders[-1]))
    else:
        borders = np.linspace(*style.limits(values[usable], np.array(band)), BARS + 1)
        ax.axvspan(*band, **style.ALLOWED)
    base = np.zeros(BARS)
    for word in reversed(tuple(SEVERITY)):
        count = np.histogram(values[usable & (status == word)], borders)[0]
        if count.any():
            colour = style.STATUS_COLOURS[word]
            ax.stairs(base + count, borders, baseline=base, fill=True, color=colour)
        base = base + count
    style.log_axis(ax, "y", 0.7, 2.0 * max(float(base.max()), 1.0))
    return int(np.sum(~usable))


def views(
    experiment: Experiment, record: Record, keys: list[Key], quantities: list[str], worst: Worst, schemes: range
) -> Iterator[View | str]:  # fmt: skip
    """Yield order, error and verdict of each quantity of each scheme against every swept key."""
    for scheme in schemes:
        for quantity in quantities:
            if f"{quantity}_status" in record:
                draw = _Projection(record, keys, quantity, scheme, worst(quantity).case)
                yield from draw.order(
                    tolerance(experiment, quantity, record.words("scheme")[scheme])
                )
                yield from draw.error()
                yield draw.shares()


@dataclass(frozen=True)
class _Projection:
    """Views of a quantity of one scheme against every swept key."""

    record: Record
    keys: list[Key]
    quantity: str
    scheme: int
    worst: int

    @property
    def masks(self) -> Masks:
        """The members with each status."""
        status = flags(self.record, f"{self.quantity}_status")[self.scheme]
        return {word: status == word for word in SEVERITY}

    def order(self, allowed: float) -> Iterator[View | str]:
        """Yield the order, stated or estimated, minus the formal one."""
        record, quantity = self.record, self.quantity
        name = f"order of {words.symbol(quantity)}"
        order = finest_level.orders(record, quantity)[0]
        away = finest_level.deviation(record, quantity)[self.scheme]
        if not np.isfinite(away).any():
            return
        if text := shared(name, order[self.scheme], form="order"):
            yield f"{text}{of_several(record, self.scheme)}"
            return

        def draw(ax: Axes, key: Key) -> None:
            ax.axhspan(-allowed, allowed, **style.ALLOWED)
            _draw_members(ax, key, away, self.masks, (-ORDER_FRAME, ORDER_FRAME))

        label = f"{name} − {promised_text(record, quantity, self.scheme)}"
        edge_note = "Orders beyond the frame are drawn at its edge, members without an order at the lower edge."
        leaves = not np.all(np.abs(away) < ORDER_FRAME)
        band = f"Grey: the tolerance around the {data.basis_of_order(record, quantity)} order."
        places = np.clip(np.nan_to_num(away, nan=-ORDER_FRAME), -ORDER_FRAME, ORDER_FRAME)
        explanation = style.sentences(band, edge_note * leaves)
        yield self._view("order", name, label, draw, explanation, order, places)

    def error(self) -> Iterator[View | str]:
        """Yield the error of the finest level."""
        from matplotlib.ticker import FuncFormatter, MaxNLocator

        error = finest_level.error(self.record, self.quantity)
        unit = norm_unit(self.record, self.quantity)
        name = f"error of {words.symbol(self.quantity)}"
        size = np.log10(style.positive(error.best[self.scheme]))
        if not np.isfinite(size).any():
            return

        def draw(ax: Axes, key: Key) -> None:
            _draw_members(ax, key, size, self.masks, None)
            # the axis shows logarithms
            ax.yaxis.set_major_locator(MaxNLocator(5, integer=True))
            ax.yaxis.set_major_formatter(FuncFormatter(lambda y, _: power(round(y))))

        explanation = f"Of level {whole(self.record, 'level')[-1]}."
        label = style.label(f"{error.kind} {name}", unit)
        yield self._view("error", name, label, draw, explanation, error.best, size, unit)

    def shares(self) -> View:
        """Return the shares of the verdicts among the members near each value of a key."""
        explanation = (
            "Shares of the verdicts near a value. A key whose shares do not vary does not matter."
        )
        name = f"verdict on {words.symbol(self.quantity)}"
        return self._view(
            "verdict", name, "share", partial(_draw_shares, masks=self.masks), explanation, None, None
        )  # fmt: skip

    def _view(
        self, kind: str, name: str, label: str, draw: Callable[[Axes, Key], None], explanation: str,
        values: Floats | None, place: Floats | None, unit: str = "",
    ) -> View:  # fmt: skip
        """Draw a panel for each key, and mark the worst member."""
        record, rings = self.record, []
        columns = [(0.72 + 2.9 * i, 2.35) for i in range(3)]
        axes = rows_of(min(len(self.keys), MOST_PANELS), columns, 1.9, 0.3, 0.5)[1]
        for i, (ax, key) in enumerate(zip(axes, self.keys, strict=False)):
            draw(ax, key)
            key_axis(ax, key, 0.02, fontsize=8.5, labelpad=2)
            ax.tick_params(labelsize=7.5)
            if i == 0:
                texts = {word: word for word, chosen in self.masks.items() if chosen.any()}
                above: Any = {"loc": "lower left", "bbox_to_anchor": (0.0, 0.99), "ncols": 3}
                above |= {"borderaxespad": 0.1, "handlelength": 0.9, "columnspacing": 0.8}
                _legend(ax, texts, **above)
            if i % 3 == 0:
                ax.set_ylabel(label, fontsize=8.5)
            if place is not None:
                ax.set_gid(style.MEMBER)
                rings.append(ring(ax, float(key.values[self.worst]), float(place[self.worst])))
        several, more = of_several(record, self.scheme), len(self.keys) - len(axes)
        text = style.sentences(
            "Each panel shows all members against one swept key, whatever the others are.",
            explanation,
            "Darker cells hold more members; FAIL lies over INCONCLUSIVE over PASS."
            * (len(record["case"]) > MOST_POINTS and place is not None),
            f"{more} more keys are not shown; the table of members has them." * (more > 0),
        )
        title, figure = f"{words.capitalized(name)}{several}", axes[0].get_figure(root=True)
        stem = f"projections_{self.quantity}_{kind}_{self.scheme}"
        places = None if place is None else by_scheme(record, self.scheme, place)
        return View(
            name, Picture(stem, title, text, f"{title} against every swept key", figure), self.quantity, values,
            places, unit, schemes=(self.scheme,), of=several.removeprefix(", "),
            panels=tuple((i, None) for i in range(len(axes))), worst=self.worst if any(rings) else None,
        )  # fmt: skip


def _draw_members(
    ax: Axes, key: Key, values: Floats, masks: Masks, ends: tuple[float, float] | None
) -> None:
    """Draw a number of every member by verdict; values beyond `ends`, and NaN, are drawn at the edge."""
    low, high = ends or style.limits(values)
    inside = np.clip(np.where(np.isnan(values), low, values), low, high)
    room, many = 0.06 * (high - low), values.size > 500
    for word, members in masks.items():
        colour = style.STATUS_COLOURS[word]
        if values.size <= MOST_POINTS:
            dot: Any = {"linestyle": "none", "marker": style.STATUS_MARKERS[word], "color": colour}
            dot |= {"markersize": 2.6 if many else 4.0, "markeredgewidth": 0.0, "rasterized": many}
            ax.plot(key.values[members], inside[members], **dot)
        elif members.any():
            up = np.linspace(low - room, high + room, MESH[1] + 1)
            _draw_counts(ax, replace(key, values=key.values[members]), inside[members], colour, up)
    ax.set_ylim(low - room, high + room)
    ax.grid(visible=False, axis="both" if values.size > MOST_POINTS else "x")


def _draw_counts(ax: Axes, key: Key, values: Floats, colour: str, up: Floats) -> None:
    """Draw the number of members in each cell: the more, the darker."""
    from matplotlib.colors import LinearSegmentedColormap, LogNorm, to_rgb

    across = bins(key, MESH[0])
    column, row = bin_of(across, key.values), bin_of(up, values)
    width = across.size - 1
    count = np.bincount(row * width + column, minlength=MESH[1] * width).astype(np.float64)
    pale, dark = (tuple(0.5 * tone + 0.5 * grey for tone in to_rgb(colour)) for grey in (1.0, 0.0))
    shades = LinearSegmentedColormap.from_list("", [pale, to_rgb(colour), dark])
    table = np.ma.masked_equal(count.reshape(MESH[1], width), 0.0)
    norm = LogNorm(1.0, max(float(count.max()), 2.0))
    ax.pcolormesh(across, up, table, cmap=shades, norm=norm, rasterized=True)


def _draw_shares(ax: Axes, key: Key, masks: Masks) -> None:
    """Draw stacked bars along a key: the shares of the verdicts."""
    borders = bins(key, SHARES)
    place, count = bin_of(borders, key.values), borders.size - 1
    total, base = np.bincount(place, minlength=count), np.zeros(count)
    for word, chosen in masks.items():
        with np.errstate(invalid="ignore"):
            share = np.nan_to_num(np.bincount(place[chosen], minlength=count) / total)
        ax.bar(
            borders[:-1], share, width=np.diff(borders), bottom=base, align="edge", edgecolor="white", linewidth=0.3,
            color=style.STATUS_COLOURS[word], label=word,
        )  # fmt: skip
        base = base + share
    ax.set_ylim(0.0, 1.0)
    ax.set_yticks([0.0, 0.5, 1.0], ["0", "½", "1"])
    ax.grid(visible=False)
