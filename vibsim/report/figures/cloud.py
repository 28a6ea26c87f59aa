"""Members anywhere in the space of several keys: order, error and shares of the verdicts against each key.

Few members are points; many are counted in cells, so that a page stays small however many there are.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim.core.record import Record
from vibsim.core.vocabulary import SEVERITY, TYPICAL_NORM
from vibsim.report import finest_level, style
from vibsim.report.choice import tolerance
from vibsim.report.data import Floats, due, flags, norm_unit, of_several, promised_text, whole
from vibsim.report.figures.panels import rows_of
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Key, bins, place_in
from vibsim.report.text import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from vibsim.experiment import Experiment

Masks = dict[str, NDArray[np.bool_]]
"""Which members come to each verdict, shape (case,)."""
POINTS = 4000
"""Most members that are drawn as points."""
BEYOND = 1.5
"""Distance from the promised order at which the frame ends."""
SHARES = 24
"""Most bars of shares along a key."""
MESH = 160, 60
"""Cells that members are counted in, along and up."""
SHOWN = 6
"""Most keys in one figure; the members' table has all."""
ROW, FOOT = 1.45, 0.5
"""Height of a panel, room for the label below [inch]."""
COLUMNS = ((0.68, 2.5), (3.78, 2.3), (6.5, 2.3))
"""Left and width of the three columns [inch]."""


def projections(
    experiment: Experiment, record: Record, keys: list[Key], quantity: str, scheme: int
) -> Picture:
    """Draw order, error and shares of the verdicts of one scheme against every swept key."""
    name, letter = record.words("scheme")[scheme], words.symbol(quantity)
    shown = keys[:SHOWN]
    figure, axes = rows_of(3 * len(shown), COLUMNS, ROW, 0.0, FOOT)
    status = flags(record, f"{quantity}_status")[scheme]
    masks = {word: status == word for word in SEVERITY}
    away = finest_level.deviation(record, quantity)[scheme]
    promised = promised_text(record, quantity, scheme)
    error = finest_level.error(record, quantity)
    size = np.log10(style.positive(error.best[scheme]))
    allowed = tolerance(experiment, quantity, name)
    for i, key in enumerate(shown):
        order, error_size, share = row = axes[3 * i : 3 * i + 3]
        order.axhspan(-allowed, allowed, **style.ALLOWED)
        _draw_members(order, key, away, masks, (-BEYOND, BEYOND))
        order.set_ylabel(f"order of {letter} − {promised}", fontsize=8.5)
        _draw_members(error_size, key, size, masks, None)
        _label_decades(error_size)
        _draw_shares(share, key, masks)
        for ax in row:
            _frame(ax, key)
    kind = "true" if error.is_known else "estimated"
    measure = norm_unit(record, quantity, TYPICAL_NORM)
    titles = ("Order", style.label(f"{kind} error".capitalize(), measure), "Share")
    for ax, title in zip(axes, titles, strict=False):
        ax.set_title(title, fontsize=9)
    axes[2].legend(
        loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=3, fontsize=7, handlelength=0.9,
        columnspacing=0.8, borderaxespad=0.1,
    )  # fmt: skip
    several = of_several(record, scheme)
    return Picture(
        name=f"projections_{quantity}_{scheme}",
        title=f"Where do members fail? {letter}{several}",
        caption=_caption(
            away, len(keys) - len(shown), whole(record, "level")[-1], due(record, quantity)
        ),
        alt=f"Order and error of {words.name(quantity)} and the shares of verdicts against every swept key{several}",
        figure=figure,
    )


def _caption(away: Floats, left_out: int, level: int, due: str) -> str:
    return style.sentences(
        "Each row shows all members against one swept key, whatever the others are: left the stated order less the "
        f"{due} one, with its tolerance in grey; then the error on level {level}; right what share of the members "
        "near a value comes to which verdict. A key whose shares do not vary does not matter.",
        "Darker cells hold more members; FAIL lies over INCONCLUSIVE over PASS."
        if away.size > POINTS
        else "",
        "Orders beyond the frame are drawn at its edge, members without an order at the lower edge."
        if np.any(~(np.abs(away) < BEYOND))
        else "",
        f"{left_out} more keys are not shown; the table of members has them." if left_out else "",
    )


def _frame(ax: Axes, key: Key) -> None:
    if key.is_log:
        room = (key.distinct[-1] / key.distinct[0]) ** 0.02
        style.log_axis(ax, "x", float(key.distinct[0] / room), float(key.distinct[-1] * room))
    if key.words:
        ax.set_xticks(key.distinct, key.words)
    ax.set_xlabel(key.label, fontsize=8.5, labelpad=2)
    ax.tick_params(labelsize=7.5)


def _label_decades(ax: Axes) -> None:
    """Write the ticks of an axis that holds logarithms as powers of ten."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    ax.yaxis.set_major_locator(MaxNLocator(5, integer=True))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda y, _: style.power(round(y))))


def _draw_members(
    ax: Axes, key: Key, values: Floats, masks: Masks, ends: tuple[float, float] | None
) -> None:
    """Draw a number of every member by verdict; what is beyond `ends`, or no number, at the edge."""
    low, high = ends or style.limits(np.where(np.isfinite(values), values, np.nan))
    inside = np.clip(np.where(np.isnan(values), low, values), low, high)
    room = 0.06 * (high - low)
    for word, chosen in masks.items():
        if values.size <= POINTS:
            ax.plot(
                key.values[chosen],
                inside[chosen],
                linestyle="none",
                marker=style.STATUS_MARKERS[word],
                markersize=2.6 if values.size > 500 else 4.0,
                color=style.STATUS_COLOURS[word],
                markeredgewidth=0.0,
                rasterized=values.size > 500,
            )
        elif chosen.any():
            up = np.linspace(low - room, high + room, MESH[1] + 1)
            part = replace(key, values=key.values[chosen])
            _draw_counts(ax, part, inside[chosen], style.STATUS_COLOURS[word], up)
    ax.set_ylim(low - room, high + room)
    ax.grid(visible=False, axis="both" if values.size > POINTS else "x")


def _draw_counts(ax: Axes, key: Key, values: Floats, colour: str, up: Floats) -> None:
    """Count members in cells; the more, the darker."""
    from matplotlib.colors import LinearSegmentedColormap, LogNorm

    across = bins(key, MESH[0])
    column = place_in(key, across)
    row = np.clip(np.searchsorted(up, values, side="right") - 1, 0, MESH[1] - 1)
    width = across.size - 1
    count = np.bincount(row * width + column, minlength=MESH[1] * width).astype(np.float64)
    shades = LinearSegmentedColormap.from_list(
        "", [_mixed(colour, 1.0), colour, _mixed(colour, 0.0)]
    )
    ax.pcolormesh(
        across,
        up,
        np.ma.masked_equal(count.reshape(MESH[1], width), 0.0),
        cmap=shades,
        norm=LogNorm(1.0, max(float(count.max()), 2.0)),
        rasterized=True,
    )


def _mixed(colour: str, other: float) -> str:
    """Return a colour mixed with as much grey of brightness `other`."""
    from matplotlib.colors import to_hex, to_rgb

    red, green, blue = (0.5 * part + 0.5 * other for part in to_rgb(colour))
    return to_hex((red, green, blue))


def _draw_shares(ax: Axes, key: Key, masks: Masks) -> None:
    """Draw stacked bars along a key: the shares of the verdicts among the members there."""
    borders = bins(key, SHARES)
    place = place_in(key, borders)
    total = np.bincount(place, minlength=borders.size - 1)
    base = np.zeros(borders.size - 1)
    with np.errstate(invalid="ignore"):
        for word, chosen in masks.items():
            share = np.bincount(place[chosen], minlength=borders.size - 1) / total
            ax.bar(
                borders[:-1],
                np.nan_to_num(share),
                width=np.diff(borders),
                bottom=base,
                align="edge",
                color=style.STATUS_COLOURS[word],
                edgecolor="white",
                linewidth=0.3,
                label=word,
            )
            base = base + np.nan_to_num(share)
    ax.set_ylim(0.0, 1.0)
    ax.set_yticks([0.0, 0.5, 1.0], ["0", "½", "1"])
    ax.grid(visible=False)
