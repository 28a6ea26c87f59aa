"""Runs that grow: the size of the solution against time, beside the growth that theory predicts.

Source: vibration text, section 4.5 (figure 4): beyond the limit of stability the amplitude grows by a constant factor
in each step.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.core.record import Record
from vibsim.report import data, style
from vibsim.report.choice import position
from vibsim.report.data import Floats, Member
from vibsim.report.figures.panels import figure_of, panels
from vibsim.report.figures.phase import of_level
from vibsim.report.style import Picture
from vibsim.report.tables.theory import MEMBER, OF_LEVEL, everyone, omega_dt
from vibsim.report.text import words

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

MOST = 6
"""Most runs that are drawn: the slowest and the fastest among them."""
NOTABLE = 1e-3
"""A run is drawn where it grows over the whole time by more than this part."""
WHOLE = 4.0
"""On a linear scale the solution is drawn up to so many times the exact one."""
HIGHEST = 1e250
"""Sizes beyond are not drawn."""
SEEN = 0.2
"""Only runs that stay within the frame for so much of the time are drawn beside the exact solution."""
BEYOND = 100.0
"""What is beyond so many times the exact solution is not drawn on that scale, so that curves leave the frame."""


def growing(experiment: Experiment, record: Record) -> Picture | None:
    """Draw the solutions that theory predicts to grow without bound; None where there is none.

    These are runs with w dt beyond the limit of stability of their scheme, or at it.
    """
    runs = _runs(record)
    if not runs:
        return None
    quantity = position(experiment)
    letter, measure = words.symbol(quantity), data.unit(record, f"{quantity}_finest")
    axes = panels([2.2, 2.6])
    sizes, reference = [], 0.0
    for k, (member, level) in enumerate(runs):
        t = data.times(record, member.case)
        values = of_level(record, quantity, member, level)
        look = style.look(k)
        exact = data.exact_series(record, quantity, member)
        reference = max(reference, data.largest(exact))
        within = (
            np.abs(values) <= BEYOND * data.largest(exact)
            if data.largest(exact) > 0.0
            else np.isfinite(values)
        )
        if k == 0 or _stays(values, data.largest(exact)):
            x, y = style.thin(t, np.where(within, values, np.nan))
            axes[0].plot(x, y, color=look["color"], linewidth=1.2)
        size = style.no_zeros(values)
        # the margin of an axis would overflow beyond
        size = np.where(size < HIGHEST, size, np.nan)
        text = _label(record, member, level)
        axes[1].plot(*style.thin(t, size), color=look["color"], linewidth=0.9, label=text)
        sizes.append(size[np.isfinite(size)])
        _envelope(axes[1], record, member, level, data.largest(exact), look["color"])
        if k == 0 and np.isfinite(exact).any():
            axes[0].plot(*style.thin(t, exact), color="black", linestyle=(0, (1, 2)), zorder=5)
    if reference > 0.0:
        axes[0].set_ylim(-WHOLE * reference, WHOLE * reference)
    found = np.concatenate([part for part in sizes if part.size] or [np.array([1.0])])
    high = float(found.max())
    style.log_axis(axes[1], "y", 0.2 * (reference or float(np.median(found))), 3.0 * high)
    axes[0].set_ylabel(style.label(letter, measure))
    axes[1].set_ylabel(style.label(f"|{letter}|", measure))
    axes[0].set_title(
        f"The slowest beside the exact solution (dotted), up to {WHOLE:g} times its size"
    )
    axes[1].set_title("Size of the solution, and the predicted growth (dashed)")
    axes[1].set_xlabel(style.label("t", data.time_unit(record)))
    # one legend for both panels
    handles, texts = axes[1].get_legend_handles_labels()
    axes[0].legend(handles, texts, **style.BESIDE, fontsize=8, handlelength=1.4)
    return Picture(
        name="growing",
        title="Unstable runs: growth predicted and measured",
        caption="Runs whose w dt is at or beyond the limit of stability of their scheme; the legend has the factor by "
        "which the amplitude grows in each natural period, measured and by theory. On the logarithmic scale a "
        "constant factor in every step is a straight line; it should become parallel to the dashed one, the factor "
        "that the matrix of one step predicts. How far above or below depends on the start.",
        alt=f"{words.name(quantity)} of unstable runs against time, linear and logarithmic, with the predicted growth",
        figure=figure_of(axes[0]),
    )


def _runs(record: Record) -> list[tuple[Member, int]]:
    """Choose the unstable runs, from the slowest growth to the fastest."""
    growth, limit = (
        data.known(record, "theory_growth", OF_LEVEL),
        data.known(record, "stability_limit", MEMBER),
    )
    product = omega_dt(record)
    found: list[tuple[float, Member, int]] = []
    for member in everyone(record):
        for i in range(len(data.whole(record, "level"))):
            factor = float(growth[member.scheme, member.case, i])
            most = float(limit[member.scheme, member.case])
            beyond = 0.0 < most <= product[member.case, i] * (1.0 + 1e-9)
            if beyond and not math.isnan(factor) and factor > 1.0 + NOTABLE:
                found.append((factor, member, i))
    found.sort(key=lambda run: run[0])
    places = style.spaced(len(found), MOST)
    return [found[i][1:] for i in places]


def _label(record: Record, member: Member, level: int) -> str:
    told, seen = (
        data.at(record, f"{who}_growth", member, level=level).item()
        for who in ("theory", "measured")
    )
    product = float(omega_dt(record)[member.case, level])
    numbers = f"\n× {words.number(seen)}, theory {words.number(told)}"
    return style.entry(f"{member.scheme_name}, w dt = {words.number(product, 'step')}{numbers}")


def _stays(values: Floats, size: float) -> bool:
    """Say whether a solution stays within the upper panel for a notable part of the time."""
    return bool(np.mean(np.abs(values) <= WHOLE * size) >= SEEN)


def _envelope(
    ax: Any, record: Record, member: Member, level: int, size: float, colour: Any
) -> None:
    """Draw the predicted growth of an amplitude that begins with that of the exact solution."""
    t = data.times(record, member.case)
    growth = data.at(record, "theory_growth", member, level=level).item()
    w = float(np.ravel(data.known(record, "natural_frequency", ("case",), case=member.case))[0])
    if not (math.isfinite(growth) and math.isfinite(w) and size > 0.0):
        return
    exponent = (t - t[0]) * w / (2.0 * np.pi) * math.log10(growth) + math.log10(size)
    keep = exponent < math.log10(HIGHEST)
    ax.plot(t[keep], 10.0 ** exponent[keep], color=colour, linestyle=(0, (4, 2)), linewidth=1.0)
