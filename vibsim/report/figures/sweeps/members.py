"""Order and error of the members of a sweep against each of its keys, coloured by the verdict.

Few members are points; many are counted in cells, which limits the size of the page.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.core.vocabulary import SEVERITY
from vibsim.report import finest_level, style, words
from vibsim.report.choice import tolerance
from vibsim.report.data import Results, bin_of
from vibsim.report.figures.panels import rows_of
from vibsim.report.figures.sweeps.view import View, Worst, key_axis, ring, shared
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Key, bins
from vibsim.report.types import Axes
from vibsim.report.words import power

Masks = dict[str, Flags]  # status to the members that have it, shape (case,)
MOST_PANELS = 6  # most keys with a panel; the table of members has all
MOST_POINTS = 4000  # most members that are drawn as points
ORDER_FRAME = 1.5  # distance from the formal order at the edges of the frame
MESH = 160, 60  # cells in which members are counted, across and up


def _legend(ax: Axes, verdicts: list[str]) -> None:
    from matplotlib.patches import Patch

    handles = [Patch(color=style.STATUS_COLOURS[word], label=word) for word in verdicts]
    ax.legend(
        handles=handles, fontsize=7, loc="lower left", bbox_to_anchor=(0.0, 0.99), ncols=3, borderaxespad=0.1,
        handlelength=0.9, columnspacing=0.8,
    )  # fmt: skip


def views(
    record: Results, keys: list[Key], quantities: list[str], worst: Worst, schemes: range
) -> Iterator[View | str]:  # fmt: skip
    """Yield order and error of each quantity of each scheme against every swept key."""
    for scheme in schemes:
        for quantity in quantities:
            if f"{quantity}_status" in record:
                draw = _Projection(record, keys, quantity, scheme, worst(quantity).case)
                yield from draw.order(tolerance(record, quantity, record.schemes[scheme]))
                yield from draw.error()


@dataclass(frozen=True)
class _Projection:
    """Views of a quantity of one scheme against every swept key."""

    record: Results
    keys: list[Key]
    quantity: str
    scheme: int
    worst: int

    @property
    def masks(self) -> Masks:
        """The members with each status."""
        status = self.record.flags(f"{self.quantity}_status")[self.scheme]
        return {word: status == word for word in SEVERITY}

    def order(self, allowed: float) -> Iterator[View | str]:
        """Yield the order, stated or estimated, minus the formal one."""
        record, quantity = self.record, self.quantity
        name = f"order of {words.symbol(quantity)}"
        order = record.orders(quantity)[0][self.scheme]
        away = finest_level.deviation(record, quantity)[self.scheme]
        if not np.isfinite(away).any():
            return
        if text := shared(name, order, form="order"):
            yield f"{text}{record.of_several(self.scheme)}"
            return

        def draw(ax: Axes, key: Key) -> None:
            ax.axhspan(-allowed, allowed, **style.ALLOWED)
            _draw_members(ax, key, away, self.masks, (-ORDER_FRAME, ORDER_FRAME))

        label = f"{name} − {record.promised_text(quantity, self.scheme)}"
        edge_note = "Orders beyond the frame are drawn at its edge, members without an order at the lower edge."
        leaves = not np.all(np.abs(away) < ORDER_FRAME)
        band = f"Grey: the tolerance around the {record.basis_of_order(quantity)} order."
        places = np.clip(np.nan_to_num(away, nan=-ORDER_FRAME), -ORDER_FRAME, ORDER_FRAME)
        explanation = style.sentences(band, edge_note * leaves)
        yield self._view("order", name, label, draw, explanation, order, places)

    def error(self) -> Iterator[View | str]:
        """Yield the error of the finest level."""
        from matplotlib.ticker import FuncFormatter, MaxNLocator

        error = finest_level.error(self.record, self.quantity)
        best = error.best[self.scheme]
        unit = self.record.norm_unit(self.quantity)
        name = f"error of {words.symbol(self.quantity)}"
        size = np.log10(style.positive(best))
        if not np.isfinite(size).any():
            return

        def draw(ax: Axes, key: Key) -> None:
            _draw_members(ax, key, size, self.masks, None)
            # the axis shows logarithms
            ax.yaxis.set_major_locator(MaxNLocator(5, integer=True))
            ax.yaxis.set_major_formatter(FuncFormatter(lambda y, _: power(round(y))))

        explanation = f"Of level {self.record.levels[-1]}."
        label = style.label(f"{error.kind} {name}", unit)
        yield self._view("error", name, label, draw, explanation, best, size, unit)

    def _view(
        self, kind: str, name: str, label: str, draw: Callable[[Axes, Key], None], explanation: str,
        values: Floats, place: Floats, unit: str = "",
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
                _legend(ax, [word for word, chosen in self.masks.items() if chosen.any()])
            if i % 3 == 0:
                ax.set_ylabel(label, fontsize=8.5)
            ax.set_gid(style.MEMBER)
            rings.append(ring(ax, float(key.values[self.worst]), float(place[self.worst])))
        several, more = record.of_several(self.scheme), len(self.keys) - len(axes)
        text = style.sentences(
            "Each panel shows all members against one swept key, whatever the others are.",
            explanation,
            "Darker cells hold more members; FAIL lies over INCONCLUSIVE over PASS."
            * (record.count > MOST_POINTS),
            f"{more} more keys are not shown; the table of members has them." * (more > 0),
        )
        title, figure = f"{words.capitalized(name)}{several}", axes[0].get_figure(root=True)
        stem = f"projections_{self.quantity}_{kind}_{self.scheme}"
        return View(
            name, Picture(stem, title, text, f"{title} against every swept key", figure), self.quantity, values[None],
            place[None], unit, schemes=(self.scheme,), of=several.removeprefix(", "),
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
