"""The picture of an order: the rescaled differences of levels, and the order by level."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibsim.report import style
from vibsim.report.choice import CheckedLadder
from vibsim.report.data import Ladder
from vibsim.report.evidence import frame
from vibsim.report.evidence.frame import evidence
from vibsim.report.figures.order import draw_stated
from vibsim.report.figures.time import differences as curves_of_differences
from vibsim.report.style import Picture
from vibsim.report.types import ConvergesCheck, Figure


def picture(checked: CheckedLadder, check: ConvergesCheck) -> Picture | None:
    """Draw the rescaled differences over time, if series are stored, and the order by level."""
    ladder = checked.of(check.converges)
    if not ladder.has("observed_order", check.norm):
        return None
    alt = f"Evidence on the order of {ladder.name}"
    right_text = (
        "the order from three levels, at the coarsest of them; filled where it counts. Grey: what the check asks for. "
        "Bar, and in brackets above: the stated order with its 95 % interval, which often ends at a whole power."
    )
    figure = style.canvas(1.0)
    has_series = "rescaled" in ladder
    if has_series:
        _draw_differences(figure, ladder)
    _draw_orders(figure, ladder, check)
    if not has_series:
        return evidence(f"{ladder.title}: {right_text}", alt, figure)
    order = ladder.rescaling_order
    how = f"rescaled to coincide where the error has order {order:g}" if order else "as they are"
    left = f"Left: differences between levels of {ladder.title}, {how}; the finest pair is the thinnest line."
    return evidence(f"{left} Right: {right_text}", alt, figure)


def _draw_differences(figure: Figure, ladder: Ladder) -> None:
    t, curves = ladder.t, curves_of_differences(ladder)
    shown = [curve for curve in curves if curve.is_readable] or curves
    title = style.label(f"rescaled differences of {ladder.letter}", ladder.unit("rescaled"))
    ax = frame.panel(figure, title, ladder.record.time_label)
    ax.set_gid(style.TIME)
    ax.set_xlim(float(t[0]), float(t[-1]))
    frame.scale(ax, *(curve.values for curve in shown), margin=0.05)
    ax.axhline(0.0, color=frame.BAND, linewidth=0.8, zorder=0)
    for i, curve in enumerate(shown):
        width = 2.7 - 2.0 * i / max(1, len(shown) - 1)
        look: dict[str, Any] = {"color": style.COLOURS[i], "linewidth": width, "gid": curve.group}
        ax.plot(*style.thin(t, curve.values, 120), label=curve.label, **look)


def _draw_orders(figure: Figure, ladder: Ladder, check: ConvergesCheck) -> None:
    """Draw the order of every triple of levels, the expected order, and the stated one."""
    orders = ladder.at("observed_order", check.norm)
    expected = float(ladder.formal_order if check.order == "scheme" else check.order)
    triples, levels = ladder.record.triples, ladder.record.levels
    first, last = ladder.window
    above = np.array(ladder.sound_triples)
    sound = orders[above & np.isfinite(orders)] if above.any() else orders
    around = expected + np.array([-0.5, 0.5])
    ax = frame.panel(figure, f"order of {ladder.letter}", "level")
    frame.level_axis(ax, levels)
    frame.scale(ax, np.clip(sound, -1.0, 9.0), around)
    if math.isfinite(expected):
        frame.allowed(ax, expected - check.tolerance, expected + check.tolerance)
        ax.axhline(expected, **frame.DASHED)
    # the data have the verdict on the scheme's order; an order of its own has another one
    is_stated = check.order != "scheme" or math.isfinite(ladder.stated_order(check.norm)[0])
    counts = [
        is_stated and first <= triple and levels[i + 2] <= last for i, triple in enumerate(triples)
    ]
    frame.points(ax, triples, orders, counts)
    draw_stated(ax, ladder, frame.COLOUR, check.norm)
