"""The player of a report: the system in motion at the finest level, above the position over time.

The page holds the motion as numbers, thinned and rounded to tenths of a pixel. Without scripts it shows a picture with
several positions. If another motion differs visibly, it is drawn beside the first: of all schemes, the coarsest level
that is farthest from the finest level of the first scheme.

Source: vibration text, sections 3.1 (a window that moves along a long run) and 3.2 (players), note hpl 2 (two motions
side by side), 10.6 (pendulum with its forces).
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.report import choice, data, frame, style, words
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.figures import moments, scenes
from vibsim.report.figures.moments import SECONDS_A_PERIOD, UNBOUNDED, VISIBLE
from vibsim.report.figures.scenes import Motion, Part, Scene
from vibsim.report.page.templates import environment, markup, source
from vibsim.report.series import parameters_of

FRAMES_A_PERIOD = 48  # if there is room
FEWEST_FRAMES_A_PERIOD = 20  # only the beginning of a longer run is shown
NUMBERS_A_FRAME = 8  # of one motion, approximately
MOST_NUMBERS = 30_000  # of all series together, which keeps the data below 200 kB
LEAST_FRAMES = 240
POSITIONS = 6  # in the still picture
TRACE = 640.0, 150.0  # width and height of the position over time [pixel]
EDGE = 8.0


@dataclass(frozen=True)
class Lane:
    """A motion in the player."""

    title: str
    motion: Motion
    scene: Scene
    period: float  # approximate period of the motion
    end: float  # the last time of the run; the player may show only the beginning


def element(record: Results) -> str:
    """Return the player as HTML, with its script and its style; empty if the system cannot be drawn."""
    shown = lanes(record)
    if not shown:
        return ""
    files = {name: source(f"player.{name}") for name in ("js", "css")}
    return environment().get_template("player.html").render(_context(record, shown) | files)


def lanes(record: Results) -> list[Lane]:
    """Return the one or two motions of the player; empty if the system cannot be drawn or does not move."""
    model = record.model
    draw = scenes.scene_of(model)
    if draw is None or record.is_lean or f"{model.position}_finest" not in record:
        return []
    chosen = _chosen(record, _member(record))
    if not chosen:
        return []
    first, _, states = chosen[0]
    samples = record.times(first.case)
    period = moments.period(samples, states[model.position])
    has_few = samples.size * period < moments.FEWEST_SAMPLES * float(samples[-1] - samples[0])
    if has_few and model.kind != "bouncing_ball":
        # a smooth motion between few samples would be invented; that of a ball in flight is known
        return []
    t = _times(samples, period, len(chosen))
    there = samples <= t[-1] * (1.0 + 1e-12)
    reach = {
        name: max(data.largest(series[name][there]) for _, _, series in chosen) for name in states
    }
    parameters = parameters_of(record, first.case)
    found = []
    for one, level, series in chosen:
        motion = moments.motion(model, t, samples, series, parameters, reach)
        title = _title(record, one, level)
        found.append(Lane(title, motion, draw(motion), period, float(samples[-1])))
    return found


def _member(record: Results) -> Member:
    """Return the first scheme and, in a sweep, a typical member."""
    found = choice.quantities(record)
    if not found:
        return record.of_case(0)[0]
    members = choice.with_levels(record, choice.members(record, found[0]))
    return next((member for member in members if member.role == "typical"), members[0])


def _chosen(record: Results, member: Member) -> list[tuple[Member, int, dict[str, Floats]]]:
    """Return one or two motions: member, position of the level, series of the states."""
    model = record.model
    names = [state.name for state in model.states if f"{state.name}_finest" in record]
    finest = len(record.levels) - 1

    def series(one: Member, level: int) -> dict[str, Floats]:
        return {name: Ladder(record, name, one).on_level(level) for name in names}

    first = series(member, finest)
    if len(names) < len(model.states) or not all(np.isfinite(x).all() for x in first.values()):
        return []
    positions = [state.name for state in model.states[: model.coordinates]]
    size = max(data.largest(first[name]) for name in positions)
    known = float(frame.sizes(record, model.position)[member.case])
    if size == 0.0 or (math.isfinite(known) and size > frame.UNBOUNDED * known):
        return []
    others = []
    for one in record.of_case(member.case):
        found = series(one, 0)
        distance = max(float(np.max(np.abs(found[name] - first[name]))) for name in positions)
        largest = max(float(np.max(np.abs(found[name]))) for name in positions)
        if VISIBLE * size < distance and largest < UNBOUNDED * size:
            others.append((distance, one, found))
    if not others:
        return [(member, finest, first)]
    _, one, found = max(others, key=lambda other: other[0])
    return [(member, finest, first), (one, 0, found)]


def _title(record: Results, member: Member, level: int) -> str:
    """Name a motion by its level and, if there are several, by scheme and member."""
    step = words.number(float(record.dt(member.case)[level]), "brief")
    text = f"level {record.levels[level]}, dt = {step} {record.time_unit}"
    scheme = member.scheme_name if len(record.schemes) > 1 else ""
    return ", ".join(filter(None, [scheme, text.strip(), member.case_words]))


def _times(t: Floats, period: float, count: int) -> Floats:
    """Return the times of the frames, shape (frame,), for samples at `t` and `count` motions."""
    most = MOST_NUMBERS // (NUMBERS_A_FRAME * count)
    end = min(float(t[-1] - t[0]), period * most / FEWEST_FRAMES_A_PERIOD)
    wanted = max(LEAST_FRAMES, math.ceil(FRAMES_A_PERIOD * end / period))
    return np.linspace(float(t[0]), float(t[0]) + end, min(most, wanted) + 1)


def _context(record: Results, shown: list[Lane]) -> dict[str, Any]:
    t, period, position = shown[0].motion.t, shown[0].period, shown[0].motion.model.position
    whole = float(t[-1] - t[0])
    window = moments.window(whole, period)
    series = [lane.motion.states[position] for lane in shown]
    low, high = min(float(u.min()) for u in series), max(float(u.max()) for u in series)
    scale = (TRACE[1] - 2.0 * EDGE) / (high - low or 1.0)
    traces = [EDGE + scale * (high - u) for u in series]
    zero = EDGE + scale * high
    content = {
        "t": [float(t[0]), float(t[-1])],
        "unit": record.time_unit,
        "pace": period / SECONDS_A_PERIOD,
        "window": window,
        "size": TRACE,
        "lanes": [
            {"parts": [_packed(part) for part in lane.scene.parts], "u": _rounded(trace)}
            for lane, trace in zip(shown, traces, strict=True)
        ],
    }
    last = shown[0].end
    unit = record.unit(f"{position}_finest")
    return {
        # escaped, so that no text can end the script element
        "data": markup(json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")),
        "stages": [(lane.title, markup(_still(lane))) for lane in shown],
        "legend": shown[0].scene.legend,
        "frames": t.size - 1,
        "width": scenes.WIDTH,
        "height": scenes.HEIGHT,
        "trace": TRACE,
        "zero": round(zero, 1) if 0.0 <= zero <= TRACE[1] else None,
        "curves": [(i, _curve(t, trace, window)) for i, trace in reversed(list(enumerate(traces)))],
        "label": style.label(words.symbol(position), unit),
        "from": words.number(float(t[0]), "step"),
        "to": words.number(float(f"{t[0] + window:.3g}"), "step"),
        "unit": record.time_unit,
        "shown": words.number(float(f"{t[-1]:.3g}"), "step") if t[-1] < 0.999 * last else "",
        "length": words.number(last, "step"),
    }


def _curve(t: Floats, trace: Floats, window: float) -> str:
    """Return the position over time within the first window as SVG path data."""
    there = t <= t[0] + window * (1.0 + 1e-12)
    x = (t[there] - t[0]) / window * TRACE[0]
    points = zip(x.tolist(), trace[there].tolist(), strict=True)
    return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in points)


def _packed(part: Part) -> dict[str, Any]:
    """Return a part for the script: constants as one number, others as a series in tenths of a pixel."""
    columns = [
        float(np.ravel(column)[0])
        if np.ptp(np.asarray(column)) < 0.05
        else _rounded(np.asarray(column))
        for column in part.at
    ]
    return {"shape": part.shape, "at": columns} | ({"labelled": True} if part.label else {})


def _rounded(values: Floats) -> list[int]:
    """Return pixels in units of a tenth."""
    found: list[int] = np.round(10.0 * np.clip(values, -1e6, 1e6)).astype(int).tolist()
    return found


def _still(lane: Lane) -> str:
    """Return the parts at the start, over fainter bodies at other times of the first period."""
    scene, t = lane.scene, lane.motion.t
    last = FRAMES_A_PERIOD // 2 if t.size > FRAMES_A_PERIOD else t.size - 1
    places = np.linspace(0, last, POSITIONS).astype(int).tolist()[1:]
    bodies = [part for part in scene.parts if part.look in ("wire", "body", "wheel")]
    ghosts = [_shape(part, k) for k in places for part in bodies]
    moving = [_shape(part, 0) for part in scene.parts]
    moving += [_label(part) for part in scene.parts if part.label]
    return f'<g class="ghosts">{"".join(ghosts)}</g><g class="now">{"".join(moving)}</g>'


def _shape(part: Part, k: int) -> str:
    look = escape(part.look)
    if part.shape == "track":
        offset = float(np.ravel(part.at[0])[k])
        return f'<path class="{look}" transform="translate({-offset:.1f})" d="{part.outline}"/>'
    return f'<path class="{look}" d="{scenes.path_of(part, k)}"/>'


def _label(part: Part) -> str:
    place = scenes.place_of_label(part.shape, scenes.values_of(part, 0))
    at = ' display="none"' if place is None else f' x="{place[0]:.1f}" y="{place[1]:.1f}"'
    return f'<text class="{escape(part.look)}"{at}>{escape(part.label)}</text>'
