"""Figures over a swept parameter: the period, the order of every member, and the map of verdicts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.record import Record
from vibsim.report import style, words
from vibsim.report.data import (
    Floats,
    exact_periods,
    flags,
    pick,
    promises,
    swept,
    swept_label,
    unit,
    whole,
)
from vibsim.report.panels import figure_of, panels
from vibsim.report.style import Picture
from vibsim.vocabulary import SEVERITY, TYPICAL_NORM

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from vibsim.spec import Experiment

LINES = 6
"""Most lines that the other parameters of a sweep may make."""
MARKED = 60
"""Most members that get a marker each; above, a line says it better."""


@dataclass(frozen=True)
class Axis:
    """How members are laid out along an axis."""

    label: str
    x: Floats
    """Abscissa of every member, shape (case,)."""
    lines: tuple[tuple[str, NDArray[np.intp]], ...]
    """Members that belong to one line, in the order of `x`, with a name; one line without a name is usual."""


def axis(record: Record) -> Axis:
    """Lay members out along the swept parameter with most values, one line per value of the others.

    Where the sweep is no numbers, or there would be too many lines, members are laid out by their number.
    """
    found = swept(record)
    numeric = all(np.issubdtype(record[name].dtype, np.number) for name in found)
    values = [np.asarray(record[name]) for name in found]
    longest = max(range(len(found)), key=lambda i: np.unique(values[i]).size)
    others = [i for i in range(len(found)) if i != longest]
    combined = (
        np.stack([values[i] for i in others], axis=1)
        if others and numeric
        else np.empty((len(values[0]), 0))
    )
    groups, belongs = (
        np.unique(combined, axis=0, return_inverse=True) if others and numeric else ([()], None)
    )
    if not numeric or len(groups) > LINES:
        case = np.asarray(record["case"], dtype=np.float64)
        return Axis("number of the member", case, (("", np.arange(case.size)),))
    x = values[longest].astype(np.float64)
    order = np.argsort(x, kind="stable")
    lines = []
    for g, group in enumerate(groups):
        names_ = [
            f"{swept_label(record, found[i])[0]} = {v:.4g}"
            for i, v in zip(others, group, strict=True)
        ]
        lines.append(
            (", ".join(names_), order if belongs is None else order[belongs.ravel()[order] == g])
        )
    return Axis(style.label(*swept_label(record, found[longest])), x, tuple(lines))


def period(record: Record) -> Picture | None:
    """Draw the period of every member and its relative error; None where no member has a period."""
    computed = (
        np.asarray(record["period"], dtype=np.float64) if "period" in record else np.array([np.nan])
    )
    if not np.isfinite(computed).any():
        return None
    exact = exact_periods(record)
    along, known = axis(record), bool(np.isfinite(exact).any())
    axes = panels([2.4, 2.4] if known else [2.6])
    levels, schemes = whole(record, "level"), record.words("scheme")
    for k, (name, members) in enumerate(along.lines):
        x = along.x[members]
        if known:
            label = "" if k else "exact"
            _line(axes[0], x, exact[members], color="black", linewidth=1.0, label=label, zorder=1)
        for s, scheme in enumerate(schemes):
            label = _text(scheme if len(schemes) > 1 else "", name, f"level {levels[-1]}")
            _line(
                axes[0],
                x,
                computed[s, members, -1],
                linestyle="none",
                label=label,
                **_mark(s, s + k, len(schemes)),
            )
    if known:
        error = np.abs(computed / exact[None, :, None] - 1.0)
        _draw_period_errors(axes[1], along, error, levels, schemes)
    axes[0].set_ylabel(style.label("period", unit(record, "period")))
    axes[0].set_title("Period")
    axes[-1].set_xlabel(along.label)
    style.beside(axes[0], fontsize=8)
    caption = (
        "Top: the measured period and the exact one. Bottom: its relative error; from level to level it should fall "
        "by the same factor, so lines of successive levels are evenly spaced, and where they are not the coarse "
        "levels are too coarse."
    )
    return Picture(
        name="period",
        title="Period over the swept parameter",
        caption=caption if known else "The measured period on the finest level.",
        alt="Period and its relative error against the swept parameter",
        figure=figure_of(axes[0]),
    )


def _draw_period_errors(
    ax: Axes, along: Axis, error: Floats, levels: list[int], schemes: list[str]
) -> None:
    several = len(along.lines) > 1
    count = 1 if several else 6 if len(schemes) == 1 else 3
    chosen = np.unique(
        np.linspace(len(levels) - 1, 0, min(len(levels), count)).round().astype(int)
    )[::-1]
    for k, (name, members) in enumerate(along.lines):
        for s, scheme in enumerate(schemes):
            for m, i in enumerate(chosen):
                colour = k + s if several else m
                label = _text(scheme if len(schemes) > 1 else "", name, f"level {levels[i]}")
                look = _mark(s, colour, len(schemes)) | {
                    "linestyle": style.look(colour)["linestyle"],
                    "linewidth": 1.2,
                }
                _line(ax, along.x[members], error[s, members, i], label=label, **look)
    shown = error[:, :, chosen]
    positive = shown[np.isfinite(shown) & (shown > 0)]
    if positive.size:
        style.log_axis(ax, "y", float(positive.min()) / 2, float(positive.max()) * 2)
    ax.set_ylabel("|period / exact − 1|")
    ax.set_title("Relative error of the period")
    style.beside(ax, fontsize=8)


def _text(*parts: str) -> str:
    return style.entry(", ".join(part for part in parts if part))


def _mark(scheme: int, colour: int, count: int) -> dict[str, Any]:
    """Return a marker of a scheme; of several the first is large and hollow, so that all stay visible."""
    look: dict[str, Any] = {
        "marker": style.look(scheme)["marker"],
        "color": style.look(colour)["color"],
        "markersize": 4.5,
    }
    if count > 1 and scheme == 0:
        look |= {"markerfacecolor": "none", "markersize": 8}
    return look


def _line(ax: Axes, x: Floats, y: Floats, **look: Any) -> None:
    """Draw a quantity over members in the order of `x`, thinned; markers only while they are few."""
    if x.size > MARKED:
        look["marker"] = "," if look.get("linestyle") == "none" else ""
    ax.plot(*style.thin(x, y), **look)


def orders(experiment: Experiment, record: Record, quantity: str) -> Picture:
    """Draw the stated order of every member with its interval, and the verdict on it as a strip below."""
    along, schemes = axis(record), record.words("scheme")
    norm = record.words("norm").index(TYPICAL_NORM)
    axes = panels([2.3, 0.3 * max(2, len(schemes))])
    promised = promises(experiment, record, quantity)
    for order, tolerance in promised:
        axes[0].axhspan(order - tolerance, order + tolerance, color="#ececec", zorder=0)
        axes[0].axhline(
            order,
            color="black",
            linestyle=(0, (4, 3)),
            linewidth=1.0,
            zorder=1,
            label=f"promised, {order:g} ± {tolerance:g}",
        )
    for s, scheme in enumerate(schemes):
        value, low, high = (
            pick(record, f"{quantity}_order{end}", scheme=s, norm=norm)
            for end in ("", "_low", "_high")
        )
        for k, (_, members) in enumerate(along.lines):
            _draw_interval(
                axes[0], along.x[members], low[members], high[members], style.look(s)["color"]
            )
            _line(
                axes[0],
                along.x[members],
                value[members],
                **style.look(s) | {"linestyle": "-"},
                markersize=4,
                linewidth=0.8,
                label="" if k else style.entry(scheme),
            )
    values = np.asarray(record[f"{quantity}_order"])[..., norm]
    bottom, top = style.limits(values, np.array([promised[0][0] - 0.25, promised[-1][0] + 0.25]))
    axes[0].set_ylim(max(bottom, promised[0][0] - 3), min(top, promised[-1][0] + 2))
    letter = words.symbol(quantity)
    axes[0].set_ylabel(f"order of {letter} ({TYPICAL_NORM})")
    axes[0].set_title("Stated order with its interval")
    style.beside(axes[0])
    _draw_verdicts(axes[1], along, flags(record, f"{quantity}_status"), schemes)
    axes[1].set_xlabel(along.label)
    return Picture(
        name=f"sweep_order_{quantity}",
        title=f"Order of every member: {letter}",
        caption="Top: the order that each member's levels state; a grey band is a promised order with the tolerance of "
        "its check. Bottom: what can be said of it. Members that fail or stay open are worth a look one by one.",
        alt=f"Stated order of {words.name(quantity)} and its verdict against the swept parameter",
        figure=figure_of(axes[0]),
    )


def _draw_interval(ax: Axes, x: Floats, low: Floats, high: Floats, colour: str) -> None:
    if x.size <= MARKED:
        ax.vlines(x, low, high, color=colour, linewidth=2.4, alpha=0.4)
        return
    for bound in (low, high):
        ax.plot(*style.thin(x, bound), color=colour, linewidth=0.6, alpha=0.6)


def _draw_verdicts(ax: Axes, along: Axis, status: NDArray[Any], schemes: list[str]) -> None:
    """Draw one row per scheme; every verdict has a colour, a marker and a height of its own."""
    lift = {"PASS": 0.0, "INCONCLUSIVE": 0.17, "FAIL": 0.34}
    marks = {"PASS": "o", "INCONCLUSIVE": "s", "FAIL": "X"}
    order = np.argsort(along.x, kind="stable")
    for word in SEVERITY:
        found = [(s, along.x[order][status[s][order] == word]) for s in range(len(schemes))]
        points = [style.thin(x, np.full(x.size, s + lift[word])) for s, x in found if x.size]
        xs = np.concatenate([x for x, _ in points] or [np.empty(0)])
        ys = np.concatenate([y for _, y in points] or [np.empty(0)])
        ax.plot(
            xs,
            ys,
            linestyle="none",
            marker=marks[word],
            markersize=5,
            color=style.STATUS_COLOURS[word],
            markeredgecolor="black",
            markeredgewidth=0.3,
            label=f"{word} ({int((status == word).sum())})",
            clip_on=False,
        )
    ax.set_yticks(np.arange(len(schemes)) + 0.17, schemes)
    ax.set_ylim(-0.3, len(schemes) - 0.3)
    ax.grid(visible=False, axis="y")
    style.beside(ax, handlelength=1.2)
