"""The spectrum of the motion with the frequencies of theory, and its Poincare section.

Source: `vibsim.observe.spectrum` for the lines; H. Poincare, Les methodes nouvelles de la mecanique celeste (1892), and
P. Holmes, A nonlinear oscillator with a strange attractor, Phil. Trans. R. Soc. A 292 (1979) 419-448, for the section.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibsim.report import data, style
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.figures import panels
from vibsim.report.style import Picture

LOWEST = 1e-8  # lower end of the axis over the highest line
MOST_LEVELS = 3  # finest levels in the spectrum
MOST_PANELS = 6  # most sections
PANELS_A_ROW = 3


def spectrum(record: Results, member: Member) -> Picture | None:
    """Draw the amplitudes of the spectral lines at the finest levels, with the exact and the predicted frequencies.

    None if there are too few samples for a line.
    """
    # few pages have a spectrum
    from vibsim.observe import spectrum as observed

    levels, model = record.levels, record.model
    ladder = Ladder(record, model.position, member)
    t = ladder.t
    if t.size < 2 * observed.FIRST_LINE + 4:
        return None
    w = 2.0 * math.pi / float(t[-1] - t[0]) * np.arange(t.size // 2 + t.size % 2)
    (ax,) = panels.stacked([3.0])
    highest, last = 0.0, 0.0
    chosen = range(max(len(levels) - MOST_LEVELS, 0), len(levels))
    for k, level in enumerate(chosen):
        amplitudes = observed.lines(ladder.on_level(level))
        frequencies, values = w[: amplitudes.size], amplitudes[: w.size]
        colour, text = style.look(k)["color"], f"level {levels[level]}"
        ax.plot(frequencies, values, color=colour, linewidth=1.0, label=text)
        top = data.largest(amplitudes)
        highest = max(highest, top)
        last = max(last, float(frequencies[values > 1e-3 * top].max(initial=0.0)))
        predicted = _predicted(record, member, level)
        if math.isfinite(predicted):
            look: Any = {"color": colour, "linestyle": ":", "linewidth": 1.2}
            ax.axvline(predicted, **look, label=f"theory, {text}")
    if not highest > 0.0:
        return None
    exact = record.natural_frequency(member.case)
    if model.linear and math.isfinite(exact):
        ax.axvline(exact, label="natural", **style.REFERENCE)
    style.log_axis(ax, "y", LOWEST * highest, 3.0 * highest)
    ax.set_xlim(0.0, min(float(w[-1]), 4.0 * np.fmax(last, exact)))
    ax.set_xlabel(style.label("angular frequency", record.radians_unit))
    ax.set_ylabel(style.label(f"amplitude of {ladder.letter}", ladder.unit()))
    style.beside(ax)
    return Picture(
        f"spectrum_{member.case}",
        f"Spectrum of {ladder.letter}, {member.scheme_name}",
        style.sentences(
            "The amplitudes of the frequencies in the stored series less its mean, with Hann's window.",
            "Dotted: the frequency that the scheme itself has by theory. Its distance from the natural one, dashed, is "
            "the frequency error of the scheme." * (model.linear and model.conservative),
        ),
        "Amplitude against angular frequency at the finest levels, with the frequencies known from theory",
        ax.get_figure(root=True),
    )


def _predicted(record: Results, member: Member, level: int) -> float:
    """Return the angular frequency of a scheme's discrete solution by theory; NaN if theory gives none."""
    from vibsim import theory

    model, spec = record.model, record.experiment.schemes[member.scheme]
    if spec.method.adaptive or not (model.linear and model.conservative):
        return math.nan
    p = record.omega_dt[member.case, level : level + 1]
    with np.errstate(all="ignore"):
        error = theory.phase_error_per_period(spec.method.stepper(spec.options), p)
    return record.natural_frequency(member.case) / float(1.0 - error[0])


def poincare(record: Results, shown: list[Member]) -> Picture | None:
    """Draw position and velocity of each member after every period of the force, in the second half of the run.

    The end is left out, where a scheme may find the velocity by another formula, with a larger error.
    """
    model, periods = record.model, record.experiment.time.periods
    first = [member for member in shown if member.scheme == shown[0].scheme][:MOST_PANELS]
    if periods is None or not first:
        return None
    columns = [(0.72 + 2.7 * i, 2.1) for i in range(PANELS_A_ROW)]
    figure, axes = panels.rows_of(len(first), columns, 2.1, 0.45, 0.5)
    states = [Ladder(record, name, first[0]) for name in (model.position, model.velocity)]
    n, rest = divmod(len(record["t"]) - 1, round(periods))
    if rest or not n:
        return None  # samples that are thinned do not show every period
    drawn = []
    for ax, member in zip(axes, first, strict=True):
        u, v = (state.with_member(member).finest for state in states)
        u, v = (values[:-1:n][round(periods) // 2 :] for values in (u, v))
        ax.plot(u, v, linestyle="none", marker=".", markersize=3.0, color=style.look(0)["color"])
        ax.set_title(member.case_words or member.scheme_name)
        ax.set_xlabel(style.label(states[0].letter, states[0].unit()))
        drawn.append((u, v))
    for ax in axes:
        ax.set(xlim=style.limits(*(u for u, _ in drawn)), ylim=style.limits(*(v for _, v in drawn)))
    axes[0].set_ylabel(style.label(states[1].letter, states[1].unit()))
    return Picture(
        "poincare",
        "Poincaré section: the state after every period of the force",
        f"The second half of the run, at level {record.levels[-1]}. A motion with the period of the force is "
        "one point, one that returns after k of its periods k points, and a chaotic one a set that never closes.",
        "Velocity against position at the beginning of every period of the force",
        figure,
    )
