"""The picture of a drift: the largest energy error so far, its means over three windows, and the drift asked for.

The rules are those of `vibsim.observe.energy_drift`: with the means m3, m2, m1 over [T/8, T/4], [T/4, T/2] and [T/2, T]
a drift ``a + b t^k`` has ``(m1 - m2)/(m2 - m3) = 2^k``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from vibsim.core.record import Record
from vibsim.report import style
from vibsim.report.data import Floats, Member, at, time_unit, unit
from vibsim.report.evidence.energy_caption import dashed, told
from vibsim.report.evidence.energy_error import NAMES, POWERS, EnergyError, energy_error
from vibsim.report.evidence.frame import (
    COLOUR,
    SECOND,
    Picture,
    log_ticks,
    logarithms,
    measured,
    over_time,
    ticks,
)
from vibsim.report.evidence.svg_plot import BAND, INK, Panel, document

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import ConservesCheck

WINDOWS = ((0.125, 0.25), (0.25, 0.5), (0.5, 1.0))
"""In parts of the end, those of m3, m2 and m1."""
LEAST = 1e-4
"""Part of the time before which a logarithmic scale need not show the error."""
WIDTH = 320.0


def picture(
    experiment: Experiment, record: Record, check: ConservesCheck, name: str, member: Member
) -> Picture | None:
    """Draw how the largest energy error so far grows, beside the drift that a check asks for."""
    series = f"{check.about}_running_max"
    if series not in record:
        return Picture("", f"{member.title}: the largest energy error so far is not stored.")
    level = int(measured(record, name, "level", member.scheme, member.case))
    first = abs(float(at(record, "energy_initial", member)))
    found = energy_error(experiment, record, check, name, member, first or 1.0, level)
    if not (np.isfinite(found.running) & (found.running > 0.0)).any():
        return _nothing(found, member)
    label = "largest energy error so far" + (" / E(0)" if first else "")
    by = " by [D₂ₜu]" if check.conserves.endswith("_d2t") else ""
    title = style.label(label + by, "" if first else unit(record, "energy_deviation_max_abs"))
    panel = _panel(found)
    scale = log_ticks(*panel.y) if found.is_log else ticks(*panel.y)
    seconds = style.label("t", time_unit(record))
    panel.frame(title, seconds, ticks(*panel.x, 5), scale)
    caption = f"{member.title}, level {level}: {told(found)} {dashed(found)}".strip()
    return Picture(document([panel], title), caption)


def _nothing(found: EnergyError, member: Member) -> Picture | None:
    """Say that there is no error to draw, where that was found."""
    if not np.any(found.running == 0.0):
        return None
    return Picture(
        "", f"{member.title}: the energy error is 0 at every step; there is nothing to draw."
    )


def _panel(found: EnergyError) -> Panel:
    """Return the panel with windows, error, means and the drift asked for."""
    t, end = found.t, float(found.t[-1])
    curve, means = _scaled(found, found.running), _scaled(found, found.means)
    panel = over_time(t, *_limits(found, curve, means))
    panel.width = WIDTH
    if found.has_bars:
        for first, last in WINDOWS[::2]:
            panel.band(*panel.y, first * end, last * end, BAND, 0.6)
    if found.has_border:
        _border(panel, found)
    panel.curve(*style.thin(t, curve, int(WIDTH) // 2), COLOUR, 1.6)
    later = np.linspace(WINDOWS[0][0] * end, end, 60)
    expected = _scaled(found, _expected(found, later))
    inside = np.where((expected >= panel.y[0]) & (expected <= panel.y[1]), expected, np.nan)
    panel.curve(later, inside, INK, 1.0, dashed=True)
    if found.has_bars:
        _bars(panel, means, end)
    return panel


def _border(panel: Panel, found: EnergyError) -> None:
    """Draw the most that is taken for round-off, and fill what is below if that is where the error is."""
    if found.round_off > 0.0:
        border = math.log10(found.round_off)
        if found.is_round_off:
            panel.band(panel.y[0], border, *panel.x, BAND)
        panel.level(border)


def _bars(panel: Panel, means: Floats, end: float) -> None:
    """Draw the means over their windows, with their names."""
    for (first, last), mean, text in zip(WINDOWS, means, NAMES, strict=True):
        if panel.inside(mean):
            panel.curve(np.array([first, last]) * end, np.array([mean, mean]), SECOND, 2.4)
            panel.word(
                panel.across(first * end) + 2, panel.up(mean) - 4, text, "start", INK, halo=True
            )


def _scaled(found: EnergyError, values: Floats) -> Floats:
    """Return values as the vertical scale has them: their powers of ten where it is logarithmic."""
    return logarithms(values) if found.is_log else values


def _limits(found: EnergyError, curve: Floats, means: Floats) -> tuple[float, float]:
    if not found.is_log:
        high = style.limits(curve, means, np.zeros(1), margin=0.22)[1]
        return 0.0, high
    border = np.array([found.round_off if found.has_border else np.nan])
    late = curve[found.t > LEAST * found.t[-1]]
    low, high = style.limits(late, means, _scaled(found, border), margin=0.15)
    return low, max(high, low + 1.0)


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
