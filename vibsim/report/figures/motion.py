"""The motion: a quantity over time on every level beside the exact solution, and below it the error of every level."""

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

MOST = 6  # most levels that can be told apart
PALE = "#b0b0b0"  # colour of what the levels are compared with
Look = dict[str, Any]
BEYOND = 3.0
"""A level that grows beyond so many times the solution it is compared with leaves the frame."""


def motion(record: Record, quantity: str, member: Member) -> Picture:
    """Draw a quantity on all levels, and how far each is from the exact solution, or from the extrapolated one."""
    t, letter = data.times(record, member.case), words.symbol(quantity)
    measure, levels = data.unit(record, f"{quantity}_finest"), data.whole(record, "level")
    exact = data.exact_series(record, quantity, member)
    is_known = bool(np.isfinite(exact).any())
    name = f"{quantity}_richardson"
    best = exact if is_known or name not in record else data.at(record, name, member)
    chosen = style.spaced(len(levels), MOST)
    series = {i: data.of_level(record, quantity, member, i) for i in chosen}
    has_errors = bool(np.isfinite(best).any()) and len(levels) > (0 if is_known else 1)
    axes = panels.stacked([2.3, *[1.7] * has_errors], style.TIME)
    if has_errors:
        text = "exact" if is_known else "extrapolated"
        axes[0].plot(*style.thin(t, best), color=PALE, linewidth=5.0, label=text, zorder=1)
    looks = {i: _look(k, record, i) for k, i in enumerate(chosen)}
    _draw(axes[0], t, series, looks, best)
    axes[0].set(ylabel=style.label(letter, measure), title=f"{letter}(t)")
    if has_errors:
        errors = {i: values - best for i, values in series.items()}
        exponent = _draw_errors(axes[1], t, errors, looks)
        of = "exact" if is_known else "extrapolated"
        axes[1].set_title(f"Each level minus the {of} solution", fontweight="normal", fontsize=9)
        axes[1].set_ylabel(style.label(f"error of {letter}", measure, exponent))
    axes[-1].set_xlabel(data.time_label(record))
    told = (
        f"Wide and grey is the {'exact' if is_known else 'extrapolated'} solution, the lines are the levels; "
        "below it, how far each level is from it."
    )
    return Picture(
        f"motion_{quantity}_{member.stem}",
        f"{words.title(quantity)}(t), {member.title}",
        told if has_errors else "Each line is a level.",
        f"{words.name(quantity)} against time on all levels for {member.title}"
        + (", and the error of each level" if has_errors else ""),
        axes[0].get_figure(root=True),
    )


def _look(k: int, record: Record, i: int) -> Look:
    """Return the look of the k-th line, of the level at position `i`."""
    steps = words.number(int(record["steps"][i]), "integer")
    look = {"color": style.COLOURS[k % style.MANY], "linewidth": 1.3, "label": f"{steps} steps"}
    return look | {"gid": style.of_level(data.whole(record, "level")[i])}


def _draw(
    ax: Axes, t: Floats, series: dict[int, Floats], looks: dict[int, Look], best: Floats
) -> None:
    for k, (i, values) in enumerate(series.items()):
        dashes = "-" if i == max(series) else style.DASHES[1 + k % (style.MANY - 1)]
        ax.plot(*style.thin(t, values), linestyle=dashes, **looks[i])
    panels.stop_at_breakdown(ax, t, list(series.values()))
    whole = [values for values in series.values() if np.isfinite(values).all()]
    whole = whole or list(series.values())
    size = data.largest(best)
    near = [values for values in whole if data.largest(values) <= BEYOND * size]
    if near and len(near) < len(whole):
        ax.set_ylim(*style.limits(best, *near, np.array([-size, size])))
        panels.note(ax, "coarse levels leave the frame", 0.03)
    else:
        panels.fit_values(ax, whole, best)
    style.beside(ax)


def _draw_errors(ax: Axes, t: Floats, errors: dict[int, Floats], looks: dict[int, Look]) -> int:
    """Draw errors, on a logarithmic scale where they grow without bound; return the exponent of the axis."""
    shown = [e for e in errors.values() if np.isfinite(e).all()] or list(errors.values())
    wild = panels.explosive(shown)
    exponent = 0 if wild else style.scale(*shown)
    for i, values in errors.items():
        y = style.no_zeros(values) if wild else values / 10.0**exponent
        ax.plot(*style.thin(t, y), **looks[i])
    if wild:
        style.log_axis(ax, "y", *panels.decades(shown), most=5)
    else:
        ax.set_ylim(*style.limits(*(e / 10.0**exponent for e in shown)))
    return exponent
