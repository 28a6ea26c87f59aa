"""Figures over time: the rescaled differences of levels, their ratios, and the local order.

Source: pendulum lecture, sections 2.5 and 2.6; `vibsim.comparison.local_order` for the order in windows.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibsim.comparison.rescaled_differences import rescaling
from vibsim.convergence.differences import gap_ratio, target_ratio
from vibsim.core.array_types import Floats
from vibsim.report import frame, style, words
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.figures import panels
from vibsim.report.style import Picture
from vibsim.report.types import Axes

MOST_CURVES = 6  # in one panel; more cannot be told apart
ORDERS = 3  # most triples whose order is drawn over time: the finest ones above round-off
UNSURE = 1.0  # an order whose interval is wider, or unbounded, is drawn as uncertain
ROOM, BEYOND = 0.35, 3.0  # least and most distance from the formal order to the edge of the frame
SPREAD = "the spread: how far each curve is from the finest one above round-off."


def name_of_differences(ladder: Ladder) -> str:
    """Return the name of the picture of `overlay`."""
    return f"differences_{ladder.stem}"


def overlay(ladder: Ladder) -> Picture:
    """Draw the rescaled level differences of a quantity, their spread, ratio and order over time."""
    t, order, levels = ladder.t, ladder.rescaling_order, ladder.record.levels
    letter, measure, curves = ladder.letter, ladder.unit("difference"), differences(ladder)
    spread, ratios = panels.comparable(curves), bool(ladder.record.triples)
    orders = ratios and ladder.has("local_order")
    axes = panels.stacked([2.4, *[1.3] * spread, *[1.5] * ratios, *[1.5] * orders], style.TIME)
    panels.draw_curves(axes[0], t, curves, f"rescaled difference of {letter}", measure)
    axes[0].set_title("Rescaled differences between successive levels")
    if spread:
        panels.draw_spread(axes[1], t, curves, measure)
    if ratios:
        _draw_ratios(axes[-2 if orders else -1], ladder)
    if orders:
        _draw_orders(axes[-1], ladder)
    axes[-1].set_xlabel(ladder.record.time_label)
    law = f"dt{words.superscript(order)}" if order != 1.0 else "dt"
    what = f", {_multiplied(order, levels)}; if the error shrinks as {law}, the curves fall on one another."
    if math.isinf(ladder.formal_order):
        what = ". The scheme is exact in this quantity, so nothing is rescaled and what is seen is round-off."
    return Picture(
        name=name_of_differences(ladder),
        title=f"Do the levels agree? {words.title(ladder.quantity)}, {ladder.title}",
        caption=style.sentences(
            f"{letter}{words.subscript(levels[0])} is {letter} on level {levels[0]}, and so on. Top: the differences "
            f"between successive levels{what}",
            f"Then {SPREAD}" * spread,
            "Below it: their ratio, which should settle at the dashed line; none near a zero crossing."
            * ratios,
            "Last: the order over time, with its interval. Grey dots: uncertain (interval wider than 1). Gaps: "
            "round-off, or nothing differs. Circle: the last time step, judged separately."
            * orders,
        ),
        alt=f"Rescaled level differences of {ladder.name} against time for {ladder.title}"
        + ", with the ratio of successive differences" * ratios
        + " and the order over time" * orders,
        figure=axes[0].get_figure(root=True),
    )


def energy(record: Results, member: Member) -> Picture:
    """Draw the energy deviation of every level times ``(2**p)**k``: convergence to conservation."""
    ladder, levels = Ladder(record, "energy_deviation", member), record.levels
    order, measure, t = ladder.rescaling_order, ladder.unit("scaled"), ladder.t
    above = ladder.sound_pairs if len(levels) > 1 else [True]
    # the finest level is as sound as its difference from the next coarser one
    above = [*above, above[-1]][: len(levels)]
    curves = []
    for i in _few(above):
        values, lost = ladder.at("scaled", level=i), _lost(ladder, [i])
        factor = words.factor(float(gap_ratio(order, levels[i] - levels[0])), 2.0**order)
        text = f"{factor}ΔE{words.subscript(levels[i])}"
        curves.append(panels.Curve(text, values, above[i], lost, style.of_level(levels[i])))
    spread = panels.comparable(curves)
    axes = panels.stacked([2.4, *[1.3] * spread], style.TIME)
    panels.draw_curves(axes[0], t, curves, "rescaled ΔE", measure)
    axes[0].set_title("Energy deviation ΔE = E(t) − E(0), rescaled")
    if spread:
        panels.draw_spread(axes[1], t, curves, measure)
    axes[-1].set_xlabel(record.time_label)
    return Picture(
        name=f"conservation_{member.stem}",
        title=f"Convergence to conservation: {member.title}",
        caption=style.sentences(
            f"ΔE{words.subscript(levels[0])} is ΔE on level {levels[0]}, and so on. The exact energy is constant, so "
            "ΔE itself is an error.",
            "The scheme conserves the energy exactly: what is seen is round-off."
            if math.isinf(ladder.formal_order)
            else f"Multiplied by {2.0**order:g} for each level the curves should coincide; look at the last point "
            "too, where the velocity comes from a formula of its own.",
            f"Below, {SPREAD}" if spread else "",
        ),
        alt=f"Rescaled energy deviation against time on levels {words.levels(levels)} for {member.title}",
        figure=axes[0].get_figure(root=True),
    )


def differences(ladder: Ladder) -> list[panels.Curve]:
    """Return the level differences, rescaled so that errors ``C dt**p`` make them coincide; at most `MOST_CURVES`."""
    order, levels = ladder.rescaling_order, ladder.record.levels
    above, letter = ladder.sound_pairs, ladder.letter
    curves = []
    for i in _few(above):
        gap = f"{letter}{words.subscript(levels[i])} − {letter}{words.subscript(levels[i + 1])}"
        factor = words.factor(float(rescaling(order, levels[: i + 2])), 2.0**order)
        values = ladder.at("rescaled", pair=i)
        lost = _lost(ladder, [i, i + 1])
        text = f"{factor}({gap})" if factor else gap
        curves.append(panels.Curve(text, values, above[i], lost, style.of_level(levels[i])))
    return curves


def _lost(ladder: Ladder, levels: list[int]) -> str:
    """Say why values that come from `levels` (positions) would mean nothing (see `frame.why_lost`)."""
    values = np.zeros(1)
    if "scaled" in ladder and len(levels) == 1:
        values = ladder.at("scaled", level=levels[0])
    elif levels[0] < len(ladder.record.pairs):
        values = ladder.at("difference", pair=levels[0])
    return frame.why_lost(ladder, levels, values)


def _multiplied(order: float, levels: list[int]) -> str:
    """Say by which factors the differences are rescaled."""
    targets = {float(target_ratio(order, levels[i : i + 3])) for i in range(len(levels) - 2)}
    if len(targets) > 1:
        return "each multiplied by the number before it"
    return f"multiplied by {targets.pop() if targets else 2.0**order:.6g} from one to the next"


def _few(sound: list[bool]) -> list[int]:
    """Choose curves: the coarsest, the two finest sound ones, some between, and the next finer one, lost in round-off.

    If none is sound, the figure shows round-off, and all are candidates.
    """
    shown = [i for i, good in enumerate(sound) if good] or list(range(len(sound)))
    lost = [i for i, good in enumerate(sound) if not good and i > max(shown, default=-1)][:1]
    most_shown = MOST_CURVES - len(lost)
    if len(shown) > most_shown:
        between = np.linspace(0, len(shown) - 2, most_shown - 1).round().astype(int)
        shown = [*(shown[i] for i in between), shown[-1]]
    return [*shown, *lost]


def _draw_ratios(ax: Axes, ladder: Ladder) -> None:
    levels, order, sound = ladder.record.levels, ladder.rescaling_order, ladder.sound_triples
    drawn: list[Floats] = []
    lost = [_lost(ladder, [i, i + 1, i + 2]) for i in range(len(sound))]
    for k, i in enumerate(_few(sound)):
        values = ladder.at("ratio", triple=i)
        if not np.isfinite(values).any():
            continue
        look: dict[str, Any] = {"color": style.PALE, "linewidth": 0.6, "zorder": 1.5}
        if sound[i] or not any(sound):
            look = {"color": style.COLOURS[k], "linestyle": style.DASHES[k], "linewidth": 1.3}
            drawn.append(values)
        text = _triple(levels, i) + ("" if sound[i] else f"\n({lost[i]})")
        style.curve(ax, ladder.t, values, label=text, gid=style.of_level(levels[i]), **look)
    if not drawn:
        style.remark(ax, _why_no_ratio(sound, lost))
    targets = sorted({float(target_ratio(order, levels[i : i + 3])) for i in _few(sound)})
    # a line would cross out the remark
    for k, target in enumerate(targets if drawn else []):
        ax.axhline(target, **style.REFERENCE, label="" if k else ladder.basis_of_order)
    # the frame holds the targets and the middle 90 % of the ratios, without wild outliers
    ratios = style.finite(*drawn)
    ratios = ratios if ratios.size else np.array(targets)
    low = min(float(np.quantile(ratios, 0.05)), 0.97 * targets[0])
    high = max(float(np.quantile(ratios, 0.95)), 1.03 * targets[-1])
    room = 0.15 * (high - low)
    ax.set_ylim(max(low - room, -targets[-1]), min(high + room, 3 * targets[-1]))
    ax.set_ylabel("ratio")
    ax.set_title("Ratio of successive differences", fontweight="normal", fontsize=9)
    style.beside(ax)


def _triple(levels: list[int], i: int) -> str:
    return "levels " + ", ".join(map(str, levels[i : i + 3]))


def _why_no_ratio(sound: list[bool], lost: list[str]) -> str:
    """Say why no triple has a ratio at any time."""
    if any(sound):
        return "too few common times for ratios: a difference changes its sign beside each of them"
    if set(lost) != {frame.ROUND_OFF}:
        return "no ratio means anything: the runs grow without bound, or break down"
    return "nothing to divide: every difference is within round-off, or zero"


def finest_sound(sound: list[bool]) -> list[int]:
    """Choose triples: the finest ones above round-off, else the coarsest."""
    return [i for i, is_sound in enumerate(sound) if is_sound][-ORDERS:] or [0]


def _draw_orders(ax: Axes, ladder: Ladder) -> None:
    """Draw the order over time of the finest triples with their intervals, and the formal order.

    A triple has the colour of its ratio. The last point is drawn separately; uncertain orders are grey dots.
    """
    t, levels, promised = ladder.t, ladder.record.levels, ladder.formal_order
    sound = ladder.sound_triples
    colours = _few(sound)
    drawn: list[Floats] = []
    for i in finest_sound(sound):
        order, low, high = (
            ladder.at(f"local_order{end}", triple=i) for end in ("", "_low", "_high")
        )
        if not np.isfinite(order).any():
            continue
        sure = high - low <= UNSURE
        k = colours.index(i) if i in colours else i
        colour, dashes = (part[k % style.MANY] for part in (style.COLOURS, style.DASHES))
        group = style.of_level(levels[i])
        band: dict[str, Any] = {"color": colour, "alpha": 0.18, "linewidth": 0, "gid": group}
        borders = (np.where(sure, end, np.nan)[:-1] for end in (low, high))
        ax.fill_between(*style.thin_band(t[:-1], *borders), **band)
        line: dict[str, Any] = {"color": colour, "linestyle": dashes, "linewidth": 1.3}
        inner = np.where(sure, order, np.nan)[:-1]
        style.curve(ax, t[:-1], inner, label=_triple(levels, i), gid=group, **line)
        point: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4.2}
        point |= {"markerfacecolor": "white", "markeredgecolor": colour, "gid": group}
        ax.plot(t[-1:], order[-1:], clip_on=False, zorder=5, **point)
        unsure = np.isfinite(order) & ~sure
        if unsure.any():
            stride = max(1, int(np.count_nonzero(unsure)) // 60)
            x, y = t[unsure][::stride], order[unsure][::stride]
            ax.plot(x, y, ".", color="#a0a0a0", markersize=2.6, zorder=1.5, gid=group)
        drawn += [order[sure] if sure.any() else order, order[-1:]]
    orders = style.finite(*drawn)
    ends = np.array([orders.min(), orders.max()] if orders.size else [])
    if math.isfinite(promised):
        ax.axhline(promised, **style.REFERENCE, label=ladder.basis_of_order)
        low_end = max(float(min([promised - ROOM, *(ends - 0.1)])), promised - BEYOND)
        ax.set_ylim(low_end, min(float(max([promised + ROOM, *(ends + 0.1)])), promised + BEYOND))
    else:
        ax.set_ylim(*style.limits(ends))
    ax.set_ylabel("order")
    ax.set_title("Order over time, in windows of half a period", fontweight="normal", fontsize=9)
    style.beside(ax)
