"""The motion on every level with its errors, and the solution with its error bar and estimated and true errors.

Source: pendulum lecture, section 2.5 (the estimate from two levels), and Richardson's extrapolation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.report import data, series, style, words
from vibsim.report.data import Ladder, Results
from vibsim.report.figures import moments, panels
from vibsim.report.style import Picture
from vibsim.report.types import Axes

MOST = 6  # most levels that can be told apart
Look = dict[str, Any]
BEYOND = 3.0  # levels beyond this multiple of the reference solution leave the frame
CUT = 3.0  # solutions beyond this multiple of the exact one are cut off, and the panel says so
TINY = 1e-18  # smallest relative size on a logarithmic panel; smaller ones are rounding
BAND = "#56B4E9"
DOTS: Look = {"linestyle": "none", "marker": ".", "markersize": 3.0}
"""Replaces a line if the samples are too few for one."""


def solution(ladder: Ladder) -> Picture:
    """Draw the solution and, below it on a logarithmic scale, its estimated and its true error."""
    t, letter, measure, exact = ladder.t, ladder.letter, ladder.unit(), ladder.exact
    best, bound = ladder.at("richardson"), ladder.at("richardson_error")
    is_known = bool(np.isfinite(exact).any())
    axes = panels.stacked([2.3, 2.5], style.TIME)
    _draw_solution(axes[0], ladder, best, exact)
    axes[0].set(ylabel=style.label(letter, measure), title=f"Solution {letter}(t)")
    thickness = _draw_band(axes[0], t, best, bound, measure)
    _draw_errors(axes[1], ladder, bound, exact - best)
    axes[1].set_ylabel(style.label(f"|error of {letter}|", measure))
    axes[1].set_title("Estimated beside true error" if is_known else "Estimated error")
    axes[1].set_xlabel(ladder.record.time_label)
    dots = " (lines), and the true error (dots). Dots on the lines mean that the estimate can be trusted"
    return Picture(
        name=f"solution_{ladder.stem}",
        title=f"Solution with its error: {letter}, {ladder.title}",
        caption=f"Top: the finest level, and the value extrapolated from the two finest ones with its error bar"
        f"{thickness}. Bottom: the error that the difference of two levels predicts{dots * is_known}.",
        alt=f"{ladder.name} against time for {ladder.title}, and its estimated error on a logarithmic scale",
        figure=axes[0].get_figure(root=True),
    )


def _draw_band(ax: Axes, t: Floats, centre: Floats, bound: Floats, measure: str) -> str:
    """Draw the error bar of the extrapolated solution as a band; return a remark on its width."""
    if not np.isfinite(bound).all():
        return ""
    thickest = float(np.max(bound))
    size = f"at most {words.number(thickest)} {measure}".strip()
    low, high = ax.get_ylim()
    if thickest < 0.005 * (high - low):
        return f" ({size}: thinner than the line)"
    (x, bottom), (x_top, top) = style.thin(t, centre - bound), style.thin(t, centre + bound)
    ax.fill([*x, *x_top[::-1]], [*bottom, *top[::-1]], color=BAND, alpha=0.35, linewidth=0)
    ax.set_ylim(low, high)
    return f" (the band, {size})"


def _draw_solution(ax: Axes, ladder: Ladder, best: Floats, exact: Floats) -> None:
    finest, level, name = ladder.finest, ladder.record.levels[-1], ladder.record.name_of_exact
    pale: dict[str, Any] = {"color": BAND, "linewidth": 4.5, "alpha": 0.7}
    solid: dict[str, Any] = {"color": "#0072B2", "linewidth": 1.4, "gid": style.of_level(level)}
    dotted: dict[str, Any] = {"color": "black", "linewidth": 1.4, "linestyle": (0, (1, 3))}
    rows = [
        (best, "extrapolated (Richardson)", pale),
        (finest, f"level {level}", solid),
        (exact, name, dotted),
    ]
    rows = [row for row in rows if np.isfinite(row[0]).any()]
    for y, text, look in rows:
        ax.plot(*style.thin(ladder.t, y), label=text, **look)
    panels.stop_at_breakdown(ax, ladder.t, [finest])
    drawn = [y for y, _, _ in rows]
    # a run that blew up would hide the others
    finite = [y for y in drawn if np.isfinite(y).all()] or drawn
    size = data.largest(exact) if np.isfinite(exact).all() else 0.0
    if 0.0 < size < max(map(data.largest, drawn)) / CUT:
        ax.set_ylim(-CUT * size, CUT * size)
        panels.note(ax, f"cut off at {CUT:g} times the {name} solution", 0.11)
    else:
        panels.fit_values(ax, finite)
    style.beside(ax)


def _draw_errors(ax: Axes, ladder: Ladder, bound: Floats, true: Floats) -> None:
    """Draw the estimates from the coarsest and finest pairs of levels, and the bound of the extrapolated solution."""
    t, pairs = ladder.t, ladder.record.pairs
    drawn: list[Floats] = []

    def add(line: Floats, dots: Floats, label: str, true_label: str, **look: Any) -> None:
        """Draw an estimate as a line and a true error as dots, few enough to leave the line visible."""
        line, dots = style.no_zeros(line), style.no_zeros(dots)
        drawn.append(line)
        ax.plot(*style.thin(t, line), label=label, **look)
        if np.isfinite(dots).any():
            drawn.append(dots)
            subset = slice(None, None, max(1, t.size // 60))
            mark: Look = {"linestyle": "none", "marker": "o", "markersize": 3.2}
            mark |= {"markerfacecolor": "white", "markeredgewidth": 0.9}
            ax.plot(t[subset], dots[subset], label=true_label, **look | mark)

    estimates = [ladder.at("error_estimate", pair=i) for i in range(len(pairs))]
    # errors of runs that blew up are drawn only if all did
    finite = [i for i, estimate in enumerate(estimates) if np.isfinite(estimate).all()]
    chosen = finite or list(range(len(pairs)))
    for k, i in enumerate(dict.fromkeys([chosen[0], chosen[-1]]) if chosen else []):
        error, text = ladder.at("error", pair=i), f"level {pairs[i]}"
        look = {"color": style.COLOURS[k], "linestyle": style.DASHES[k]}
        look["gid"] = style.of_level(pairs[i])
        add(estimates[i], error, f"estimate, {text}", f"true, {text}", **look)
    if np.isfinite(bound).all():
        add(bound, true, "bound, extrapolated", "true, extrapolated", color=style.COLOURS[2])
    # dips at zero crossings may lie below the axis
    if not style.fit_log_axis(ax, "y", *drawn, below=0.03, least=TINY):
        style.remark(ax, "no error to draw: it is zero, or not known")
    style.beside(ax)


def motion(ladder: Ladder) -> Picture:
    """Draw a quantity on all levels, and their distance from the exact, else the extrapolated, else the finest one.

    Nothing can be extrapolated where the verdict on the levels is open.
    """
    t, letter, measure, levels = ladder.t, ladder.letter, ladder.unit(), ladder.record.levels
    text, best = ladder.record.name_of_exact, ladder.exact
    is_known = bool(np.isfinite(best).any())
    if not is_known:
        is_open = "richardson" not in ladder or ladder.is_undecided
        text, field = ("finest", "finest") if is_open else ("extrapolated", "richardson")
        best = ladder.at(field)
    chosen = style.spaced(len(levels), MOST)
    runs = {i: ladder.on_level(i) for i in chosen}
    has_errors = bool(np.isfinite(best).any()) and len(levels) > (0 if is_known else 1)
    axes = panels.stacked([2.3, *[1.7] * has_errors], style.TIME)
    smooth = series.exact_curve(ladder) if is_known else (t, best)
    turns, steps = smooth if is_known else (t, ladder.finest), ladder.record.steps
    dotted = [i for i in chosen if moments.is_undersampled(steps[i], t, turns)]
    is_dotted = bool(dotted)
    if has_errors:
        pale: Look = {"color": style.PALE, "linewidth": 5.0, "label": text, "zorder": 1}
        is_line = not is_dotted or smooth[0].size > t.size
        dots: Look = {} if is_line else DOTS | {"markersize": 6.0}
        axes[0].plot(*style.thin(*smooth), **pale | dots)
    looks = {
        i: _look(k, ladder.record, i) | (DOTS if i in dotted else {}) for k, i in enumerate(chosen)
    }
    _draw_levels(axes[0], t, runs, looks, best)
    title = f"{letter}(t){' at the stored times only' if is_dotted else ''}"
    axes[0].set(ylabel=style.label(letter, measure), title=title)
    if has_errors:
        errors = {i: values - best for i, values in runs.items()}
        exponent = _draw_level_errors(axes[1], t, errors, looks)
        axes[1].set_title(f"Each level minus the {text} solution", fontweight="normal", fontsize=9)
        what = "difference" if text == "finest" else "error"
        axes[1].set_ylabel(style.label(f"{what} of {letter}", measure, exponent))
    axes[-1].set_xlabel(ladder.record.time_label)
    told = " Not every level is drawn." * (len(chosen) < len(levels))
    told += " Dots: the stored samples, which are too few for lines between them." * is_dotted
    guide = f"Wide and grey is the {text} solution, the lines are the levels; below it, how far each level is from it."
    return Picture(
        f"motion_{ladder.stem}",
        f"{words.title(ladder.quantity)}(t), {ladder.title}",
        (guide if has_errors else "Each line is a level.") + told,
        f"{ladder.name} against time on all levels for {ladder.title}"
        + ", and the error of each level" * has_errors,
        axes[0].get_figure(root=True),
    )


def _look(k: int, record: Results, i: int) -> Look:
    """Return the look of the k-th line, of the level at position `i`."""
    steps = words.number(record.steps[i], "integer")
    look = {"color": style.COLOURS[k % style.MANY], "linewidth": 1.3, "label": f"{steps} steps"}
    return look | {"gid": style.of_level(record.levels[i])}


def _draw_levels(
    ax: Axes, t: Floats, runs: dict[int, Floats], looks: dict[int, Look], best: Floats
) -> None:
    for k, (i, values) in enumerate(runs.items()):
        dashes = "-" if i == max(runs) else style.DASHES[1 + k % (style.MANY - 1)]
        look: Look = {"linestyle": dashes} | looks[i]
        ax.plot(*style.thin(t, values), **look)
    panels.stop_at_breakdown(ax, t, list(runs.values()))
    finite = [values for values in runs.values() if np.isfinite(values).all()]
    finite = finite or list(runs.values())
    size = data.largest(best)
    near = [values for values in finite if data.largest(values) <= BEYOND * size]
    if near and len(near) < len(finite):
        ax.set_ylim(*style.limits(best, *near, np.array([-size, size])))
        panels.note(ax, "coarse levels leave the frame", 0.03)
    else:
        panels.fit_values(ax, finite, best)
    style.beside(ax)


def _draw_level_errors(
    ax: Axes, t: Floats, errors: dict[int, Floats], looks: dict[int, Look]
) -> int:
    """Draw errors, on a logarithmic scale if they grow without bound; return the exponent of ten of the axis."""
    shown = [e for e in errors.values() if np.isfinite(e).all()] or list(errors.values())
    scale = panels.Scale.of(shown)
    for i, values in errors.items():
        ax.plot(*style.thin(t, scale.scaled(values)), **looks[i])
    scale.apply(ax, most=5)
    return scale.exponent
