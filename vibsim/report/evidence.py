"""The picture that shows a verdict: the curves that coincide or do not, and the order or the number by level.

It is of the result that decides, the one that the sentence beside it names.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.record import Record
from vibsim.report import figures_time, style, words
from vibsim.report.data import (
    Floats,
    Member,
    at,
    case_name,
    formal_order,
    is_lean,
    place_of,
    sound_triples,
    stated_order,
    time_unit,
    times,
    unit,
    whole,
)
from vibsim.report.stamp import BAND, Panel, document

if TYPE_CHECKING:
    from vibsim.spec import Check, Experiment
    from vibsim.spec.checks import ConvergesCheck, ValueCheck

MOST_LEVELS = 12
"""With more of them every second one is named."""
COLOUR = style.COLOURS[0]
OF_LEVEL = ("scheme", "case", "level")


@dataclass(frozen=True)
class Picture:
    """A drawing and the words below it."""

    svg: str
    caption: str


def picture(
    experiment: Experiment, record: Record, asserted: Check | None, check: Mapping[str, Any]
) -> Picture | None:
    """Return the picture of the result that decides a check; None where there is nothing to draw."""
    results: Sequence[Mapping[str, Any]] = check.get("results") or []
    if asserted is None or not results:
        return None
    member = _member(record, results[0])
    measured = asserted.measured
    if member is None:
        return None
    if measured.kind == "converges":
        return _of_order(experiment, record, measured, member)
    if measured.kind == "value":
        return _of_value(record, measured, member)
    return None


def _member(record: Record, result: Mapping[str, Any]) -> Member | None:
    names, case = record.words("scheme"), place_of(record, result.get("case", -1))
    name = str(result.get("scheme"))
    if name not in names or case is None:
        return None
    return Member(names.index(name), case, name, case_name(record, case))


def _of_order(
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
    left = (
        f"Left: differences between levels of {member.title}, rescaled to coincide where the error has the promised "
        "order; the finest pair is the thinnest line."
    )
    return Picture(document([curves, by_level], _label(quantity)), f"{left} Right: {told}")


def _label(quantity: str) -> str:
    return f"Evidence on the order of {words.name(quantity)}"


def _differences(record: Record, quantity: str, member: Member) -> Panel:
    """Return a panel with the rescaled differences over time."""
    t, curves = times(record, member.case), figures_time.differences(record, quantity, member)
    shown = [curve for curve in curves if curve.is_whole and curve.sound] or curves
    low, high = style.limits(*(curve.values for curve in shown), margin=0.05)
    panel = Panel((float(t[0]), float(t[-1])), (low, high))
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
        _ticks(float(t[0]), float(t[-1])),
        _ticks(low, high),
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
    panel = Panel((levels[0] - 0.5, levels[-1] + 0.5), (low, high))
    if math.isfinite(expected):
        panel.band(expected - tolerance, expected + tolerance, *panel.x, BAND)
        panel.level(expected)
    counts = [first <= triple and levels[i + 2] <= last for i, triple in enumerate(triples)]
    panel.points(triples, orders, counts, COLOUR)
    step = max(1, round((high - low) / 4))
    ticks = [(float(k), f"{k}") for k in range(math.ceil(low), math.floor(high) + 1, step)]
    panel.frame(f"order of {words.symbol(quantity)}", "level", _level_ticks(levels), ticks)
    return panel


def _draw_stated(panel: Panel, record: Record, quantity: str, member: Member, norm: int) -> None:
    """Draw the stated order with its interval over the levels of its window, where there is one."""
    stated = stated_order(record, quantity, member, norm)
    if stated is not None:
        panel.band(*stated[1:], COLOUR, 0.25)


def _level_ticks(levels: list[int]) -> list[tuple[float, str]]:
    every = 1 + len(levels) // MOST_LEVELS
    return [(float(level), str(level)) for level in levels[::every]]


def _of_value(record: Record, check: ValueCheck, member: Member) -> Picture | None:
    """Draw a number by level, or how far it is from the one that it should equal."""
    name = f"{check.quantity}_{check.value}" if check.quantity else check.value
    levels = whole(record, "level")
    elsewhere = check.at.t is not None or check.at.step is not None or check.at.level == "best"
    if name not in record or record.variable(name).dims != OF_LEVEL or elsewhere or len(levels) < 2:
        return None
    level = levels[-1] if check.at.level is None else check.at.level
    spoken = words.spoken(check.value)
    of = f" of {words.symbol(check.quantity)}" if check.quantity else ""
    by_level = ByLevel(
        name=style.label(f"{spoken}{of}", unit(record, name)),
        levels=levels,
        values=at(record, name, member),
        counts=[one == level for one in levels],
        scheme=member.title,
    )
    if check.equals is None:
        return _beside_border(by_level, check)
    # what a coarser level has to give is no limit that the others approach
    return _distance(by_level, check.equals, check.allowed) if level == levels[-1] else None


@dataclass(frozen=True)
class ByLevel:
    """A number on every level."""

    name: str
    levels: list[int]
    values: Floats
    counts: list[bool]
    """Whether it is the level that is asked for."""
    scheme: str

    def panel(self, low: float, high: float) -> Panel:
        """Return an empty panel for values in a range."""
        return Panel((self.levels[0] - 0.5, self.levels[-1] + 0.5), (low, high))

    def finish(
        self, panel: Panel, title: str, ticks: list[tuple[float, str]], told: str
    ) -> Picture:
        """Return the picture of a panel."""
        panel.frame(title, "level", _level_ticks(self.levels), ticks)
        caption = (
            f"{self.scheme}, level by level: filled the one that is asked for; grey is {told}."
        )
        return Picture(document([panel], title), caption)


def _beside_border(row: ByLevel, check: ValueCheck) -> Picture | None:
    """Draw a number by level beside the one that it must be below or above."""
    below = check.below is not None
    border = check.below if check.below is not None else check.above
    if border is None or not np.isfinite(row.values).any():
        return None
    low, high = style.limits(row.values, np.array([border]), margin=0.15)
    panel = row.panel(low, high)
    panel.band(*((low, border) if below else (border, high)), *panel.x, BAND)
    panel.level(border)
    panel.points(row.levels, row.values, row.counts, COLOUR)
    return row.finish(panel, row.name, _ticks(low, high), "where it should lie")


def _distance(row: ByLevel, wanted: float, allowed: float) -> Picture | None:
    """Draw how far a number is from what it should be, on a logarithmic scale."""
    away = np.abs(row.values - wanted)
    known = away[np.isfinite(away) & (away > 0.0)]
    if not known.size or allowed <= 0.0:
        return None
    logs, border = np.log10(np.where(away > 0.0, away, np.nan)), math.log10(allowed)
    low, high = style.limits(np.log10(known), np.array([border]), margin=0.15)
    panel = row.panel(min(low, high - 1.0), high)
    panel.band(panel.y[0], border, *panel.x, BAND)
    panel.level(border)
    panel.points(row.levels, logs, row.counts, COLOUR)
    step = max(1, math.ceil((high - panel.y[0]) / 5))
    powers = range(math.ceil(panel.y[0]), math.floor(high) + 1, step)
    ticks = [(float(k), style.power(k)) for k in powers]
    title = f"distance of {row.name} from {words.number(wanted, 'step')}"
    return row.finish(panel, title, ticks, "what the tolerance allows")


def _ticks(low: float, high: float) -> list[tuple[float, str]]:
    """Return about four round numbers in a range, as a scale has them."""
    raw = (high - low) / 4.0
    ten = 10.0 ** math.floor(math.log10(raw))
    step = next(m * ten for m in (1.0, 2.0, 5.0, 10.0) if m * ten >= raw)
    first, last = math.ceil(low / step), math.floor(high / step)
    return [(k * step, words.number(k * step, "step")) for k in range(first, last + 1)]
