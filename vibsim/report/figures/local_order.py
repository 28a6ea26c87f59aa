"""The order that three successive levels give, level by level, and the order stated from them.

Source: pendulum lecture, section 2.5.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibsim.core.record import Record
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.report import data, style
from vibsim.report.choice import promises
from vibsim.report.data import Floats, Member
from vibsim.report.text import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from vibsim.experiment import Experiment


def draw(
    ax: Axes, experiment: Experiment, record: Record, quantity: str, case: int, schemes: list[str]
) -> bool | None:
    """Draw the local orders; return whether an order is stated, None where there is nothing to draw."""
    from matplotlib.ticker import MaxNLocator

    name = f"{quantity}_observed_order"
    if name not in record or not np.isfinite(data.pick(record, name, case=case)).any():
        few = len(data.whole(record, "level")) < 3
        ax.set(xticks=[], yticks=[])
        style.remark(
            ax,
            "no order: it takes three levels"
            if few
            else "no order:\nno ratio of differences exists",
        )
        return None
    triples, norm = data.whole(record, "triple"), record.words("norm").index(TYPICAL_NORM)
    promised = promises(experiment, record, quantity)
    for order, tolerance in promised:
        ax.axhspan(order - tolerance, order + tolerance, **style.ALLOWED)
        ax.axhline(order, **style.REFERENCE)
    sound: list[Floats] = []
    stated = False
    seen = [data.sound_triples(record, quantity, Member(s, case, x)) for s, x in enumerate(schemes)]
    for s, scheme in enumerate(schemes):
        member, good = Member(s, case, scheme), seen[s]
        if any(map(any, seen)) and not any(good):
            # beside orders, those of noise would be taken for some
            continue
        local = data.at(record, name, member, norm=norm)
        sound.append(local[good] if any(good) else local)
        ax.plot(triples, local, **style.look(s), markersize=5, linewidth=1.1)
        stated |= draw_stated(ax, record, quantity, member, norm, style.look(s)["color"])
    ax.set_ylim(*_order_limits(sound, [order for order, _ in promised]))
    if len(schemes) == 1 and len(triples) <= 8:
        for level, order in zip(triples, local, strict=True):
            if np.isfinite(order):
                ax.annotate(
                    words.number(float(order), "order"),
                    (level, order),
                    xytext=(0, 7),
                    textcoords="offset points",
                    ha="center",
                    fontsize=8,
                    annotation_clip=True,
                )
    levels = data.whole(record, "level")
    ax.set_xlim(levels[0] - 0.5, levels[-1] + 0.5)
    ax.xaxis.set_major_locator(MaxNLocator(nbins=10, integer=True))
    ax.set_xlabel("level (coarsest of three)")
    ax.set_ylabel(f"local order of {words.symbol(quantity)} ({TYPICAL_NORM})")
    return stated


def draw_each(
    ax: Axes, experiment: Experiment, record: Record, quantity: str, case: int, schemes: list[str]
) -> bool | None:
    """Draw the stated order of every scheme in a row of its own; return as `draw` does."""
    name = f"{quantity}_observed_order"
    if name not in record or not np.isfinite(data.pick(record, name, case=case)).any():
        return draw(ax, experiment, record, quantity, case, schemes)
    norm = record.words("norm").index(TYPICAL_NORM)
    seen: list[float] = []
    settled = False
    chosen = np.flatnonzero(~np.isnan(data.formal_orders(record, quantity)[:, case])).tolist()
    for row, s in enumerate(chosen):
        scheme = schemes[s]
        member, colour = Member(s, case, scheme), style.look(s)["color"]
        promised = float(data.formal_orders(record, quantity)[s, case])
        order, low, high = (
            float(data.at(record, f"{quantity}_order{end}", member, norm=norm))
            for end in ("", "_low", "_high")
        )
        settled |= bool(np.isfinite(order))
        last = float(data.at(record, name, member, norm=norm)[-1])
        face = colour if np.isfinite(order) else "white"
        value = order if np.isfinite(order) else last
        ax.plot([low, high], [row, row], color=colour, linewidth=3.0, alpha=0.35)
        ax.plot([value], [row], **style.look(s) | {"markerfacecolor": face, "markersize": 5})
        ax.plot([promised], [row], color="black", marker="|", markersize=9, markeredgewidth=1.2)
        seen += [x for x in (promised, value if np.isfinite(order) else promised) if np.isfinite(x)]
    if seen:
        ax.set_xlim(min(seen) - 0.6, max(seen) + 0.6)
    names = [style.entry(schemes[s]) for s in chosen]
    ax.set_yticks(range(len(chosen)), names, fontsize=7.5)
    ax.set_ylim(len(chosen) - 0.4, -0.6)
    ax.set_xlabel(f"order of {words.symbol(quantity)} ({TYPICAL_NORM})")
    return settled


def draw_stated(
    ax: Axes, record: Record, quantity: str, member: Member, norm: int, colour: str
) -> bool:
    """Draw the stated order as a bar over the levels of its window, with its interval; say whether there is one."""
    stated = data.stated_order(record, quantity, member, norm)
    if stated is None:
        return False
    order, low, high, first, last = stated
    ax.fill_between(
        [first, last], [low, low], [high, high], color=colour, alpha=0.18, linewidth=0, zorder=0.5
    )
    ax.plot(
        [first, last],
        [order, order],
        color=colour,
        linewidth=4,
        alpha=0.35,
        solid_capstyle="butt",
        zorder=1.2,
    )
    return True


def _order_limits(sound: list[Floats], promised: list[float]) -> tuple[float, float]:
    """Hold the promised orders and those that count, no further than 5 below the least and 2 above the largest."""
    values = np.concatenate([part[np.isfinite(part)] for part in sound] or [np.array(promised)])
    if not promised:
        # of schemes that promise none
        return style.limits(values)
    low = min([promised[0] - 0.3, *values.tolist()])
    high = max([promised[-1] + 0.3, *values.tolist()])
    room = 0.08 * (high - low)
    return max(low - room, promised[0] - 5), min(high + room, promised[-1] + 2)
