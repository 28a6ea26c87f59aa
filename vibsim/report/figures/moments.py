"""A motion between its samples, and the numbers that its drawing needs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.models import Model
from vibsim.report import data
from vibsim.report.figures.scenes import Motion

SECONDS_A_PERIOD = 2.0  # at speed 1
WINDOW_PERIODS = 6.0  # width of a moving window; up to 1.5 times as many periods are shown at once
VISIBLE = 0.03  # smallest visible difference of two motions, relative to the size of the motion
FEWEST_SAMPLES = 6.0  # a period; straight lines between fewer cut off over a tenth of its extremes
MOST_PERIODS = 20.0  # that can be told apart in a small picture
STEADY = 0.8  # smallest ratio of the sizes of the first and the last third of a motion that stays the same
UNBOUNDED = 3.0  # motions larger than this multiple of the finest one are not drawn


def motion(
    model: Model,
    t: Floats,
    samples: Floats,
    series: Mapping[str, Floats],
    parameters: Mapping[str, Any],
    reach: Mapping[str, float],
) -> Motion:
    """Return a motion at times `t`, interpolated between the series of its states at the times `samples`."""
    states = {name: at_times(t, samples, x) for name, x in series.items()}
    if model.kind == "bouncing_ball":
        states["h"] = _flight(t, samples, series, float(parameters["g"]))
    return Motion(model, t, states, parameters, reach)


def window(span: float, period: float) -> float:
    """Return the width of the window over time: the whole `span`, or some periods of a long run."""
    return span if span <= 1.5 * WINDOW_PERIODS * period else WINDOW_PERIODS * period


def period(t: Floats, u: Floats) -> float:
    """Estimate the period of a motion from its number of turning points; the whole time without any."""
    step = np.diff(u)
    step = step[np.abs(step) > 1e-9 * data.largest(u)]
    turns = int(np.sum(np.signbit(step[1:]) != np.signbit(step[:-1])))
    return float(t[-1] - t[0]) / max(1.0, 0.5 * turns)


def first_shown(t: Floats, u: Floats) -> int:
    """Return the first sample that a small picture shows: of a long run of steady size, that of its last periods.

    All periods of such a run would be a block of colour. Those of one that grows or decays show how it does.
    """
    third, last = u.size // 3, float(t[-1])
    if not np.isfinite(u).all() or last - float(t[0]) <= MOST_PERIODS * period(t, u):
        return 0
    sizes = [float(np.ptp(part)) for part in (u[:third], u[-third:])]
    is_steady = min(sizes) >= STEADY * max(sizes)
    return int(np.searchsorted(t, last - WINDOW_PERIODS * period(t, u))) if is_steady else 0


def is_undersampled(steps: int, t: Floats, curve: tuple[Floats, Floats]) -> bool:
    """Return whether lines between the samples at `t` would hide motion that a number of steps resolves.

    The period is that of `curve` (times, values), since too few samples may show a slower motion.
    """
    has_more = steps > t.size - 1
    return has_more and t.size * period(*curve) < FEWEST_SAMPLES * float(t[-1] - t[0])


def at_times(times: Floats, t: Floats, x: Floats) -> Floats:
    """Interpolate a series at other times: a smooth blend of the tangents at the two neighbouring samples."""
    slope = np.gradient(x, t)
    i = data.bin_of(t, times)
    h = t[i + 1] - t[i]
    s = (times - t[i]) / h
    a, b = x[i] + h * s * slope[i], x[i + 1] - h * (1.0 - s) * slope[i + 1]
    weight = s * s * (3.0 - 2.0 * s)
    return np.asarray(a + (b - a) * weight)


def _flight(times: Floats, t: Floats, series: Mapping[str, Floats], g: float) -> Floats:
    """Return the height of a ball with its impacts: it falls from one sample until it meets the rise to the next."""
    i = data.bin_of(t, times)
    height, v = series["h"], series["v"]
    falls, rises = (
        height[j] + v[j] * x - 0.5 * g * x * x for j, x in ((i, times - t[i]), (i + 1, times - t[i + 1]))
    )  # fmt: skip
    # after its last impact it lies still
    rises = np.where((height[i + 1] <= 0.0) & (v[i + 1] == 0.0), 0.0, rises)
    has_impact = (v[i] < 0.0) & (v[i + 1] >= 0.0)
    # in flight both are the same but for the error of the scheme
    part = (times - t[i]) / (t[i + 1] - t[i])
    flight = falls + part * (rises - falls)
    return np.maximum(np.where(has_impact, np.maximum(falls, rises), flight), 0.0)
