"""The picture of a drift: the largest energy error so far, its means over three windows, and the drift asked for.

The rules are those of `vibsim.observe.energy_drift`: with the means m3, m2, m1 over [T/8, T/4], [T/4, T/2] and [T/2, T]
a drift ``a + b t^k`` has ``(m1 - m2)/(m2 - m3) = 2^k``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vibsim.checks.fields import name_of
from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import CENTRED, DRIFTS
from vibsim.observe.thresholds import LEAST_PERIODS, LEAST_SAMPLES, STILL
from vibsim.report import style
from vibsim.report.data import Member, at, time_label, times, unit, whole
from vibsim.report.evidence import frame
from vibsim.report.evidence.frame import brief, evidence, measured, short
from vibsim.report.style import Picture
from vibsim.report.types import Axes, ConservesCheck, Experiment

WINDOWS = ((0.125, 0.25), (0.25, 0.5), (0.5, 1.0))  # in parts of the end, those of m3, m2 and m1
NAMES = ("m₃", "m₂", "m₁")
POWERS = {"linear": 1, "quadratic": 2}  # of t, in proportion to which a drift grows
LEAST = 1e-4  # part of the time before which a logarithmic scale need not show the error


@dataclass(frozen=True)
class EnergyError:
    """The energy error of one run as the check found it, over the energy at the start where that is not 0."""

    kind: str  # of `vocabulary.DRIFTS`
    expected: str  # kind of drift that the check asks for
    t: Floats
    running: Floats  # the largest error so far, shape (t,)
    means: Floats  # m3, m2, m1
    round_off: float  # largest error that is taken for round-off
    power: float  # k, NaN where it cannot be told
    rate: float  # of the kind of drift, see `vibsim.observe.energy_drift.Drift`

    @property
    def has_border(self) -> bool:
        """Whether the error has to be compared with round-off."""
        return "none" in (self.kind, self.expected)

    @property
    def is_broken(self) -> bool:
        """Whether the run broke down, so that it has no means."""
        return not np.isfinite(self.means).all()


def picture(
    _: Experiment, record: Record, check: ConservesCheck, name: str, member: Member
) -> Picture | None:
    """Draw how the largest energy error so far grows, beside the drift that a check asks for."""
    series = f"{check.about}_running_max"
    if series not in record:
        return evidence(f"{member.title}: the largest energy error so far is not stored.")
    level, kind, rate, power = (
        measured(record, name, field, member)
        for field in ("level", "drift", "drift_rate", "drift_power")
    )
    first = abs(float(at(record, "energy_initial", member)))
    running = at(record, series, member, level=whole(record, "level").index(int(level)))
    found = EnergyError(
        kind=DRIFTS[int(kind)],
        expected=check.drift,
        t=times(record, member.case),
        # the last velocity may be a one-sided one, which the verdict does not look at
        running=np.append(running[:-1], np.nan) / (first or 1.0),
        means=at(record, name_of(name, "window_means"), member) / (first or 1.0),
        round_off=measured(record, name, "round_off", member) / (first or 1.0),
        power=power,
        rate=rate,
    )
    if not frame.usable(found.running).size:
        sentence = "the energy error is 0 at every step, so there is nothing to draw."
        return evidence(f"{member.title}: {sentence}") if np.any(found.running == 0.0) else None
    by = " by [D₂ₜu]" if check.conserves.endswith(CENTRED) else ""
    label = f"largest energy error so far{' / E(0)' if first else ''}{by}"
    title = style.label(label, "" if first else unit(record, "energy_deviation_max_abs"))
    figure = style.canvas(1.0)
    _draw(frame.panel(figure, title, time_label(record), frame.WIDE), found)
    caption = f"{member.title}, level {level:.0f}: {_naming(found)} {_dashed_line(found)}".strip()
    return evidence(caption, title, figure)


def _draw(ax: Axes, found: EnergyError) -> None:
    """Draw windows, error, means and the drift asked for."""
    t, end = found.t, float(found.t[-1])
    has_bars = found.kind != "none" and not found.is_broken
    ax.set_xlim(float(t[0]), end)
    if found.has_border or found.kind == "exponential" or found.is_broken:
        border = found.round_off if found.has_border else np.nan
        lowest = 0.1 * np.max(frame.usable(found.running))
        around = np.array([border, lowest])
        frame.scale(ax, found.running[t > LEAST * end], found.means, around, is_log=True)
    else:
        frame.scale(ax, found.running, found.means, np.zeros(1), margin=0.22)
        ax.set_ylim(bottom=0.0)
    if has_bars:
        for first, last in WINDOWS[::2]:
            ax.axvspan(first * end, last * end, color=frame.BAND, alpha=0.6, linewidth=0, zorder=0)
    if found.has_border and found.round_off > 0.0:
        # the most that is taken for round-off; below is where the error is
        if found.kind == "none":
            frame.allowed(ax, 0.0, found.round_off)
        ax.axhline(found.round_off, **frame.DASHED)
    ax.plot(*style.thin(t, found.running, 160), color=frame.COLOUR, linewidth=1.2)
    later = np.linspace(WINDOWS[0][0] * end, end, 60)
    ax.plot(later, _expected(found, later), **frame.DASHED)
    if has_bars:
        for (first, last), mean, text in zip(WINDOWS, found.means, NAMES, strict=True):
            ax.plot([first * end, last * end], [mean, mean], color=frame.SECOND, linewidth=1.8)
            place = (first * end, mean)
            ax.annotate(text, place, (2, 3), textcoords="offset points", fontsize=frame.SIZE)


def _expected(found: EnergyError, t: Floats) -> Floats:
    """Return the drift that is asked for, through m2, and m1 where it grows; NaN where it is no line."""
    _, second, first = found.means
    if found.has_border:
        return np.full(t.shape, np.nan)
    if found.expected == "bounded":
        return np.full(t.shape, second)
    power = POWERS[found.expected]
    # the mean of t^k over a window
    earlier, later = (
        (b ** (power + 1) - a ** (power + 1)) / ((power + 1) * (b - a)) for a, b in WINDOWS[1:]
    )
    part = (t / found.t[-1]) ** power
    return np.asarray(second + (first - second) * (part - earlier) / (later - earlier))


def _naming(found: EnergyError) -> str:
    """Say by which number the drift was named."""
    most = float(np.nanmax(found.running))
    third, second, first = means = found.means.tolist()
    numbers = ", ".join(f"{n} = {short(m)}" for n, m in zip(NAMES, means, strict=True))
    bars = f"the largest energy error so far has the means (bars) {numbers}."
    if found.kind == "none":
        border = brief(found.round_off)
        return f"the largest energy error, {brief(most)}, is within the round-off of this run, {border}."
    if found.is_broken:
        return "the largest energy error so far; it ends where the run breaks down."
    if found.kind == "bounded":
        part = 100.0 * (first - second) / most
        how = "no growth" if part <= 100.0 * STILL else "it grows ever more slowly"
        return f"{bars} m₁ is above m₂ by {brief(part)} % of the largest error: {how}."
    if found.kind == "exponential":
        factor = short(float(np.exp(found.rate)))
        return f"{bars} The energy itself changes by the factor {factor} per period: exponential."
    if math.isnan(found.power):
        return (
            f"{bars} The run is too short to name a drift; {LEAST_PERIODS:g} periods and {LEAST_SAMPLES} times "
            "are needed."
        )
    before = second - third
    law = f"(m₁ − m₂)/(m₂ − m₃) = {short((first - second) / before) if before else '∞'}"
    if found.kind in POWERS:
        return f"{bars} {law}; a drift like {_like(found.kind)} gives {2 ** POWERS[found.kind]}."
    return f"{bars} {law}, which matches no named drift."


def _dashed_line(found: EnergyError) -> str:
    """Say what the dashed line is."""
    if found.is_broken:
        return ""
    if found.has_border:
        return "Dashed: the largest error that counts as round-off."
    if found.expected == "bounded":
        return "Dashed: m₂, above which a bounded error does not rise."
    return f"Dashed: a drift in proportion to {_like(found.expected)} through m₂ and m₁."


def _like(drift: str) -> str:
    return "t²" if drift == "quadratic" else "t"
