"""The panel of the order over time: below the ratios, which have gaps where it has none.

Source: pendulum lecture, section 2.5; `vibsim.convergence.local_order` for the windows and their interval.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.record import Record
from vibsim.report import style
from vibsim.report.data import Floats, Member, at, due, formal_order, whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CURVES = 3
"""Triples that are drawn: the finest ones above round-off."""
UNSURE = 1.0
"""An interval that is wider, or unbounded, leaves a place marked as uncertain."""
ROOM = 0.35
"""Least distance from the promised order to the frame."""
BEYOND = 3.0
"""Most distance of the frame from the promised order."""
BAND, THIN = 0.18, "#a0a0a0"
_POINT: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 4.2,
    "markerfacecolor": "white",
}

CAPTION = (
    "Last: the order at each time, from the sizes of the differences in a window of half a period, with its interval "
    "as a band. Grey dots: uncertain, the two differences have different shapes there or are near round-off (interval "
    "wider than 1). Gaps: within round-off, or nothing differs. Circles: the last point, which stands for itself."
)


def has_order(record: Record, quantity: str, member: Member) -> bool:
    """Tell whether there is an order over time to be drawn."""
    name = f"{quantity}_local_order"
    return name in record and bool(np.isfinite(at(record, name, member)).any())


def chosen(sound: list[bool]) -> list[int]:
    """Choose triples: the finest ones that stand above round-off; where none does, the coarsest."""
    kept = [i for i, good in enumerate(sound) if good]
    return kept[-CURVES:] or [0]


def draw_orders(
    ax: Axes,
    t: Floats,
    record: Record,
    quantity: str,
    member: Member,
    sound: list[bool],
    colours: list[int],
) -> None:
    """Draw the order over time of the finest triples, their intervals, and the promised order.

    Parameters
    ----------
    sound
        Of every triple, whether it stands above round-off.
    colours
        The triples that the panel of the ratios shows, in its order: the same triple has the same colour.
    """
    levels, promised = whole(record, "level"), formal_order(record, member, quantity)
    drawn: list[Floats] = []
    for i in chosen(sound):
        order, low, high = (
            at(record, f"{quantity}_local_order{end}", member, triple=i)
            for end in ("", "_low", "_high")
        )
        sure = high - low <= UNSURE
        if not np.isfinite(order).any():
            continue
        look = colours.index(i) if i in colours else i
        text = "levels " + ", ".join(map(str, levels[i : i + 3]))
        _draw_one(ax, t, (order, low, high), sure, look, text)
        drawn += [order[sure] if sure.any() else order, order[-1:]]
    if math.isfinite(promised):
        ax.axhline(promised, **style.REFERENCE, label=due(record, quantity))
    ax.set_ylim(*_limits(drawn, promised))
    ax.set_ylabel("order")
    ax.set_title("Order over time, in windows of half a period", fontweight="normal", fontsize=9)
    style.beside(ax)


def _draw_one(
    ax: Axes,
    t: Floats,
    of: tuple[Floats, Floats, Floats],
    sure: NDArray[np.bool_],
    look: int,
    text: str,
) -> None:
    """Draw one order with its interval, and its last point apart; where it is uncertain, as grey dots."""
    order, low, high = of
    colour, dashes = (
        style.COLOURS[look % len(style.COLOURS)],
        style.DASHES[look % len(style.DASHES)],
    )
    inner = np.where(sure, order, np.nan)[:-1]
    band: dict[str, Any] = {"color": colour, "alpha": BAND, "linewidth": 0}
    ax.fill_between(t[:-1], low[:-1], high[:-1], where=sure[:-1].tolist(), **band)
    ax.plot(*style.thin(t[:-1], inner), color=colour, linestyle=dashes, linewidth=1.3, label=text)
    ax.plot(t[-1:], order[-1:], clip_on=False, zorder=5, **_POINT, markeredgecolor=colour)
    unsure = np.isfinite(order) & ~sure
    if unsure.any():
        every = max(1, int(np.count_nonzero(unsure)) // 60)
        x, y = t[unsure][::every], order[unsure][::every]
        ax.plot(x, y, ".", color=THIN, markersize=2.6, zorder=1.5)


def _limits(drawn: list[Floats], promised: float) -> tuple[float, float]:
    """Return limits that hold the promised order and the others, no further than `BEYOND` from it."""
    every = np.concatenate([part[np.isfinite(part)] for part in drawn] or [np.empty(0)])
    ends = [every.min(), every.max()] if every.size else []
    if not math.isfinite(promised):
        return style.limits(np.array(ends))
    low = max(min([promised - ROOM, *(x - 0.1 for x in ends)]), promised - BEYOND)
    return low, min(max([promised + ROOM, *(x + 0.1 for x in ends)]), promised + BEYOND)
