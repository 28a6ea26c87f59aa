"""The picture of a drift: the largest energy error so far, its means over three windows, and the drift asked for.

The rules are those of `vibsim.observe.energy_drift`: with the means m3, m2, m1 over [T/8, T/4], [T/4, T/2] and [T/2, T]
a drift ``a + b t^k`` has ``(m1 - m2)/(m2 - m3) = 2^k``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibsim.core.record import Record
from vibsim.report import style
from vibsim.report.data import Floats, Member, at, time_unit, unit
from vibsim.report.evidence import frame
from vibsim.report.evidence.energy_caption import dashed, told
from vibsim.report.evidence.energy_error import NAMES, POWERS, EnergyError, energy_error
from vibsim.report.evidence.frame import Picture, measured

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from vibsim.experiment.schema.checks import ConservesCheck

WINDOWS = ((0.125, 0.25), (0.25, 0.5), (0.5, 1.0))
"""In parts of the end, those of m3, m2 and m1."""
LEAST = 1e-4
"""Part of the time before which a logarithmic scale need not show the error."""


def picture(record: Record, check: ConservesCheck, name: str, member: Member) -> Picture | None:
    """Draw how the largest energy error so far grows, beside the drift that a check asks for."""
    series = f"{check.about}_running_max"
    if series not in record:
        return Picture(f"{member.title}: the largest energy error so far is not stored.")
    level = int(measured(record, name, "level", member.scheme, member.case))
    first = abs(float(at(record, "energy_initial", member)))
    found = energy_error(record, check, name, member, first or 1.0, level)
    if not frame.usable(found.running).size:
        nothing = f"{member.title}: the energy error is 0 at every step; there is nothing to draw."
        return Picture(nothing) if np.any(found.running == 0.0) else None
    label = "largest energy error so far" + (" / E(0)" if first else "")
    by = " by [D₂ₜu]" if check.conserves.endswith("_d2t") else ""
    title = style.label(label + by, "" if first else unit(record, "energy_deviation_max_abs"))
    figure = style.canvas(1.0)
    _draw(frame.panel(figure, title, style.label("t", time_unit(record)), frame.WIDE), found)
    caption = f"{member.title}, level {level}: {told(found)} {dashed(found)}".strip()
    return Picture(caption, title, figure)


def _draw(ax: Axes, found: EnergyError) -> None:
    """Draw windows, error, means and the drift asked for."""
    t, end = found.t, float(found.t[-1])
    ax.set_xlim(float(t[0]), end)
    border = np.array([found.round_off if found.has_border else np.nan])
    if found.is_log:
        late = found.running[t > LEAST * end]
        lowest = 0.1 * np.max(frame.usable(found.running))
        frame.scale(ax, late, found.means, border, np.array([lowest]), is_log=True)
    else:
        frame.scale(ax, found.running, found.means, np.zeros(1), margin=0.22)
        ax.set_ylim(bottom=0.0)
    if found.has_bars:
        for first, last in WINDOWS[::2]:
            ax.axvspan(first * end, last * end, color=frame.BAND, alpha=0.6, linewidth=0, zorder=0)
    if found.has_border and found.round_off > 0.0:
        # the most that is taken for round-off; below is where the error is
        if found.is_round_off:
            frame.allowed(ax, 0.0, found.round_off)
        ax.axhline(found.round_off, **frame.DASHED)
    ax.plot(*style.thin(t, found.running, 160), color=frame.COLOUR, linewidth=1.2)
    later = np.linspace(WINDOWS[0][0] * end, end, 60)
    ax.plot(later, _expected(found, later), **frame.DASHED)
    if found.has_bars:
        for (first, last), mean, text in zip(WINDOWS, found.means, NAMES, strict=True):
            ax.plot([first * end, last * end], [mean, mean], color=frame.SECOND, linewidth=1.8)
            ax.annotate(
                text, (first * end, mean), (2, 3), textcoords="offset points", fontsize=frame.SIZE
            )


def _expected(found: EnergyError, t: Floats) -> Floats:
    """Return the drift that is asked for, through m2, and m1 where it grows; NaN where it is no line."""
    _, second, first = found.means
    if found.has_border:
        return np.full(t.shape, np.nan)
    if found.asked == "bounded":
        return np.full(t.shape, second)
    power = POWERS[found.asked]
    earlier, later = (_mean_power(window, power) for window in WINDOWS[1:])
    part = (t / found.t[-1]) ** power
    return np.asarray(second + (first - second) * (part - earlier) / (later - earlier))


def _mean_power(window: tuple[float, float], power: int) -> float:
    """Return the mean of t^power over a window."""
    a, b = window
    return (b ** (power + 1) - a ** (power + 1)) / ((power + 1) * (b - a))
