"""Order, error and verdict of every member along one swept parameter, each with its error bar."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.record import Record
from vibsim.core.vocabulary import SEVERITY, TYPICAL_NORM
from vibsim.report import finest_level, frame, style
from vibsim.report.choice import promises
from vibsim.report.data import Floats, due, flags, norm_unit, whole
from vibsim.report.figures import separatrix
from vibsim.report.figures.panels import figure_of, panels
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Along
from vibsim.report.text import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from vibsim.experiment import Experiment

MARKED = 60
"""Most members that get a marker each; above, a line says it better."""


def orders(experiment: Experiment, record: Record, along: Along, quantity: str) -> Picture:
    """Draw the stated order of every member and its error, with their intervals, and the verdict as a strip below."""
    schemes, letter = record.words("scheme"), words.symbol(quantity)
    row = 0.17 if style.crowded(record) else 0.3
    axes = panels([2.3, 1.9, row * max(2, len(schemes))])
    _draw_orders(axes[0], experiment, record, along, quantity)
    is_known, leaves = _draw_errors(axes[1], record, along, quantity)
    _draw_verdicts(axes[2], along, flags(record, f"{quantity}_status"), schemes)
    marked = finish(axes, experiment, along)
    error = (
        "Then the error of the finest level: the true one (dots), and what two levels alone say of it (lines, "
        "with the interval of the order)."
        if is_known
        else "Then the error of the finest level, estimated from two levels, with the interval of the order."
    )
    return Picture(
        name=f"sweep_order_{quantity}",
        title=f"Order and error of every member: {letter}",
        caption="Top: the order that each member's levels state; a grey band is an order that is "
        f"{due(record, quantity)}, with the tolerance of its check. {error} Bottom: what can be said of it. Members "
        "that fail or stay open are worth a look one by one."
        f"{marked}{f' {frame.LEAVING}' if leaves else ''}",
        alt=f"Stated order of {words.name(quantity)}, its error and its verdict against the swept parameter",
        figure=figure_of(axes[0]),
    )


def finish(axes: list[Axes], experiment: Experiment, along: Along) -> str:
    """Give the common axis its scale, label and separatrix; return the sentence on the latter."""
    key = along.key
    if key.is_log:
        room = (key.distinct[-1] / key.distinct[0]) ** 0.03
        low, high = float(key.distinct[0] / room), float(key.distinct[-1] * room)
        style.log_axis(axes[-1], "x", low, high)
    if key.words:
        axes[-1].set_xticks(key.distinct, key.words)
    axes[-1].set_xlabel(key.label)
    is_alone = len(along.lines) == 1 and not along.follows
    found = separatrix.on_line(experiment, key).tolist() if is_alone else []
    for ax in axes:
        for x in found:
            ax.axvline(x, color="black", linestyle=(0, (1, 2)), linewidth=1.0, zorder=1)
    return " Dotted: the separatrix, where the exact period is infinite." if found else ""


def _draw_orders(
    ax: Axes, experiment: Experiment, record: Record, along: Along, quantity: str
) -> None:
    promised = promises(experiment, record, quantity)
    for order, tolerance in promised:
        ax.axhspan(order - tolerance, order + tolerance, **style.ALLOWED)
        text = f"{due(record, quantity)}, {order:g} ± {tolerance:g}"
        ax.axhline(order, **style.REFERENCE, label=text)
    value, low, high = finest_level.orders(record, quantity)
    for s, scheme in enumerate(record.words("scheme")):
        look = style.look(s) | {"linestyle": "-", "markersize": 4, "linewidth": 0.8}
        for k, (_, members) in enumerate(along.lines):
            x = along.key.values[members]
            interval(ax, x, low[s, members], high[s, members], look["color"])
            line(ax, x, value[s, members], label="" if k else style.entry(scheme), **look)
    if promised:
        least, most = promised[0][0], promised[-1][0]
        bottom, top = style.limits(value, np.array([least - 0.25, most + 0.25]))
        ax.set_ylim(max(bottom, least - 3), min(top, most + 2))
    ax.set_ylabel(f"order of {words.symbol(quantity)} ({TYPICAL_NORM})")
    ax.set_title("Stated order with its interval")
    style.beside(ax, **({"fontsize": 7.5} if style.crowded(record) else {}))


def _draw_errors(ax: Axes, record: Record, along: Along, quantity: str) -> tuple[bool, bool]:
    """Draw the error of the finest level; return whether the true one is known, and whether any leaves the frame."""
    found, schemes = finest_level.error(record, quantity), record.words("scheme")
    size = frame.sizes(record, quantity)
    true, estimated = (
        np.where(frame.is_bounded(part, size), part, np.nan)
        for part in (found.true, found.estimate)
    )
    for s, scheme in enumerate(schemes):
        look = style.look(s)
        several = f", {scheme}" if len(schemes) > 1 else ""
        for k, (_, members) in enumerate(along.lines):
            x = along.key.values[members]
            # what is beyond the frame has no bar across it
            there = np.isfinite(estimated[s, members])
            low, high = (
                np.where(there, style.no_zeros(part[s, members]), np.nan)
                for part in (found.low, found.high)
            )
            interval(ax, x, low, high, look["color"])
            estimate = style.no_zeros(found.estimate[s, members])
            text = "" if k else f"estimated{several}"
            line(ax, x, estimate, color=look["color"], linewidth=1.0, label=text)
            dotted = style.no_zeros(found.true[s, members])
            if np.isfinite(dotted).any():
                text = "" if k else f"true{several}"
                dots = look | {"linestyle": "none", "markersize": 4, "markerfacecolor": "white"}
                line(ax, x, dotted, label=text, **dots)
    leaves = False
    # where nothing is bounded all of it makes the range
    for values in ((true, estimated), (found.true, found.estimate)):
        joined = np.concatenate(values, axis=None)
        if style.fit_log_axis(ax, "y", joined, below=0.005, least=1e-16):
            leaves = mark_members(ax, along, found.best)
            break
    ax.set_ylabel(
        style.label(f"error of {words.symbol(quantity)}", norm_unit(record, quantity, TYPICAL_NORM))
    )
    ax.set_title(f"Error on level {whole(record, 'level')[-1]} ({TYPICAL_NORM} norm)")
    if not style.crowded(record):
        style.beside(ax)
    return found.is_known, leaves


def mark_members(ax: Axes, along: Along, values: Floats) -> bool:
    """Mark at the upper edge what grows out of the frame, of values of the shape (scheme, case); say whether any does.

    Of few members each is marked, of many the first of every stretch.
    """
    high, leaves = ax.get_ylim()[1], False
    for s in range(values.shape[0]):
        for _, members in along.lines:
            x, y = along.key.values[members], values[s, members]
            grown = np.where(y > high, y, np.where(np.isfinite(y), high, np.nan))
            each = x.size <= MARKED
            leaves |= frame.mark_leaving(ax, x, grown, color=style.look(s)["color"], each=each)
    return leaves


def line(ax: Axes, x: Floats, y: Floats, **look: Any) -> None:
    """Draw a quantity over members in the order of `x`, thinned; markers only while they are few."""
    if x.size > MARKED:
        look["marker"] = "," if look.get("linestyle") == "none" else ""
    ax.plot(*style.thin(x, y), **look)


def interval(ax: Axes, x: Floats, low: Floats, high: Floats, colour: str) -> None:
    """Draw error bars: one for each of few members, else a band between two lines."""
    if x.size <= MARKED:
        ax.vlines(x, low, high, color=colour, linewidth=2.4, alpha=0.4)
        return
    for bound in (low, high):
        ax.plot(*style.thin(x, bound), color=colour, linewidth=0.6, alpha=0.6)


def _draw_verdicts(ax: Axes, along: Along, status: NDArray[Any], schemes: list[str]) -> None:
    """Draw one row per scheme; every verdict has a colour, a marker and a height of its own."""
    lift = {"PASS": 0.0, "INCONCLUSIVE": 0.17, "FAIL": 0.34}
    order = np.argsort(along.key.values, kind="stable")
    x = along.key.values[order]
    for word in SEVERITY:
        found = [(s, x[status[s][order] == word]) for s in range(len(schemes))]
        points = [style.thin(x, np.full(x.size, s + lift[word])) for s, x in found if x.size]
        xs = np.concatenate([x for x, _ in points] or [np.empty(0)])
        ys = np.concatenate([y for _, y in points] or [np.empty(0)])
        ax.plot(
            xs,
            ys,
            linestyle="none",
            marker=style.STATUS_MARKERS[word],
            markersize=3.5 if len(schemes) > style.MANY else 5,
            color=style.STATUS_COLOURS[word],
            markeredgecolor="black",
            markeredgewidth=0.3,
            label=f"{word} ({int((status == word).sum())})",
            clip_on=False,
        )
    many = len(schemes) > style.MANY
    ax.set_yticks(np.arange(len(schemes)) + 0.17, schemes, fontsize=8.0 if many else 8.5)
    ax.set_ylim(-0.3, len(schemes) - 0.3)
    ax.grid(visible=False, axis="y")
    if not many:
        style.beside(ax, handlelength=1.2)
        return
    # there is room for many names at the right only, and for the legend then above
    ax.tick_params(axis="y", left=False, labelleft=False, labelright=True)
    place: dict[str, Any] = {
        "loc": "lower left",
        "bbox_to_anchor": (0.0, 1.0),
        "borderaxespad": 0.1,
    }
    ax.legend(ncols=3, fontsize=8, handlelength=1.2, **place)
