"""The error against the step, and the local order from three successive levels.

Source: pendulum lecture, section 2.5.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.report import style, words
from vibsim.report.choice import promises
from vibsim.report.data import Ladder, Results
from vibsim.report.figures.panels import legend_above, rows_of
from vibsim.report.style import Picture
from vibsim.report.types import Axes

SLOPES: tuple[Any, ...] = ((0, (4, 3)), (0, (1.2, 1.6)), (0, (7, 2, 1.2, 2)), (0, (10, 2)))
"""Dashes of the slopes, if there are several."""
OUTLIER = 1e4  # errors beyond this multiple of the upper quartile leave the frame
KINDS: dict[str, tuple[str, dict[str, Any]]] = {
    "difference": ("level difference", {"marker": "o", "linestyle": "none", "markersize": 5}),
    "true": ("true error", {"marker": "o", "linestyle": "none", "markersize": 7, "markerfacecolor": "none"}),
    "floor": ("predicted round-off", {"linestyle": ":", "linewidth": 1.0}),
}  # fmt: skip
"""Legend entries for filled, hollow and dotted, shared by all schemes."""


def against_step(record: Results, quantity: str, case: int) -> Picture:
    """Draw the norms of differences and errors against the step, and the local order by level."""
    many = record.is_crowded
    panel = max(2.2, 0.17 * len(record.schemes)) if many else 2.2
    second = (6.1, 2.7) if many else (5.0, 3.8)
    figure, (left, right) = rows_of(2, [(0.8, 3.3), second], panel, 0.6, 0.5)
    left.set_gid(style.STEP)
    ladders = [Ladder(record, quantity, member) for member in record.of_case(case)]
    kinds = _draw_norms(left, ladders)
    draw = _draw_each if many else _draw_by_level
    is_stated = draw(right, ladders) if _has_order(right, ladders) else None
    legend_above(figure, left)
    name = ", ".join(filter(None, [ladders[0].letter, ladders[0].member.case_words]))
    return Picture(
        name=f"order_{quantity}_{case}",
        title=f"How fast does the error shrink? {name}",
        caption=_caption(kinds, is_stated, many, ladders[0].basis_of_order),
        alt=f"Norm of the level differences of {ladders[0].name} against the step, and local order against level",
        figure=figure,
    )


def _caption(kinds: set[str], is_stated: bool | None, many: bool, basis: str) -> str:
    """Explain the parts that are drawn; `is_stated` is None without a local order, `basis` ``promised`` or the like."""
    if not kinds:
        return "Nothing is drawn: there is no error to measure here."
    difference = "size of the level differences (filled)" if "difference" in kinds else ""
    true = "size of the true error (hollow)" if "true" in kinds else ""
    orders = {
        True: f"Right: the stated order of every scheme with its interval (hollow: of the finest three levels, where "
        f"none is stated); the stroke is the {basis} one.",
        False: "Right: the order from three levels, at the coarsest of them; it should settle inside a grey band. "
        "Beyond the frame: too coarse, within round-off, or growing without bound.",
    }
    return style.sentences(
        f"Left: {' and '.join(filter(None, [difference, true]))} against dt.",
        f"Parallel to a dashed line means that {basis} order." if "slope" in kinds else "",
        "Below the dotted line, the predicted bound of round-off, a difference may be noise."
        * ("floor" in kinds),
        "" if is_stated is None else orders[many],
        "The bar is the stated order with its interval." if is_stated and not many else "",
    )


def _draw_norms(ax: Axes, ladders: list[Ladder]) -> set[str]:
    """Draw the norms; return the visible parts, of ``difference``, ``true``, ``slope``, ``floor``."""
    first, dt = ladders[0], ladders[0].dt
    kinds: dict[str, list[Floats]] = {"difference": [], "true": [], "floor": []}
    for ladder in ladders:
        if np.isnan(ladder.formal_order):
            continue  # an adaptive scheme has no error against dt
        look, name = style.look(ladder.scheme), style.entry(ladder.member.scheme_name)
        norms = ladder.at("difference_norm"), ladder.at("error_norm"), ladder.floor()
        difference, true, floor = map(style.no_zeros, norms)
        ax.plot(dt[: difference.size], difference, **look, markersize=5, linewidth=1.1, label=name)
        if np.isfinite(true).any():
            hollow = look | KINDS["true"][1] | {"marker": look["marker"], "gid": name}
            ax.plot(dt, true, **hollow, label=f"_true error, {name}")
        text, dotted = KINDS["floor"]
        ax.plot(dt, floor, color=look["color"], **dotted, gid=name, label=f"_{text}, {name}")
        for kind, values in zip(kinds, (difference, true, floor), strict=True):
            kinds[kind].append(values)
    # differences and errors of the schemes in turn
    measured = [
        norms for pair in zip(kinds["difference"], kinds["true"], strict=True) for norms in pair
    ]
    if not any(np.isfinite(norms).any() for norms in measured):
        for line in list(ax.lines):
            line.remove()
        ax.set(xticks=[], yticks=[])
        style.remark(ax, "every difference and error is zero,\nor not finite: nothing to draw")
        return set()
    orders = list(dict.fromkeys(order for order, _ in promises(first.record, first.quantity)))
    visible = {name for name in ("difference", "true") if style.finite(*kinds[name]).size}
    for k, order in enumerate(orders):
        dashes = SLOPES[k % len(SLOPES)] if len(orders) > 1 else None
        if _reference(ax, dt, measured, order, first.basis_of_order, dashes):
            visible.add("slope")
    if _step_limits(ax, dt, measured, kinds["floor"]):
        visible.add("floor")
    for kind, (text, mark) in KINDS.items():
        if kind in visible:
            ax.plot([], [], color=style.GREY, **mark, label=text)
    ax.set_xlabel(style.label("time step dt", first.record.time_unit))
    ax.set_ylabel(style.label(f"{words.USUAL_NORM}, {first.letter}", first.norm_unit()))
    _level_axis(ax, dt, first.record.levels)
    return visible


def _positive(parts: list[Floats]) -> Floats:
    values = style.finite(*(part[part > 0] for part in parts))
    return values if values.size else np.array([1.0])


def _highest(values: Floats) -> float:
    """Return the largest value within the frame; an unstable level would hide all others."""
    return min(float(values.max()), OUTLIER * float(np.quantile(values, 0.75)), style.LARGEST)


def _reference(
    ax: Axes, dt: Floats, errors: list[Floats], order: float, basis: str, dashes: Any
) -> bool:
    """Draw the slope of an order a little above the largest value at the coarsest step; return whether it fits.

    Each of several slopes has its own dashes, and its number at its end.
    """
    coarsest = np.array([part[0] for part in errors if np.isfinite(part[0])] or [1.0])
    start = 2.5 * _highest(coarsest)
    line = start * (dt / dt[0]) ** order
    reach = line >= _positive(errors).min()
    if reach.sum() < 2 or start <= 0.0:
        return False
    look = style.REFERENCE | ({"linestyle": dashes} if dashes else {})
    ax.plot(dt[reach], line[reach], **look, label=f"slope {order:g} ({basis})")
    if dashes:
        plain = {"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8}
        ax.annotate(
            f"{order:g}", (float(dt[reach][-1]), float(line[reach][-1])), xytext=(-2, 0),
            textcoords="offset points", ha="right", va="center", fontsize=7.5, bbox=plain, annotation_clip=True,
        )  # fmt: skip
    return True


def _step_limits(ax: Axes, dt: Floats, errors: list[Floats], floors: list[Floats]) -> bool:
    """Set the ranges; return whether they include the floor, as they do if the data come within three decades of it."""
    values = _positive(errors)
    low, high = float(values.min()), _highest(values)
    floor = float(_positive(floors).max())
    has_floor = floor > 1e-3 * low
    bottom = min(low, floor) if has_floor else low
    top = max(8 * high, min(2 * floor, 1e3 * high)) if has_floor else 8 * high
    style.log_axis(ax, "y", bottom / 3, top)
    style.log_axis(ax, "x", float(dt[-1]) / 1.5, float(dt[0]) * 1.5)
    return has_floor


def _level_axis(ax: Axes, dt: Floats, levels: list[int]) -> None:
    above: dict[str, Any] = {"va": "bottom", "fontsize": 8.5}
    stride = max(1, len(levels) // 8)
    for x, level in zip(dt[::stride].tolist(), levels[::stride], strict=True):
        ax.text(x, 1.03, str(level), transform=ax.get_xaxis_transform(), ha="center", **above)
    ax.text(-0.02, 1.03, "level", transform=ax.transAxes, ha="right", **above)


def _has_order(ax: Axes, ladders: list[Ladder]) -> bool:
    """Return whether three levels give an order; if not, the panel says why."""
    if any(ladder.has("observed_order") for ladder in ladders):
        return True
    is_short = len(ladders[0].record.levels) < 3
    ax.set(xticks=[], yticks=[])
    why = " it takes three levels" if is_short else "\nno ratio of differences exists"
    style.remark(ax, f"no order of the {words.USUAL_NORM}:{why}")
    return False


def _draw_by_level(ax: Axes, ladders: list[Ladder]) -> bool:
    """Draw the local orders; return whether an order is stated."""
    from matplotlib.ticker import MaxNLocator

    first, levels, triples = ladders[0], ladders[0].record.levels, ladders[0].record.triples
    promised = promises(first.record, first.quantity)
    for order, tolerance in promised:
        ax.axhspan(order - tolerance, order + tolerance, **style.ALLOWED)
        ax.axhline(order, **style.REFERENCE)
    sound: list[Floats] = []
    stated = False
    are_sound = [ladder.sound_triples for ladder in ladders]
    for ladder, above in zip(ladders, are_sound, strict=True):
        if any(map(any, are_sound)) and not any(above):
            continue  # orders of noise could be mistaken for orders
        look, local = style.look(ladder.scheme), ladder.at("observed_order")
        sound.append(local[above] if any(above) else local)
        ax.plot(triples, local, **look, markersize=5, linewidth=1.1)
        stated |= draw_stated(ax, ladder, look["color"])
    ax.set_ylim(*_order_limits(style.finite(*sound), [order for order, _ in promised]))
    if len(ladders) == 1 and len(triples) <= 8:
        offset: Any = {"xytext": (0, 7), "textcoords": "offset points", "ha": "center"}
        for level, order in zip(triples, local.tolist(), strict=True):
            if np.isfinite(order):
                text = words.number(order, "order")
                ax.annotate(text, (level, order), **offset, fontsize=8, annotation_clip=True)
    ax.set_xlim(levels[0] - 0.5, levels[-1] + 0.5)
    ax.xaxis.set_major_locator(MaxNLocator(nbins=10, integer=True))
    ax.set_xlabel("level (coarsest of three)")
    ax.set_ylabel(f"local order of {first.letter} ({words.USUAL_NORM})")
    return stated


def _draw_each(ax: Axes, ladders: list[Ladder]) -> bool:
    """Draw the stated order of every scheme in its own row; return whether any is stated."""
    orders, stated = list[float](), False
    shown = [ladder for ladder in ladders if not np.isnan(ladder.formal_order)]
    for row, ladder in enumerate(shown):
        look, promised = style.look(ladder.scheme), ladder.formal_order
        order, low, high = ladder.stated_order()
        is_stated = bool(np.isfinite(order))
        stated |= is_stated
        last = ladder.at("observed_order")[-1]
        value, face = (order, look["color"]) if is_stated else (float(last), "white")
        ax.plot([low, high], [row, row], color=look["color"], linewidth=3.0, alpha=0.35)
        ax.plot([value], [row], **look | {"markerfacecolor": face, "markersize": 5})
        ax.plot([promised], [row], color="black", marker="|", markersize=9, markeredgewidth=1.2)
        orders += [x for x in (promised, value if is_stated else promised) if np.isfinite(x)]
    if orders:
        ax.set_xlim(min(orders) - 0.6, max(orders) + 0.6)
    names = [style.entry(ladder.member.scheme_name) for ladder in shown]
    ax.set_yticks(range(len(shown)), names, fontsize=7.5)
    ax.set_ylim(len(shown) - 0.4, -0.6)
    ax.set_xlabel(f"order of {ladders[0].letter} ({words.USUAL_NORM})")
    return stated


def draw_stated(ax: Axes, ladder: Ladder, colour: str, norm: str = TYPICAL_NORM) -> bool:
    """Draw the stated order as a bar over the levels of its window, with its interval; return whether there is one."""
    order, low, high = ladder.stated_order(norm)
    first, last = ladder.window
    if not np.isfinite([order, low, high]).all() or last <= first:
        return False
    ends = [first, last]
    ax.fill_between(ends, low, high, color=colour, alpha=0.18, linewidth=0, zorder=0.5)
    wide: Any = {"linewidth": 4, "alpha": 0.35, "solid_capstyle": "butt", "zorder": 1.2}
    ax.plot(ends, [order, order], color=colour, **wide)
    return True


def _order_limits(values: Floats, promised: list[float]) -> tuple[float, float]:
    """Return limits around the promised orders and `values`, at most 5 below the smallest and 2 above the largest."""
    if not promised:
        return style.limits(values)
    low = min([promised[0] - 0.3, *values.tolist()])
    high = max([promised[-1] + 0.3, *values.tolist()])
    room = 0.08 * (high - low)
    return max(low - room, promised[0] - 5), min(high + room, promised[-1] + 2)
