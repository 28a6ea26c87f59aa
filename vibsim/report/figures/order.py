"""The size of the error against the step, and the order that three successive levels give.

Source: pendulum lecture, section 2.5.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.core.record import Record
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.report import data, style
from vibsim.report.choice import promises
from vibsim.report.data import Floats, Member
from vibsim.report.figures import local_order
from vibsim.report.figures.panels import legend_above, rows_of
from vibsim.report.style import Picture
from vibsim.report.text import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from vibsim.experiment import Experiment

SLOPES: tuple[Any, ...] = ((0, (4, 3)), (0, (1.2, 1.6)), (0, (7, 2, 1.2, 2)), (0, (10, 2)))
"""Dashes of several promised slopes."""
WILD = 1e4
"""Errors beyond so many times the upper quartile leave the frame."""


def against_step(experiment: Experiment, record: Record, quantity: str, case: int) -> Picture:
    """Draw the norms of differences and errors against the step, and the local order against the level."""
    schemes = record.words("scheme")
    many = style.crowded(record)
    panel = max(2.2, 0.17 * len(schemes)) if many else 2.2
    second = (6.1, 2.7) if many else (5.0, 3.8)
    figure, (left, right) = rows_of(2, [(0.8, 3.3), second], panel, 0.6, 0.5)
    kinds = _draw_norms(left, experiment, record, quantity, case, schemes)
    draw = local_order.draw_each if many else local_order.draw
    is_settled = draw(right, experiment, record, quantity, case, schemes)
    legend_above(figure, left)
    member = data.case_name(record, case)
    suffix = f", {member}" if member else ""
    letter = words.symbol(quantity)
    return Picture(
        name=f"order_{quantity}_{case}",
        title=f"How fast does the error shrink? {letter}{suffix}",
        caption=_caption(kinds, is_settled, many, data.due(record, quantity)),
        alt=f"Norm of the level differences of {words.name(quantity)} against the step, and local order against level",
        figure=figure,
    )


def _caption(
    kinds: frozenset[str], is_settled: bool | None, many: bool = False, due: str = "promised"
) -> str:
    """Explain what is drawn, and nothing else (see `_draw_norms`, `_draw_orders`)."""
    if not kinds:
        return "Nothing is drawn: there is no error to measure here."
    shown = "size of the level differences (filled)" if "difference" in kinds else ""
    true = "size of the true error (hollow)" if "true" in kinds else ""
    parts = [
        f"Left: {' and '.join(filter(None, [shown, true]))} against dt.",
        f"Parallel to a dashed line means that {due} order." if "slope" in kinds else "",
        "Points on the dotted line are round-off." if "floor" in kinds else "",
    ]
    if is_settled is not None and many:
        parts.append(
            "Right: the stated order of every scheme with its interval; where none is stated, hollow, the order of the "
            f"finest three levels; the vertical stroke is the {due} one."
        )
    elif is_settled is not None:
        parts.append(
            "Right: the order that three successive levels give, drawn at the coarsest of the three; it should "
            "settle inside a grey band; orders beyond the frame come from levels that are too coarse, within "
            "round-off, or of runs that grow without bound. A scheme that differs by round-off alone has none."
        )
    if is_settled and not many:
        parts.append("The bar is the stated order with its interval, over the levels it rests on.")
    return style.sentences(*parts)


def _draw_norms(
    ax: Axes, experiment: Experiment, record: Record, quantity: str, case: int, schemes: list[str]
) -> frozenset[str]:
    """Draw the norms; return what is seen: ``difference``, ``true``, ``slope``, ``floor``."""
    dt, norm = data.steps_of(record, case), record.words("norm").index(TYPICAL_NORM)
    measure = data.norm_unit(record, quantity, TYPICAL_NORM)
    seen: list[Floats] = []
    floors: list[Floats] = []
    promised = data.formal_orders(record, quantity)[:, case]
    for s, scheme in enumerate(schemes):
        if np.isnan(promised[s]):
            # a scheme that chooses its own steps has no error against dt
            continue
        member = Member(s, case, scheme)
        look = style.look(s)
        difference = style.no_zeros(
            data.at(record, f"{quantity}_difference_norm", member, norm=norm)
        )
        true = style.no_zeros(data.at(record, f"{quantity}_error_norm", member, norm=norm))
        ax.plot(
            dt[: difference.size],
            difference,
            **look,
            markersize=5,
            linewidth=1.1,
            label=style.entry(scheme),
        )
        if np.isfinite(true).any():
            ax.plot(
                dt,
                true,
                **look | {"linestyle": "none"},
                markersize=7,
                markerfacecolor="none",
            )
        floors.append(style.no_zeros(data.floor_norm(record, quantity, member, TYPICAL_NORM)))
        ax.plot(dt, floors[-1], color=look["color"], linestyle=":", linewidth=1.0)
        seen += [difference, true]
    if not any(np.isfinite(part).any() for part in seen):
        for line in list(ax.lines):
            line.remove()
        ax.set(xticks=[], yticks=[])
        style.remark(ax, "every difference and error is zero,\nor not finite: nothing to draw")
        return frozenset()
    orders = dict.fromkeys(order for order, _ in promises(experiment, record, quantity))
    slopes = [
        _reference(
            ax,
            dt,
            seen,
            order,
            f"slope {order:g} ({data.due(record, quantity)})",
            SLOPES[k % len(SLOPES)] if len(orders) > 1 else "",
        )
        for k, order in enumerate(orders)
    ]
    near = _step_limits(ax, dt, seen, floors)
    kinds = {
        "difference": any(np.isfinite(part).any() for part in seen[::2]),
        "true": any(np.isfinite(part).any() for part in seen[1::2]),
        "slope": any(slopes),
        "floor": near,
    }
    found = frozenset(kind for kind, is_seen in kinds.items() if is_seen)
    _explain(ax, found)
    ax.set_xlabel(style.label("dt", data.time_unit(record, "dt")))
    ax.set_ylabel(style.label(f"{TYPICAL_NORM} norm, {words.symbol(quantity)}", measure))
    _level_axis(ax, dt, data.whole(record, "level"))
    return found


def _explain(ax: Axes, kinds: frozenset[str]) -> None:
    """Add to the legend what filled, hollow and dotted mean, once for all schemes."""
    look: dict[str, Any] = {"color": style.GREY, "marker": "o", "linestyle": "none"}
    if "difference" in kinds:
        ax.plot([], [], **look, markersize=5, label="level difference")
    if "true" in kinds:
        ax.plot([], [], **look, markersize=7, markerfacecolor="none", label="true error")
    if "floor" in kinds:
        ax.plot([], [], color=style.GREY, linestyle=":", linewidth=1.0, label="predicted round-off")


def _positive(parts: list[Floats]) -> Floats:
    joined = np.concatenate([part[np.isfinite(part) & (part > 0)] for part in parts])
    return joined if joined.size else np.array([1.0])


def _highest(values: Floats) -> float:
    """Return the largest value that a range holds: an unstable level would hide all others."""
    return min(float(values.max()), WILD * float(np.quantile(values, 0.75)), style.LARGEST)


def _reference(
    ax: Axes, dt: Floats, seen: list[Floats], order: float, label: str, dashes: Any
) -> bool:
    """Draw the promised slope a little above the largest value at the coarsest step, and say whether there is room.

    Of several each has dashes of its own, and its number at its end.
    """
    coarsest = np.array([part[0] for part in seen if np.isfinite(part[0])] or [1.0])
    start = 2.5 * _highest(coarsest)
    lowest = _positive(seen).min()
    reach = dt[start * (dt / dt[0]) ** order >= lowest]
    is_drawn = bool(reach.size > 1 and start > 0)
    if is_drawn:
        ax.plot(
            reach,
            start * (reach / dt[0]) ** order,
            **style.REFERENCE | ({"linestyle": dashes} if dashes else {}),
            label=label,
        )
    if is_drawn and dashes:
        end = float(reach[-1]), float(start * (reach[-1] / dt[0]) ** order)
        ax.annotate(
            f"{order:g}",
            end,
            xytext=(-2, 0),
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize=7.5,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8},
            annotation_clip=True,
        )
    return is_drawn


def _step_limits(ax: Axes, dt: Floats, seen: list[Floats], floors: list[Floats]) -> bool:
    """Set the ranges; show the floor, and say so, only where the data come within three decades of it."""
    values = _positive(seen)
    low, high = float(values.min()), _highest(values)
    floor = float(_positive(floors).max())
    near = floor > 1e-3 * low
    bottom = min(low, floor) if near else low
    top = max(8 * high, min(2 * floor, 1e3 * high)) if near else 8 * high
    style.log_axis(ax, "y", bottom / 3, top)
    style.log_axis(ax, "x", float(dt[-1]) / 1.5, float(dt[0]) * 1.5)
    return near


def _level_axis(ax: Axes, dt: Floats, levels: list[int]) -> None:
    """Write the levels along the top."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    top = ax.secondary_xaxis("top")
    every = max(1, len(levels) // 8)
    chosen = dict(zip(dt[::every].tolist(), levels[::every], strict=True))
    top.xaxis.set_major_locator(FixedLocator(list(chosen)))
    top.xaxis.set_minor_locator(NullLocator())
    top.xaxis.set_major_formatter(
        FuncFormatter(lambda x, _: str(chosen[min(chosen, key=lambda d: abs(d - x))]))
    )
    ax.text(-0.02, 1.03, "level", transform=ax.transAxes, ha="right", va="bottom", fontsize=8.5)
