"""The angular frequency and the amplitude that are found in solutions, from peak to peak, beside the exact ones.

Source: vibration text, section 3.5 and figure 2.
"""

from __future__ import annotations

import math

import numpy as np

from vibsim.core.record import Record
from vibsim.report import choice, data, style
from vibsim.report.data import at
from vibsim.report.figures import extrema, panels
from vibsim.report.style import Picture
from vibsim.report.text import words
from vibsim.report.types import Experiment

MARKED = 60  # most peaks that get a marker each


def local_frequency(experiment: Experiment, record: Record) -> Picture | None:
    """Draw local angular frequency and amplitude against the number of the peak; None with fewer than two peaks."""
    if "peak_time" not in record:
        return None
    everyone = choice.with_levels(experiment, data.everyone(record))
    case = everyone[0].case
    runs = extrema.runs_of(record, [member for member in everyone if member.case == case])
    if not runs:
        return None
    axes = panels.stacked([2.3, 2.3])
    several = len({member.scheme for _, member, _ in runs}) > 1
    time, step = data.time_unit(record), data.steps_of(record, case)
    period = float(data.exact_periods(record)[case])
    size = extrema.exact_amplitude(experiment, record, case)
    exact = (2.0 * math.pi / period, size)
    drawn: list[list[np.ndarray]] = [[], []]
    for (_, member, level), look in zip(runs, extrema.looks_of(runs), strict=True):
        found = (
            at(record, name, member, level=level)
            for name in ("peak_time", "peak", "trough_time", "trough")
        )
        t, peak, trough_time, trough = found
        keep = np.isfinite(t)
        t, peak = t[keep], peak[keep]
        dt = f"dt = {words.number(float(step[level]), 'step')} {data.time_unit(record, 'dt')}".rstrip()
        text = style.entry(f"{member.scheme_name}, {dt}" if several else dt)
        line = look | {"linewidth": 1.1, "markersize": 4, "label": text}
        line["marker"] = look["marker"] if t.size <= MARKED else ""
        series = 2.0 * np.pi / np.diff(t), extrema.heights(t, peak, trough_time, trough)
        for ax, values, kept in zip(axes, series, drawn, strict=True):
            ax.plot(np.arange(1, values.size + 1), values, **line)
            kept.append(values)
    radians = f"rad {data.pretty_unit(f'{time}-1')}" if time else ""
    measure = data.unit(record, f"{choice.position(experiment)}_finest")
    rows = (("angular frequency", radians), ("amplitude", measure))
    for ax, (text, unit), value, kept in zip(axes, rows, exact, drawn, strict=True):
        known = np.array([value] if math.isfinite(value) else [])
        if known.size:
            ax.axhline(value, label="exact", **style.REFERENCE)
        ax.set_ylim(*style.limits(*kept, known))
        ax.yaxis.set_label_coords(-0.115, 0.5)
        ax.set(ylabel=style.label(text, unit), title=f"Local {text}")
        style.beside(ax)
    axes[1].set_xlabel("number of the peak")
    return Picture(
        "local_frequency",
        "Angular frequency and amplitude found in the solutions",
        "The frequency is 2π over the time from a peak to the next one, the amplitude half the height from a peak to "
        "the trough behind it; peaks are interpolated by a parabola. Dashed: exact.",
        "Local angular frequency and amplitude against the number of the peak, with the exact ones",
        axes[0].get_figure(root=True),
    )
