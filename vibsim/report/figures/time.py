"""Figures over time: do the rescaled differences coincide, and what is the ratio between them?

Source: pendulum lecture, sections 2.5 and 2.6.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.convergence.differences import gap_ratio, rescaling, target_ratio
from vibsim.core.record import Record
from vibsim.report import data, frame, style
from vibsim.report.data import Floats, Member
from vibsim.report.figures import order_panels
from vibsim.report.figures.panels import (
    Curve,
    comparable,
    draw_curves,
    draw_spread,
    figure_of,
    panels,
)
from vibsim.report.style import Picture
from vibsim.report.text import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CURVES = 6
"""Most curves in one panel; more cannot be told apart."""


EXACT = (
    ". The scheme is exact in this quantity, so nothing is rescaled and what is seen is round-off."
)


def overlay(record: Record, quantity: str, member: Member) -> Picture:
    """Draw the rescaled level differences of a quantity, their spread, and the ratio over time."""
    t, order = data.times(record, member.case), data.power(record, member, quantity)
    is_exact = math.isinf(data.formal_order(record, member, quantity))
    letter, measure = words.symbol(quantity), data.unit(record, f"{quantity}_difference")
    curves = differences(record, quantity, member)
    spread, ratios = comparable(curves), len(data.whole(record, "triple")) > 0
    orders = ratios and order_panels.has_order(record, quantity, member)
    heights = [
        2.4,
        *([1.3] if spread else []),
        *([1.5] if ratios else []),
        *([1.5] if orders else []),
    ]
    axes = panels(heights)
    draw_curves(axes[0], t, curves, f"rescaled difference of {letter}", measure)
    axes[0].set_title("Rescaled differences between successive levels")
    if spread:
        draw_spread(axes[1], t, curves, measure)
    if ratios:
        _draw_ratios(axes[-2 if orders else -1], t, record, quantity, member, order)
    if orders:
        good = data.sound_triples(record, quantity, member)
        order_panels.draw_orders(axes[-1], t, record, quantity, member, good, _few(good))
    axes[-1].set_xlabel(style.label("t", data.time_unit(record)))
    first = data.whole(record, "pair")[0]
    low = words.lowered(first)
    law = f"dt{words.raised(order)}" if order != 1.0 else "dt"
    shrinks = (
        f"{_multiplied(order, data.whole(record, 'level'))}; if the error shrinks as {law}, the curves "
        "fall on one another."
    )
    parts = [
        f"{letter}{low} is {letter} on level {first}, and so on. Top: the differences between successive levels"
        + (EXACT if is_exact else f", {shrinks}"),
        "Then the spread: how far each curve is from the finest one above round-off."
        if spread
        else "",
        "Below it: the ratio of successive differences; it should settle at the dashed line. Near a zero crossing a "
        "ratio of two small numbers means nothing: it is left out."
        if ratios
        else "",
        order_panels.CAPTION if orders else "",
    ]
    return Picture(
        name=f"differences_{quantity}_{member.stem}",
        title=f"Do the levels agree? {words.title(quantity)}, {member.title}",
        caption=style.sentences(*parts),
        alt=f"Rescaled level differences of {words.name(quantity)} against time for {member.title}"
        + (", with the ratio of successive differences" if ratios else "")
        + (" and the order over time" if orders else ""),
        figure=figure_of(axes[0]),
    )


def energy(record: Record, member: Member) -> Picture:
    """Draw the energy deviation of every level times ``(2**p)**k``: convergence to conservation."""
    order = data.power(record, member, "energy_deviation")
    is_exact = math.isinf(data.formal_order(record, member, "energy_deviation"))
    measure, levels = data.unit(record, "energy_deviation_scaled"), data.whole(record, "level")
    above = data.sound_levels(record, "energy_deviation", member)
    curves = []
    for i, level in enumerate(levels):
        values = data.at(record, "energy_deviation_scaled", member, level=i)
        factor = words.factor(float(gap_ratio(order, level - levels[0])), 2.0**order)
        text = f"{factor}dE{words.lowered(level)}"
        curves.append(Curve(text, values, above[i], _lost(record, "energy_deviation", member, [i])))
    curves = [curves[i] for i in _few([curve.sound for curve in curves])]
    spread = comparable(curves)
    axes = panels([2.4, 1.3] if spread else [2.4])
    t = data.times(record, member.case)
    draw_curves(axes[0], t, curves, "rescaled dE", measure)
    axes[0].set_title("Energy deviation dE = E(t) − E(0), rescaled")
    if spread:
        draw_spread(axes[1], t, curves, measure)
    axes[-1].set_xlabel(style.label("t", data.time_unit(record)))
    caption = (
        f"dE{words.lowered(levels[0])} is dE on level {levels[0]}, and so on. The exact energy is constant, so dE "
        "itself is an error. "
    )
    if is_exact:
        caption += "The scheme conserves the energy exactly: what is seen is round-off."
    else:
        caption += (
            f"Multiplied by {2.0**order:g} for each level the curves should coincide; look at the last point too, "
            "where the velocity comes from a formula of its own."
        )
    if spread:
        caption += " Below, the spread: how far each curve is from the finest one above round-off."
    return Picture(
        name=f"conservation_{member.stem}",
        title=f"Convergence to conservation: {member.title}",
        caption=caption,
        alt=f"Rescaled energy deviation against time on levels {words.levels(levels)} for {member.title}",
        figure=figure_of(axes[0]),
    )


def differences(record: Record, quantity: str, member: Member) -> list[Curve]:
    """Return the level differences, rescaled so that an error ``C dt**p`` makes them coincide; at most `CURVES`."""
    order, levels = data.power(record, member, quantity), data.whole(record, "level")
    above, letter = data.sound_pairs(record, quantity, member), words.symbol(quantity)
    curves = []
    for i in _few(above):
        gap = f"{letter}{words.lowered(levels[i])} − {letter}{words.lowered(levels[i + 1])}"
        factor = words.factor(float(rescaling(order, levels[: i + 2])), 2.0**order)
        values = data.at(record, f"{quantity}_rescaled", member, pair=i)
        lost = _lost(record, quantity, member, [i, i + 1])
        curves.append(Curve(f"{factor}({gap})" if factor else gap, values, above[i], lost))
    return curves


def _lost(record: Record, quantity: str, member: Member, levels: list[int]) -> str:
    """Say why values of these positions of levels would mean nothing (see `frame.why_lost`)."""
    pairs = [i for i in levels if i < len(data.whole(record, "pair"))]
    found = [data.at(record, f"{quantity}_difference", member, pair=i) for i in pairs[:1]]
    if f"{quantity}_scaled" in record and len(levels) == 1:
        found = [data.at(record, f"{quantity}_scaled", member, level=levels[0])]
    return frame.why_lost(record, quantity, member, levels, np.concatenate([*found, np.zeros(1)]))


def _multiplied(order: float, levels: list[int]) -> str:
    """Say what the differences are multiplied by."""
    targets = {float(target_ratio(order, levels[i : i + 3])) for i in range(len(levels) - 2)}
    if len(targets) > 1:
        return "each multiplied by the number before it"
    return f"multiplied by {targets.pop() if targets else 2.0**order:.6g} from one to the next"


def _few(sound: list[bool]) -> list[int]:
    """Choose curves: the coarsest, the two finest sound ones, some between, and the first that is lost behind them.

    Where none is sound, round-off is what there is to see, and all count.
    """
    kept = [i for i, good in enumerate(sound) if good] or list(range(len(sound)))
    lost = [i for i, good in enumerate(sound) if not good and i > max(kept, default=-1)][:1]
    room = CURVES - len(lost)
    if len(kept) > room:
        between = np.linspace(0, len(kept) - 2, room - 1).round().astype(int)
        kept = [*(kept[i] for i in between), kept[-1]]
    return [*kept, *lost]


def _draw_ratios(
    ax: Axes, t: Floats, record: Record, quantity: str, member: Member, order: float
) -> None:
    levels, count = data.whole(record, "level"), len(data.whole(record, "triple"))
    good = data.sound_triples(record, quantity, member)
    chosen = _few(good)
    drawn: list[Floats] = []
    lost = [_lost(record, quantity, member, [i, i + 1, i + 2]) for i in range(count)]
    for k, i in enumerate(chosen):
        sound, values = (
            good[i] or not any(good),
            data.at(record, f"{quantity}_ratio", member, triple=i),
        )
        if not np.isfinite(values).any():
            continue
        look: dict[str, Any] = {"color": "#b0b0b0", "linewidth": 0.6, "zorder": 1.5}
        if sound:
            look = {"color": style.COLOURS[k], "linestyle": style.DASHES[k], "linewidth": 1.3}
            drawn.append(values)
        text = "levels " + ", ".join(map(str, levels[i : i + 3]))
        ax.plot(
            *style.thin(t, values),
            label=text + ("" if good[i] else f"\n({lost[i]})"),
            **look,
        )
    if not drawn:
        style.remark(ax, _why_no_ratio(good, lost))
    triples = [(levels[i], levels[i + 1], levels[i + 2]) for i in chosen]
    targets = sorted({float(target_ratio(order, triple)) for triple in triples})
    for k, target in enumerate(targets):
        ax.axhline(target, **style.REFERENCE, label="" if k else data.due(record, quantity))
    ax.set_ylim(*_ratio_limits(drawn, targets))
    ax.set_ylabel("ratio")
    ax.set_title("Ratio of successive differences", fontweight="normal", fontsize=9)
    style.beside(ax)


def _why_no_ratio(good: list[bool], lost: list[str]) -> str:
    """Say why no triple has a ratio at any time."""
    if any(good):
        return "too few common times for ratios: a difference changes its sign beside each of them"
    if set(lost) != {frame.ROUND_OFF}:
        return "no ratio means anything: the runs grow without bound, or break down"
    return "nothing to divide: every difference is within round-off, or zero"


def _ratio_limits(drawn: list[Floats], targets: list[float]) -> tuple[float, float]:
    """Return limits that hold the target and the middle nine tenths of the ratios, but no wild outlier."""
    every = np.concatenate([values[np.isfinite(values)] for values in drawn] or [np.array(targets)])
    every = every if every.size else np.array(targets)
    low = min(float(np.quantile(every, 0.05)), 0.97 * targets[0])
    high = max(float(np.quantile(every, 0.95)), 1.03 * targets[-1])
    room = 0.15 * (high - low)
    return max(low - room, -targets[-1]), min(high + room, 3 * targets[-1])
