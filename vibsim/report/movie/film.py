"""The content of a movie: one or two runs, their drawn systems, the times of the frames, and the moving window.

Source: vibration text, sections 3.1 (a window that moves along a long run, frames that are skipped) and 8.7, note
hpl 2 (two runs side by side), 10.6 (the pendulum with its forces).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.models import Model
from vibsim.report import data, style, words
from vibsim.report.data import Results
from vibsim.report.figures import moments, scenes
from vibsim.report.figures.scenes import Scene
from vibsim.report.series import parameters_of

MOST_FRAMES = 1500
"""Longer runs have fewer frames a period, and then show only their beginning, unless the user sets the number."""
FEWEST_FRAMES_A_PERIOD = 12
LEAST_SECONDS = 8.0


@dataclass(frozen=True)
class Run:
    """One member with one scheme on one level."""

    title: str
    t: Floats  # times of the samples, shape (sample,)
    series: Floats  # the quantity at the samples; not finite after a breakdown
    states: Mapping[str, Floats]  # every state of the model at the samples
    exact: Floats | None  # the exact solution of the quantity at the samples, if known
    parameters: Mapping[str, Any]


@dataclass(frozen=True)
class Film:
    """The content of all frames."""

    runs: tuple[Run, ...]
    scenes: tuple[Scene, ...]  # a drawing of each run at these times; empty if there is none
    t: Floats  # time of every frame, shape (frame,)
    start: float  # first time shown
    stop: float  # last time shown
    window: float  # width of the window over the series: the whole time, or some periods
    label: str  # label of the series, with its unit
    time_unit: str
    end: float  # last time requested; the movie may show only the beginning
    name_of_exact: str = "exact"  # name of `Run.exact` in the legend

    @property
    def is_cut(self) -> bool:
        """Whether only the beginning is shown."""
        return self.stop < self.end


def run(record: Results, scheme: str, quantity: str) -> Run:
    """Return a run from a level record that holds one member with its series over time."""
    model, place = record.model, record.schemes.index(scheme)
    t = record.times(0)
    names = [state.name for state in model.states]
    exact = f"{quantity}_exact"
    step = words.number(float(t[-1]) / int(str(record.attrs["steps"])), "brief")
    prefix = scheme if len(record.schemes) > 1 else ""
    text = f"level {int(record['level'])}, dt = {step} {record.time_unit}".strip()
    return Run(
        title=", ".join(filter(None, [prefix, text, words.swept(record.case_name(0))])),
        t=t,
        series=np.asarray(record[quantity][place, 0], dtype=np.float64),
        states={name: record[name][place, 0] for name in names if name in record},
        exact=np.asarray(record[exact][0], dtype=np.float64) if exact in record else None,
        parameters=parameters_of(record, 0),
    )


def differs_visibly(other: Run, first: Run) -> float:
    """Return the relative distance of a run from the first one; 0 if it is invisible, or the run leaves the frame."""
    if not (np.isfinite(first.series).all() and np.isfinite(other.series).all()):
        return 0.0
    size = data.largest(first.series)
    distance = data.largest(other.series - np.interp(other.t, first.t, first.series))
    is_held = data.largest(other.series) < moments.UNBOUNDED * size
    return distance / size if is_held and moments.VISIBLE * size < distance else 0.0


def film(
    record: Results,
    runs: Sequence[Run],
    quantity: str,
    *,
    fps: float,
    frames: int | None = None,
    start: float | None = None,
    end: float | None = None,
    periods: float | None = None,
    most: int = MOST_FRAMES,
) -> Film:
    """Return the content of the movie of one or two runs; the level record of the first one has the units.

    A period takes `moments.SECONDS_A_PERIOD` unless that needs more than `most` frames; a number of `frames` is spread
    evenly over the whole time. By default the movie shows the whole time of the shortest run, through a window that is
    as wide, or of some `periods` of a long run.
    """
    first = runs[0]
    period = moments.period(first.t, np.nan_to_num(first.series, posinf=0.0, neginf=0.0))
    begin = float(first.t[0]) if start is None else start
    stop = min(float(one.t[-1]) for one in runs) if end is None else end
    last = stop
    if frames is None:
        frames, stop = _as_needed(begin, stop, period, fps, most)
    t, span = np.linspace(begin, stop, frames), stop - begin
    window = moments.window(span, period) if periods is None else min(span, periods * period)
    return Film(
        runs=tuple(runs),
        scenes=_scenes(record.model, runs, t),
        t=t,
        start=begin,
        stop=stop,
        window=window,
        label=style.label(words.symbol(quantity), record.unit(quantity)),
        time_unit=record.time_unit,
        end=last,
        name_of_exact=record.name_of_exact,
    )


def _as_needed(start: float, end: float, period: float, fps: float, most: int) -> tuple[int, float]:
    """Return the number of frames that the motion needs, and the last time that they show."""
    periods = (end - start) / period
    needed = max(LEAST_SECONDS * fps, moments.SECONDS_A_PERIOD * fps * periods)
    frames = math.ceil(min(most, needed))
    return frames, min(end, start + period * frames / FEWEST_FRAMES_A_PERIOD)


def _scenes(model: Model, runs: Sequence[Run], t: Floats) -> tuple[Scene, ...]:
    draw = scenes.scene_of(model)
    series = [x for one in runs for x in one.states.values()]
    is_whole = all(len(one.states) == len(model.states) for one in runs)
    if draw is None or not is_whole or not all(np.isfinite(x).all() for x in series):
        return ()
    reach = {name: max(data.largest(one.states[name]) for one in runs) for name in runs[0].states}
    motions = [moments.motion(model, t, one.t, one.states, one.parameters, reach) for one in runs]
    return tuple(draw(motion) for motion in motions)
