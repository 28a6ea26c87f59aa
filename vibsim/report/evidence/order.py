"""The picture of an order: the rescaled differences that coincide or do not, and the order by level."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from vibsim.core.record import Record
from vibsim.report import style
from vibsim.report.data import (
    Floats,
    Member,
    at,
    formal_order,
    is_lean,
    power,
    sound_triples,
    stated_order,
    time_unit,
    times,
    unit,
    whole,
)
from vibsim.report.evidence.frame import COLOUR, Picture, level_ticks, of_levels, over_time, ticks
from vibsim.report.evidence.svg_plot import BAND, Panel, document
from vibsim.report.figures.time import differences as curves_of_differences
from vibsim.report.text import words

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import ConvergesCheck


def picture(
    experiment: Experiment, record: Record, check: ConvergesCheck, member: Member
) -> Picture | None:
    """Draw the rescaled differences over time, where series are kept, and the order by level."""
    quantity = check.converges
    if f"{quantity}_observed_order" not in record:
        return None
    norm = record.words("norm").index(check.norm)
    orders = at(record, f"{quantity}_observed_order", member, norm=norm)
    if not np.isfinite(orders).any():
        return None
    expected = formal_order(record, member, quantity) if check.order == "scheme" else check.order
    by_level = _orders(record, quantity, member, orders, (float(expected), check.tolerance))
    _draw_stated(by_level, record, quantity, member, norm)
    told = (
        "the order that three levels give, by the coarsest of them; filled where it counts. Grey: what the check asks "
        "for. Bar: the stated order with its interval."
    )
    if is_lean(record):
        return Picture(document([by_level], _label(quantity)), f"{member.title}: {told}")
    curves = _differences(record, quantity, member)
    order = power(record, member, quantity)
    how = f"rescaled to coincide where the error has order {order:g}" if order else "as they are"
    left = (
        f"Left: differences between levels of {member.title}, {how}; the finest pair is the "
        "thinnest line."
    )
    return Picture(document([curves, by_level], _label(quantity)), f"{left} Right: {told}")


def _label(quantity: str) -> str:
    return f"Evidence on the order of {words.name(quantity)}"


def _differences(record: Record, quantity: str, member: Member) -> Panel:
    """Return a panel with the rescaled differences over time."""
    t, curves = times(record, member.case), curves_of_differences(record, quantity, member)
    shown = [curve for curve in curves if curve.is_whole and curve.sound] or curves
    low, high = style.limits(*(curve.values for curve in shown), margin=0.05)
    panel = over_time(t, low, high)
    panel.level(0.0, dashed=False, colour=BAND)
    for i, curve in enumerate(shown):
        width = 3.6 - 2.6 * i / max(1, len(shown) - 1)
        x, y = style.thin(t, curve.values, int(panel.width) // 2)
        panel.curve(x, y, style.COLOURS[i], width)
    size = f" [{measure}]" if (measure := unit(record, f"{quantity}_rescaled")) else ""
    seconds = f" [{time}]" if (time := time_unit(record)) else ""
    panel.frame(
        f"rescaled differences of {words.symbol(quantity)}{size}",
        f"t{seconds}",
        ticks(float(t[0]), float(t[-1])),
        ticks(low, high),
    )
    return panel


def _orders(
    record: Record, quantity: str, member: Member, orders: Floats, asked: tuple[float, float]
) -> Panel:
    """Return a panel with the order of every triple of levels, and the one that is asked for."""
    triples = whole(record, "triple")
    first, last = (int(at(record, f"{quantity}_window_{end}", member)) for end in ("first", "last"))
    levels = whole(record, "level")
    expected, tolerance = asked
    good = np.array(sound_triples(record, quantity, member))
    near = orders[good & np.isfinite(orders)] if good.any() else orders
    known = [expected - 0.5, expected + 0.5] if math.isfinite(expected) else []
    low, high = style.limits(np.clip(near, -1.0, 9.0), np.array(known), margin=0.15)
    panel = of_levels(levels, low, high)
    if math.isfinite(expected):
        panel.band(expected - tolerance, expected + tolerance, *panel.x, BAND)
        panel.level(expected)
    counts = [first <= triple and levels[i + 2] <= last for i, triple in enumerate(triples)]
    panel.points(triples, orders, counts, COLOUR)
    step = max(1, round((high - low) / 4))
    whole_orders = range(math.ceil(low), math.floor(high) + 1, step)
    scale = [(float(k), words.number(k, "integer")) for k in whole_orders]
    panel.frame(f"order of {words.symbol(quantity)}", "level", level_ticks(levels), scale)
    return panel


def _draw_stated(panel: Panel, record: Record, quantity: str, member: Member, norm: int) -> None:
    """Draw the stated order with its interval over the levels of its window, where there is one."""
    stated = stated_order(record, quantity, member, norm)
    if stated is not None:
        panel.band(*stated[1:], COLOUR, 0.25)
