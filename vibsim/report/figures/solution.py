"""The solution with its error bar: estimated beside true error over time.

Source: pendulum lecture, section 2.5 (the estimate from two levels), and Richardson's extrapolation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.report import data, style
from vibsim.report.data import Member
from vibsim.report.figures import panels
from vibsim.report.style import Picture
from vibsim.report.text import words
from vibsim.report.types import Axes

CUT = 3.0
"""A solution that grows beyond so many times the exact one is cut off there, and the panel says so."""
TINY = 1e-18
"""Smallest relative size that a logarithmic panel shows: anything below is an accident of rounding."""
PALE = "#56B4E9"


def solution(record: Record, quantity: str, member: Member) -> Picture:
    """Draw the solution, and below it, on a logarithmic scale, its estimated and its true error."""
    t, letter = data.times(record, member.case), words.symbol(quantity)
    measure = data.unit(record, f"{quantity}_finest")
    exact = data.exact_series(record, quantity, member)
    best, bound = (data.at(record, f"{quantity}_richardson{end}", member) for end in ("", "_error"))
    is_known = bool(np.isfinite(exact).any())
    axes = panels.stacked([2.3, 2.5], style.TIME)
    finest = data.at(record, f"{quantity}_finest", member)
    _draw_solution(axes[0], t, finest, best, exact, data.whole(record, "level")[-1])
    axes[0].set(ylabel=style.label(letter, measure), title=f"Solution {letter}(t)")
    thickness = _draw_band(axes[0], t, best, bound, measure)
    _draw_errors(axes[1], t, record, quantity, member, bound, exact - best)
    axes[1].set_ylabel(style.label(f"|error of {letter}|", measure))
    axes[1].set_title("Estimated beside true error" if is_known else "Estimated error")
    axes[1].set_xlabel(data.time_label(record))
    trust = (
        " (lines), and the true error (dots). Dots on the lines mean that the estimate can be trusted."
        if is_known
        else "."
    )
    return Picture(
        name=f"solution_{quantity}_{member.stem}",
        title=f"Solution with its error: {letter}, {member.title}",
        caption=f"Top: the finest level, and the value extrapolated from the two finest ones with its error bar"
        f"{thickness}. Bottom: the error that the difference of two levels predicts{trust}",
        alt=f"{words.name(quantity)} against time for {member.title}, and its estimated error on a logarithmic scale",
        figure=axes[0].get_figure(root=True),
    )


def _draw_band(ax: Axes, t: Floats, centre: Floats, bound: Floats, measure: str) -> str:
    """Draw the error bar of the extrapolated solution as a band, and say how thick it is."""
    if not np.isfinite(bound).all():
        return ""
    thickest = float(np.max(bound))
    size = f"at most {words.number(thickest)} {measure}".strip()
    low, high = ax.get_ylim()
    if thickest < 0.005 * (high - low):
        return f" ({size}: thinner than the line)"
    (x, bottom), (x_top, top) = style.thin(t, centre - bound), style.thin(t, centre + bound)
    ax.fill([*x, *x_top[::-1]], [*bottom, *top[::-1]], color=PALE, alpha=0.35, linewidth=0)
    ax.set_ylim(low, high)
    return f" (the band, {size})"


def _draw_solution(
    ax: Axes, t: Floats, finest: Floats, best: Floats, exact: Floats, level: int
) -> None:
    pale: dict[str, Any] = {"color": PALE, "linewidth": 4.5, "alpha": 0.7}
    solid: dict[str, Any] = {"color": "#0072B2", "linewidth": 1.4, "gid": style.of_level(level)}
    dotted: dict[str, Any] = {"color": "black", "linewidth": 1.4, "linestyle": (0, (1, 3))}
    rows = [
        (best, "extrapolated (Richardson)", pale),
        (finest, f"level {level}", solid),
        (exact, "exact", dotted),
    ]
    rows = [row for row in rows if np.isfinite(row[0]).any()]
    for y, text, look in rows:
        ax.plot(*style.thin(t, y), label=text, **look)
    panels.stop_at_breakdown(ax, t, [finest])
    drawn = [y for y, _, _ in rows]
    # a run that blew up would hide the others
    ranged = [y for y in drawn if np.isfinite(y).all()] or drawn
    size = data.largest(exact) if np.isfinite(exact).all() else 0.0
    if 0.0 < size < max(map(data.largest, drawn)) / CUT:
        ax.set_ylim(-CUT * size, CUT * size)
        panels.note(ax, f"cut off at {CUT:g} times the exact solution", 0.11)
    else:
        panels.fit_values(ax, ranged)
    style.beside(ax)


def _draw_errors(
    ax: Axes, t: Floats, record: Record, quantity: str, member: Member, bound: Floats, true: Floats
) -> None:
    """Draw the estimates of the coarsest and the finest pair of levels, and the bound of the extrapolated solution."""
    pairs = data.whole(record, "pair")
    drawn: list[Floats] = []

    def add(line: Floats, dots: Floats, of: str, true_of: str, **look: Any) -> None:
        """Draw an estimate as a line and a true error as dots, few enough to leave the line visible."""
        drawn.append(style.no_zeros(line))
        ax.plot(*style.thin(t, drawn[-1]), label=of, **look)
        if np.isfinite(style.no_zeros(dots)).any():
            drawn.append(style.no_zeros(dots))
            every = slice(None, None, max(1, t.size // 60))
            mark: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 3.2}
            mark |= {"color": look["color"], "markerfacecolor": "white", "markeredgewidth": 0.9}
            mark["gid"] = look.get("gid")
            ax.plot(t[every], drawn[-1][every], label=true_of, **mark)

    estimates = [
        data.at(record, f"{quantity}_error_estimate", member, pair=i) for i in range(len(pairs))
    ]
    # a run that blew up has no error worth a scale of its own, unless all did
    whole = [i for i, estimate in enumerate(estimates) if np.isfinite(estimate).all()]
    chosen = whole or list(range(len(pairs)))
    for k, i in enumerate(dict.fromkeys([chosen[0], chosen[-1]]) if chosen else []):
        error = data.at(record, f"{quantity}_error", member, pair=i)
        text = f"level {pairs[i]}"
        look = {"color": style.COLOURS[k], "linestyle": style.DASHES[k]}
        look["gid"] = style.of_level(pairs[i])
        add(estimates[i], error, f"estimate, {text}", f"true, {text}", **look)
    if np.isfinite(bound).all():
        of, true_of = "bound, extrapolated", "true, extrapolated"
        add(bound, true, of, true_of, color=style.COLOURS[2])
    # dips at zero crossings may leave the range below
    if not style.fit_log_axis(ax, "y", *drawn, below=0.03, least=TINY):
        style.remark(ax, "no error to draw: it is zero, or not known")
    style.beside(ax)
