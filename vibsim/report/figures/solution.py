"""The solution with its error bar: estimated beside true error over time.

Source: pendulum lecture, section 2.5 (the estimate from two levels), and Richardson's extrapolation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.core.record import Record
from vibsim.report import data, style
from vibsim.report.data import Floats, Member
from vibsim.report.figures.panels import (
    decades,
    explosive,
    figure_of,
    note,
    panels,
    stop_at_breakdown,
)
from vibsim.report.style import Picture
from vibsim.report.text import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CUT = 3.0
"""A solution that grows beyond so many times the exact one is cut off there, and the panel says so."""
TINY = 1e-18
"""Smallest relative size that a logarithmic panel shows: anything below is an accident of rounding."""


def solution(record: Record, quantity: str, member: Member) -> Picture:
    """Draw the solution, and below it, on a logarithmic scale, its estimated and its true error."""
    t, letter = data.times(record, member.case), words.symbol(quantity)
    measure = data.unit(record, f"{quantity}_finest")
    axes = panels([2.3, 2.5])
    exact = _draw_solution(axes[0], t, record, quantity, member)
    axes[0].set_ylabel(style.label(letter, measure))
    axes[0].set_title(f"Solution {letter}(t)")
    thickness = _draw_band(axes[0], t, record, quantity, member)
    _draw_errors(axes[1], t, record, quantity, member)
    axes[1].set_ylabel(style.label(f"|error of {letter}|", measure))
    axes[1].set_title("Estimated beside true error" if exact else "Estimated error")
    axes[1].set_xlabel(style.label("t", data.time_unit(record)))
    caption = (
        f"Top: the finest level, and the value extrapolated from the two finest ones with its error bar{thickness}. "
        "Bottom: the error that the difference of two levels predicts"
    )
    caption += (
        " (lines), and the true error (dots). Dots on the lines mean that the estimate can be trusted."
        if exact
        else ". No exact solution is known here, so the estimate stands alone."
    )
    return Picture(
        name=f"solution_{quantity}_{member.stem}",
        title=f"Solution with its error: {letter}, {member.title}",
        caption=caption,
        alt=f"{words.name(quantity)} against time for {member.title}, and its estimated error on a logarithmic scale",
        figure=figure_of(axes[0]),
    )


def _draw_band(ax: Axes, t: Floats, record: Record, quantity: str, member: Member) -> str:
    """Draw the error bar of the extrapolated solution as a band, and say how thick it is."""
    centre = data.at(record, f"{quantity}_richardson", member)
    bound = data.at(record, f"{quantity}_richardson_error", member)
    if not np.isfinite(bound).all():
        return ""
    thickest = float(np.max(bound))
    size = f"at most {words.number(thickest)} {data.unit(record, f'{quantity}_finest')}".strip()
    low, high = ax.get_ylim()
    if thickest < 0.005 * (high - low):
        return f" ({size}: thinner than the line)"
    (x, bottom), (x_top, top) = style.thin(t, centre - bound), style.thin(t, centre + bound)
    ax.fill([*x, *x_top[::-1]], [*bottom, *top[::-1]], color="#56B4E9", alpha=0.35, linewidth=0)
    ax.set_ylim(low, high)
    return f" (the band, {size})"


def _draw_solution(ax: Axes, t: Floats, record: Record, quantity: str, member: Member) -> bool:
    finest = data.whole(record, "level")[-1]
    exact = data.exact_series(record, quantity, member)
    pale: dict[str, Any] = {"color": "#56B4E9", "linewidth": 4.5, "alpha": 0.7}
    solid: dict[str, Any] = {"color": "#0072B2", "linewidth": 1.4}
    dotted: dict[str, Any] = {"color": "black", "linewidth": 1.4, "linestyle": (0, (1, 3))}
    rows = [
        (data.at(record, f"{quantity}_richardson", member), "extrapolated (Richardson)", pale),
        (data.at(record, f"{quantity}_finest", member), f"level {finest}", solid),
        (exact, "exact", dotted),
    ]
    drawn = [(y, text, look) for y, text, look in rows if np.isfinite(y).any()]
    for y, text, look in drawn:
        ax.plot(*style.thin(t, y), label=text, **look)
    stop_at_breakdown(ax, t, [data.at(record, f"{quantity}_finest", member)])
    # a run that blew up would hide the others
    ranged = [y for y, _, _ in drawn if np.isfinite(y).all()] or [y for y, _, _ in drawn]
    size = data.largest(exact) if np.isfinite(exact).all() else 0.0
    if 0.0 < size < max(data.largest(y) for y, _, _ in drawn) / CUT:
        ax.set_ylim(-CUT * size, CUT * size)
        note(ax, f"cut off at {CUT:g} times the exact solution", 0.11)
    elif explosive(ranged):
        for line in ax.lines:
            line.set_ydata(style.no_zeros(np.asarray(line.get_ydata(), dtype=np.float64)))
        style.log_axis(ax, "y", *decades(ranged))
        note(ax, "size, without the sign", 0.11)
    else:
        ax.set_ylim(*style.limits(*ranged))
    style.beside(ax)
    return bool(np.isfinite(exact).any())


def _draw_errors(ax: Axes, t: Floats, record: Record, quantity: str, member: Member) -> None:
    pairs = data.whole(record, "pair")
    estimates = [
        data.at(record, f"{quantity}_error_estimate", member, pair=i) for i in range(len(pairs))
    ]
    # a run that blew up has no error worth a scale of its own, unless all did
    chosen = [i for i, estimate in enumerate(estimates) if np.isfinite(estimate).all()] or list(
        range(len(pairs))
    )
    drawn: list[Floats] = []
    for k, i in enumerate(dict.fromkeys([chosen[0], chosen[-1]]) if chosen else []):
        drawn += _draw_pair(ax, t, record, quantity, member, i, style.COLOURS[k])
    bound = data.at(record, f"{quantity}_richardson_error", member)
    if np.isfinite(bound).all():
        drawn.append(style.no_zeros(bound))
        ax.plot(*style.thin(t, drawn[-1]), color=style.COLOURS[2], label="bound, extrapolated")
        true = data.exact_series(record, quantity, member)
        true = true - data.at(record, f"{quantity}_richardson", member)
        drawn += _dots(ax, t, style.no_zeros(true), style.COLOURS[2], "true, extrapolated")
    # dips at zero crossings may leave the range below
    if not style.fit_log_axis(ax, "y", *drawn, below=0.03, least=TINY):
        style.remark(ax, "no error to draw: it is zero, or not known")
    style.beside(ax)


def _draw_pair(
    ax: Axes, t: Floats, record: Record, quantity: str, member: Member, i: int, colour: str
) -> list[Floats]:
    pair = data.whole(record, "pair")[i]
    estimate = style.no_zeros(data.at(record, f"{quantity}_error_estimate", member, pair=i))
    ax.plot(
        *style.thin(t, estimate),
        color=colour,
        linestyle="-" if colour == style.COLOURS[0] else style.DASHES[1],
        label=f"estimate, level {pair}",
    )
    true = style.no_zeros(data.at(record, f"{quantity}_error", member, pair=i))
    return [estimate, *_dots(ax, t, true, colour, f"true, level {pair}")]


def _dots(ax: Axes, t: Floats, values: Floats, colour: str, text: str) -> list[Floats]:
    """Draw a true error as dots, few enough to leave the line beneath them visible."""
    if not np.isfinite(values).any():
        return []
    every = slice(None, None, max(1, t.size // 60))
    ax.plot(
        t[every],
        values[every],
        linestyle="none",
        marker="o",
        markersize=3.2,
        color=colour,
        markerfacecolor="white",
        markeredgewidth=0.9,
        label=text,
    )
    return [values]
