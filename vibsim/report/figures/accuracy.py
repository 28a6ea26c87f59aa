"""Accuracy against w dt: the frequency of schemes with its series, and the second difference of a wave.

Source: vibration text, sections 4.1 and 4.2 (figure 3) and exercise 7; theory from the matrix of a scheme's own step.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.report import style, words
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.figures import panels
from vibsim.report.style import Picture
from vibsim.report.types import Axes

POINTS = 240  # of a curve
SMALL = 0.02  # w dt at which the leading term of a series is determined
EXACT = 1e-3  # largest relative difference between a coefficient and the fraction written for it
MOST_DENOMINATOR = 400


def frequency(record: Results) -> Picture | None:
    """Draw numerical over exact frequency of every scheme against w dt, with the first term of its series."""
    from vibsim import theory

    w_dt = record.omega_dt
    usable = w_dt[np.isfinite(w_dt) & (w_dt > 0.0)]
    if not usable.size or "measured_phase_error" not in record:
        return None
    limits = record.optional("stability_limit", ("scheme", "case"))
    grid = np.linspace(1e-3, float(usable.max()), POINTS)
    measured = 1.0 / (1.0 - record.phase_error("measured"))
    (ax,) = panels.stacked([3.0])
    ax.axhline(1.0, **style.REFERENCE)
    drawn = [np.ones(1)]
    for s, spec in enumerate(record.experiment.schemes):
        if spec.method.adaptive:
            continue
        look = style.look(s)
        stepper = spec.method.stepper(spec.options)
        with np.errstate(all="ignore"):
            # the phase error is the part by which a period is too short
            curve = 1.0 / (1.0 - theory.phase_error_per_period(stepper, grid))
            small = theory.phase_error_per_period(stepper, np.array([0.5 * SMALL, SMALL]))
        start = small / (1.0 - small)
        limit = float(np.nanmax(limits[s])) if np.isfinite(limits[s]).any() else math.inf
        curve = np.where(grid <= limit, curve, np.nan)
        ax.plot(grid, curve, color=look["color"], label=style.entry(spec.name))
        if (term := _leading_term(start)) is not None:
            order, text, factor = term
            drawn.append(1.0 + factor * grid**order)
            ax.plot(grid, drawn[-1], color=look["color"], linestyle=(0, (4, 2)), label=text)
        mark = {"color": look["color"], "marker": look["marker"], "linestyle": "none"}
        ax.plot(w_dt.ravel(), measured[s].ravel(), **mark, markersize=4, label="_measured")
        drawn += [curve, measured[s].ravel()]
    _finish(ax, grid, drawn, "w dt", "numerical over exact frequency")
    return Picture(
        "frequency",
        "The numerical frequency against w dt, with its series",
        "Lines: the frequency that the matrix of one step predicts, up to the limit of stability. Dashed: one plus the "
        "first term of its series. Markers: what was measured. Above one the numerical solution oscillates too fast.",
        "Numerical over exact frequency of every scheme against w dt, predicted, as a series and measured",
        ax.get_figure(root=True),
    )


def _finish(ax: Axes, grid: Floats, drawn: list[Floats], x: str, y: str) -> None:
    """Set ranges, labels and legend of axes over a grid of w dt."""
    ax.set(xlim=(0.0, 1.03 * float(grid[-1])), ylim=style.limits(*drawn), xlabel=x, ylabel=y)
    style.beside(ax)


def _leading_term(start: Floats) -> tuple[int, str, float] | None:
    """Return the leading term c p^k of a series, from its values at p = `SMALL`/2 and `SMALL`: k, its text, and c."""
    half, full = (float(value) for value in start)
    if not (math.isfinite(half) and math.isfinite(full)) or half == 0.0 or full / half <= 1.0:
        return None
    order = round(math.log2(full / half))
    # eliminates the next term, which is smaller by a factor (w dt)^2
    factor = (4.0 * half / (0.5 * SMALL) ** order - full / SMALL**order) / 3.0
    near = Fraction(factor).limit_denominator(MOST_DENOMINATOR)
    numerator, denominator = f"{words.number(abs(factor), 'brief')} ", ""
    if near != 0 and abs(float(near) - factor) <= EXACT * abs(factor):
        numerator = "" if abs(near.numerator) == 1 else f"{abs(near.numerator)} "
        denominator = f"/{near.denominator}" if near.denominator > 1 else ""
    sign = "+" if factor > 0 else "−"
    return order, f"1 {sign} {numerator}(w dt){words.superscript(order)}{denominator}", factor


def second_difference(record: Results) -> Picture | None:
    """Draw the second difference of a cosine over its second derivative against w dt."""
    fractions, p = _measured_fractions(record)
    if not p.size:
        return None
    grid = np.linspace(0.0, max(math.pi, float(p.max())), POINTS)
    (ax,) = panels.stacked([3.0])
    ax.axhline(1.0, **style.REFERENCE)
    curve, series = np.sinc(grid / (2.0 * np.pi)) ** 2, 1.0 - grid**2 / 12.0 + grid**4 / 360.0
    ax.plot(grid, curve, color=style.COLOURS[0], label="(2/p)² sin²(p/2)")
    dashed: dict[str, Any] = {"color": style.COLOURS[1], "linestyle": (0, (4, 2))}
    ax.plot(grid, series, **dashed, label="1 − p²/12 + p⁴/360")
    ax.plot(p, fractions, "o", color=style.COLOURS[0], markersize=4.5, label="measured")
    _finish(ax, grid, [curve, series, fractions, np.array([0.0, 1.0])], "p = w dt", "E")
    return Picture(
        "second_difference",
        "Accuracy of the second difference: E against p = w dt",
        "E is the second difference of a cosine over its second derivative. Line: its formula; dashed: its Taylor "
        "polynomial of the fourth degree; markers: measured of the exact solution on the coarsest mesh. No wave with p "
        "above π lives on a mesh.",
        "The second difference of a cosine over its second derivative against w dt",
        ax.get_figure(root=True),
    )


def _measured_fractions(record: Results) -> tuple[Floats, Floats]:
    """Return E of the exact solution of every member on the coarsest mesh, and w dt there."""
    pairs = []
    for case in range(record.count):
        member = Member(0, case, "")
        u, w = Ladder(record, "u", member).exact, record.natural_frequency(case)
        t = record.times(case)
        if not np.isfinite(u).all() or t.size < 3 or not w > 0.0:
            continue
        dt = float(t[1] - t[0])
        inner = u[1:-1]
        fraction = -float(np.dot(np.diff(u, 2) / dt**2, inner) / (w * w * np.dot(inner, inner)))
        pairs.append((fraction, w * dt))
    fractions, p = np.reshape(np.array(pairs), (-1, 2)).T
    return fractions, p
