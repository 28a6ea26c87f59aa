"""The picture of an energy drift: the running maximum of the error, its means over three windows, the expected drift.

The rules are those of `vibsim.observe.energy_drift`: with the means m3, m2, m1 over [T/8, T/4], [T/4, T/2] and [T/2, T]
a drift ``a + b t^k`` has ``(m1 - m2)/(m2 - m3) = 2^k``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import CENTRED, DRIFTS
from vibsim.experiment.sweep_columns import options_of, recorded_columns
from vibsim.observe.thresholds import LEAST_PERIODS, LEAST_SAMPLES, STILL
from vibsim.report import style
from vibsim.report.choice import CheckedLadder
from vibsim.report.evidence import frame
from vibsim.report.evidence.frame import brief, evidence, short
from vibsim.report.style import Picture
from vibsim.report.types import Axes, ConservesCheck

WINDOWS = ((0.125, 0.25), (0.25, 0.5), (0.5, 1.0))  # of m3, m2 and m1, as fractions of the end
NAMES = ("m₃", "m₂", "m₁")
POWERS = {"linear": 1, "quadratic": 2}  # kind of a drift to the power of t
LEAST = 1e-4  # fraction of the time before which the error does not set a logarithmic scale


@dataclass(frozen=True)
class EnergyError:
    """The energy error of one run as a check measured it, relative to the initial energy unless that is 0."""

    kind: str  # measured kind of drift, of `vocabulary.DRIFTS`
    expected: str  # kind of drift that the check expects
    t: Floats
    running: Floats  # running maximum, shape (t,)
    means: Floats  # m3, m2, m1
    round_off: float  # largest error that counts as round-off
    power: float  # k; NaN if undetermined
    rate: float  # see `vibsim.observe.energy_drift.Drift`

    @property
    def has_border(self) -> bool:
        """Whether the error is compared with round-off."""
        return "none" in (self.kind, self.expected)

    @property
    def is_broken(self) -> bool:
        """Whether the run broke down and has no means."""
        return not np.isfinite(self.means).all()


def picture(checked: CheckedLadder, check: ConservesCheck) -> Picture | None:
    """Draw the running maximum of the energy error beside the drift that a check expects."""
    record, member, series = checked.record, checked.member, f"{check.about}_running_max"
    if series not in record:
        return evidence(f"{member.title}: the largest energy error so far is not stored.")
    level, kind, rate, power = checked.numbers("level", "drift", "drift_rate", "drift_power")
    (round_off,) = checked.numbers("round_off")
    initial = abs(float(record.at("energy_initial", member)))
    running = record.at(series, member, level=record.levels.index(int(level))).copy()
    experiment = record.experiment
    options = options_of(experiment, recorded_columns(record), *member.place)
    if not experiment.schemes[member.scheme].method.has_own_end(record.model, options):
        running[-1] = np.nan  # the verdict leaves out a velocity with a formula of its own
    error = EnergyError(
        kind=DRIFTS[int(kind)],
        expected=check.drift,
        t=record.times(member.case),
        running=running / (initial or 1.0),
        means=record.at(checked.variable("window_means"), member) / (initial or 1.0),
        round_off=round_off / (initial or 1.0),
        power=power,
        rate=rate,
    )
    if not frame.usable(error.running).size:
        sentence = "the energy error is 0 at every step, so there is nothing to draw."
        return evidence(f"{member.title}: {sentence}") if np.any(error.running == 0.0) else None
    by = " by [D₂ₜu]" if check.conserves.endswith(CENTRED) else ""
    label = f"largest energy error so far{' / E(0)' if initial else ''}{by}"
    title = style.label(label, "" if initial else record.unit("energy_deviation_max_abs"))
    figure = style.canvas(1.0)
    _draw(frame.panel(figure, title, record.time_label, frame.WIDE), error)
    caption = f"{member.title}, level {level:.0f}: {_naming(error)} {_dashed_line(error)}".strip()
    return evidence(caption, title, figure)


def _draw(ax: Axes, error: EnergyError) -> None:
    t, end = error.t, float(error.t[-1])
    has_bars = error.kind != "none" and not error.is_broken
    ax.set_xlim(float(t[0]), end)
    if error.has_border or error.kind == "exponential" or error.is_broken:
        border = error.round_off if error.has_border else np.nan
        lowest = 0.1 * np.max(frame.usable(error.running))
        around = np.array([border, lowest])
        frame.scale(ax, error.running[t > LEAST * end], error.means, around, is_log=True)
    else:
        frame.scale(ax, error.running, error.means, np.zeros(1), margin=0.22)
        ax.set_ylim(bottom=0.0)
    if has_bars:
        for start, stop in WINDOWS[::2]:
            ax.axvspan(start * end, stop * end, color=frame.BAND, alpha=0.6, linewidth=0, zorder=0)
    if error.has_border and error.round_off > 0.0:
        # the largest error that counts as round-off, and the band below it
        if error.kind == "none":
            frame.allowed(ax, 0.0, error.round_off)
        ax.axhline(error.round_off, **frame.DASHED)
    ax.plot(*style.thin(t, error.running, 160), color=frame.COLOUR, linewidth=1.2)
    later = np.linspace(WINDOWS[0][0] * end, end, 60)
    ax.plot(later, _expected(error, later), **frame.DASHED)
    if has_bars:
        for (start, stop), mean, text in zip(WINDOWS, error.means, NAMES, strict=True):
            ax.plot([start * end, stop * end], [mean, mean], color=frame.SECOND, linewidth=1.8)
            point = (start * end, mean)
            ax.annotate(text, point, (2, 3), textcoords="offset points", fontsize=frame.SIZE)


def _expected(error: EnergyError, t: Floats) -> Floats:
    """Return the expected drift through m2 (and m1, if it grows); NaN if round-off is expected or found."""
    _, second, first = error.means
    if error.has_border:
        return np.full(t.shape, np.nan)
    if error.expected == "bounded":
        return np.full(t.shape, second)
    power = POWERS[error.expected]
    # the mean of t^k over a window
    earlier, later = (
        (b ** (power + 1) - a ** (power + 1)) / ((power + 1) * (b - a)) for a, b in WINDOWS[1:]
    )
    growth = (t / error.t[-1]) ** power
    return np.asarray(second + (first - second) * (growth - earlier) / (later - earlier))


def _naming(error: EnergyError) -> str:
    """Say which number decides the kind of the drift."""
    largest = float(np.nanmax(error.running))
    third, second, first = means = error.means.tolist()
    numbers = ", ".join(f"{n} = {short(m)}" for n, m in zip(NAMES, means, strict=True))
    bars = f"the largest energy error so far has the means (bars) {numbers}."
    if error.kind == "none":
        border = brief(error.round_off)
        return f"the largest energy error, {brief(largest)}, is within the round-off of this run, {border}."
    if error.is_broken:
        return "the largest energy error so far; it ends where the run breaks down."
    if error.kind == "bounded":
        part = 100.0 * (first - second) / largest
        growth = "no growth" if part <= 100.0 * STILL else "it grows ever more slowly"
        return f"{bars} m₁ is above m₂ by {brief(part)} % of the largest error: {growth}."
    if error.kind == "exponential":
        factor = short(float(np.exp(error.rate)))
        return f"{bars} The energy itself changes by the factor {factor} per period: exponential."
    if math.isnan(error.power):
        return (
            f"{bars} The run is too short to name a drift; {LEAST_PERIODS:g} periods and {LEAST_SAMPLES} times "
            "are needed."
        )
    earlier = second - third
    law = f"(m₁ − m₂)/(m₂ − m₃) = {short((first - second) / earlier) if earlier else '∞'}"
    if error.kind in POWERS:
        return f"{bars} {law}; a drift like {_like(error.kind)} gives {2 ** POWERS[error.kind]}."
    return f"{bars} {law}, which matches no named drift."


def _dashed_line(error: EnergyError) -> str:
    if error.is_broken:
        return ""
    if error.has_border:
        return "Dashed: the largest error that counts as round-off."
    if error.expected == "bounded":
        return "Dashed: m₂, above which a bounded error does not rise."
    return f"Dashed: a drift in proportion to {_like(error.expected)} through m₂ and m₁."


def _like(drift: str) -> str:
    return "t²" if drift == "quadratic" else "t"
