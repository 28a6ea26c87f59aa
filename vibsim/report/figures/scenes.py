"""Drawings of moving systems: lines, springs, bodies and forces, with their positions at every time.

A drawing is a list of parts whose numbers are series over time, in pixels of a frame of `WIDTH` times `HEIGHT`. Pages
and movies draw parts alike (`path_of`, `strokes` and `place_of_label`, and the same functions in ``player.js``).

Source: vibration text, section 10.6 (pendulum with its forces, the drag five times larger), 10.7, 10.8 (vehicle), 10.9,
10.3; sketches of figures 12 to 17.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.formula import derivative, parse, values
from vibsim.models import Model, tree
from vibsim.models.base import Formula, looked_up
from vibsim.models.shared.coordinates import angles

WIDTH, HEIGHT = 320.0, 220.0
WEIGHT = 0.45  # length of the arrow of the weight over that of the wire
MAGNIFIED = 5.0  # scale of the drag over that of other forces
MAGNIFIED_DRAG = f"{MAGNIFIED:g} D"
DRAG = "drag", f"drag D, drawn {MAGNIFIED:g} times as large"
LONGEST = 1.3  # longest arrow over the length of the wire
REACH = 92.0  # largest displacement of a body on a spring [pixel]
FORCE = 60.0  # length of the largest driving force [pixel]
CYLINDER = 26.0  # length of the cylinder of a dashpot [pixel]
COILS = 9  # turns of a spring
ARC = 0.3  # radius of the arc of an angle over the length of the wire
ARC_POINTS = 24
LABELLED = 10.0  # shortest arrow [pixel] and smallest angle [degree] with a label
BESIDE = 14.0  # from the tip of an arrow, or from an arc, to the middle of its label [pixel]
AROUND = 1.2  # shortest length of road in half the frame [m]


@dataclass(frozen=True)
class Motion:
    """A motion: series over time of shape (t,), and parameters."""

    model: Model
    t: Floats
    states: Mapping[str, Floats]
    parameters: Mapping[str, Any]
    reach: Mapping[str, float]  # largest size of each state over all motions drawn side by side

    def number(self, name: str) -> float:
        """Return a parameter."""
        return float(self.parameters[name])

    def output(self, name: str) -> Floats:
        """Return the series of an output of the model, shape (t,)."""
        formula = next(row.formula for row in self.model.outputs if row.name == name)
        return self.value(formula)

    def value(self, formula: Formula, **instead: float) -> Floats:
        """Return the series of a formula of the model, shape (t,), with the names `instead` replaced by values."""
        numbers = self.numbers | instead
        expression = parse(formula, tuple(numbers)) if isinstance(formula, str) else formula
        return np.broadcast_to(values(expression, numbers), self.t.shape)

    @cached_property
    def numbers(self) -> dict[str, Any]:
        """The values of all names that a formula of the model may use."""
        known = {"t": self.t, **self.states, **self.parameters}
        return known | looked_up(self.model, known)

    def has(self, name: str) -> bool:
        """Return whether the model has an output of this name."""
        return any(row.name == name for row in self.model.outputs)


@dataclass(frozen=True)
class Part:
    """A part of a drawing."""

    shape: str
    """``line`` and ``spring`` (two points), ``circle`` (centre, radius), ``box`` (centre, sizes), ``arrow`` (start,
    vector), ``arc`` (centre, radius, angle from straight down [degree]), ``track`` (shift of a fixed outline to the
    left)."""
    look: str  # class of the style sheet
    at: tuple[Floats | float, ...]  # numbers of the shape: series of shape (t,), or constants
    outline: str = ""  # path data of a track
    label: str = ""  # text beside an arrow or an arc


@dataclass(frozen=True)
class Scene:
    """A drawing and its legend."""

    parts: tuple[Part, ...]
    legend: tuple[tuple[str, str], ...] = ()  # look and words of the parts in the legend


def scene_of(model: Model) -> Callable[[Motion], Scene] | None:
    """Return the function that draws motions of a model; None if its system cannot be drawn."""
    if model.kind in SCENES:
        return SCENES[model.kind]
    is_displacement = model.is_alone and model.states[0].unit in {"m", "1"}
    is_displacement &= not (model.dimensionless and model.position in angles(model))
    # at an event that the drawing does not show, a body would turn in mid-air
    is_displacement &= model.events is None or not model.events.jumps
    return spring_mass if is_displacement else None


def pendulum(motion: Motion) -> Scene:
    """Draw a pendulum with the forces on its bob."""
    theta = motion.states["theta"]
    goes_up = motion.reach["theta"] > 1.9
    x0, y0, length = (160.0, 110.0, 72.0) if goes_up else (160.0, 22.0, 118.0)
    along = np.sin(theta), np.cos(theta)
    x, y = x0 + length * along[0], y0 + length * along[1]
    parts = [
        Part("line", "guide", (x0, y0, x0, y0 + 1.1 * length)),
        Part("arc", "angle", (x0, y0, ARC * length, np.degrees(theta)), label="θ"),
        Part("line", "wire", (x0, y0, x, y)),
        Part("circle", "pivot", (x0, y0, 3.0)),
        # beneath the arrows, so that small forces stay visible
        Part("circle", "body", (x, y, 9.0)),
    ]
    legend = []
    weight, heavy = WEIGHT * length, motion.number("m") * motion.number("g")
    for name, rod in (("wire_force", "wire"), ("pivot_force", "pivot")):
        if motion.has(name):
            pull = weight * _shortened(motion.output(name) / heavy)
            parts.append(Part("arrow", "gravity", (x, y, 0.0, weight), label="mg"))
            towards = -pull * along[0], -pull * along[1]
            parts.append(Part("arrow", "pull", (x, y, *towards), label="S"))
            legend += [("gravity", "gravity mg"), ("pull", f"force S of the {rod}")]
    for name, arm in (("drag_force", 1.0), ("drag_moment", motion.number("L"))):
        if motion.has(name):
            drag = weight * _shortened(MAGNIFIED * motion.output(name) / (heavy * arm))
            backwards = drag * along[1], -drag * along[0]
            parts.append(Part("arrow", "drag", (x, y, *backwards), label=MAGNIFIED_DRAG))
            legend.append(DRAG)
    return Scene(tuple(parts), tuple(legend))


def _shortened(force: Floats) -> Floats:
    """Limit a force, as a multiple of the weight, to the longest arrow that fits."""
    return np.clip(force, -LONGEST / WEIGHT, LONGEST / WEIGHT)


def elastic_pendulum(motion: Motion) -> Scene:
    """Draw a body on an elastic wire, with its forces."""
    across, up = motion.states["x"], motion.states["y"]
    # the scale fits the pivot at (0, 1) and the whole motion
    widest = max(motion.reach["x"], 0.3)
    lowest, highest = 1.0 + max(motion.reach["y"], 0.1), max(motion.reach["y"] - 1.0, 0.0)
    scale = min(0.44 * WIDTH / widest, 0.9 * HEIGHT / (lowest + highest + WEIGHT))
    x0, y0 = 160.0, 14.0 + scale * highest
    x, y = x0 + scale * across, y0 + scale * (1.0 - up)
    pull = _shortened(motion.output("wire_force"))
    length = np.maximum(np.hypot(across, 1.0 - up), 1e-9)
    weight = WEIGHT * scale
    towards = -weight * pull * across / length, -weight * pull * (1.0 - up) / length
    parts = [
        Part("line", "guide", (x0, y0, x0, y0 + 1.05 * scale)),
        Part("arc", "angle", (x0, y0, ARC * scale, np.degrees(np.arctan2(across, 1.0 - up))), label="θ"),
        Part("spring", "wire", (x0, y0, x, y)),
        Part("circle", "pivot", (x0, y0, 3.0)),
        Part("circle", "body", (x, y, 9.0)),
        Part("arrow", "gravity", (x, y, 0.0, weight), label="mg"),
        Part("arrow", "pull", (x, y, *towards), label="S"),
    ]  # fmt: skip
    legend = [("gravity", "gravity mg"), ("pull", "force S of the wire")]
    if motion.has("drag_force"):
        vx, vy = motion.states["vx"], motion.states["vy"]
        speed = np.maximum(np.hypot(vx, vy), 1e-300)
        size = weight * _shortened(MAGNIFIED * motion.output("drag_force"))
        backwards = -size * vx / speed, size * vy / speed
        parts.append(Part("arrow", "drag", (x, y, *backwards), label=MAGNIFIED_DRAG))
        legend.append(DRAG)
    return Scene(tuple(parts), tuple(legend))


def vehicle(motion: Motion) -> Scene:
    """Draw a wheel on its road and the body on its spring above it; the road moves under the vehicle."""
    place, road = motion.number("speed") * motion.t, _road(motion)
    body = motion.states["u"] + road
    tallest = max(float(np.max(np.abs(road))), motion.reach["u"], 1e-9)
    # the same scale across, unless the road would rush by
    up = 34.0 / tallest
    across = min(up, 0.5 * WIDTH / max(AROUND, 0.02 * float(place[-1])))
    # the road is level before the start and after the end
    ends = across * place[0] - WIDTH, across * place[-1] + WIDTH
    points = np.concatenate([ends[:1], across * place, ends[1:]])
    heights = np.pad(178.0 - up * road, 1, mode="edge")
    wheel = 178.0 - up * road - 13.0
    parts = (
        Part("track", "ground", (across * place - 160.0,), _outline(points, heights)),
        Part("spring", "wire", (160.0, wheel, 160.0, 96.0 - up * body)),
        Part("circle", "wheel", (160.0, wheel, 13.0)),
        Part("box", "body", (160.0, 84.0 - up * body, 84.0, 24.0)),
    )  # fmt: skip
    return Scene(parts)


def _road(motion: Motion) -> Floats:
    """Return the height of the road under the wheel, shape (t,)."""
    lookup = motion.model.lookup
    if lookup is None:
        return motion.output("road_height")
    table = lookup.table
    places = table.first + table.spacing * np.arange(table.points)
    return np.interp(motion.number("speed") * motion.t, places, table.heights)


def bouncing_ball(motion: Motion) -> Scene:
    """Draw a ball above the ground."""
    scale = 170.0 / max(motion.reach["h"], 1e-9)
    y = 195.0 - 10.0 - scale * motion.states["h"]
    ground = Part("line", "ground", (60.0, 195.0, 260.0, 195.0))
    return Scene((ground, Part("circle", "body", (160.0, y, 10.0))))


def spring_mass(motion: Motion) -> Scene:
    """Draw a body on a spring that moves to and fro, with its dashpot and its driving force, if it has any."""
    half, model = 18.0, motion.model
    # friction that holds a body is drawn without wheels
    parts = _on_spring(motion, "wheel" if model.events is None else "", half)
    *_, middle = (part for part in parts if part.look == "body")
    x, y = middle.at[0], middle.at[1]
    if model.dissipation is not None:
        spring = next(part for part in parts if part.shape == "spring")
        parts[parts.index(spring)] = Part("spring", "wire", (22.0, y - 9.0, x - half, y - 9.0))
        parts += _dashpot(x - half, y + 9.0)
    legend = []
    if model.driving is not None:
        # the driving power is the force times the velocity plus higher powers of it from damping
        force = motion.value(
            derivative(tree(model, model.driving), model.velocity), **{model.velocity: 0.0}
        )
        largest = max(float(np.max(np.abs(force))), 1e-300)
        parts.append(Part("arrow", "pull", (x, y, FORCE * force / largest, 0.0)))
        legend.append(("pull", "driving force"))
    return Scene(tuple(parts), tuple(legend))


def _dashpot(x1: Floats | float, y: Floats | float) -> list[Part]:
    """Return a cylinder held by the wall and its piston, held by the body at `x1`."""
    x0, gap = 22.0, x1 - 22.0
    cylinder, piston = x0 + 0.5 * gap, x0 + 0.55 * gap
    half = 0.5 * CYLINDER
    return [
        Part("line", "wire", (x0, y, cylinder - half, y)),
        Part("box", "wire", (cylinder, y, CYLINDER, 12.0)),
        Part("box", "wire", (piston, y, 2.0, 8.0)),
        Part("line", "wire", (piston, y, x1, y)),
    ]


def sliding_box(motion: Motion) -> Scene:
    """Draw a box on a floor, held by a spring."""
    return Scene(tuple(_on_spring(motion, "", 20.0)))


def _on_spring(motion: Motion, wheels: str, half: float) -> list[Part]:
    """Return wall, floor, spring and box, on wheels of the look `wheels`; empty for a box that slides."""
    u = motion.states[motion.model.position]
    floor, middle = 150.0, 180.0
    x = middle + REACH * u / max(motion.reach[motion.model.position], 1e-300)
    y = floor - half - (8.0 if wheels else 0.0)
    parts = [
        Part("line", "ground", (22.0, 90.0, 22.0, floor)),
        Part("line", "ground", (22.0, floor, 310.0, floor)),
        Part("line", "guide", (middle, 84.0, middle, floor)),
        Part("spring", "wire", (22.0, y, x - half, y)),
        Part("box", "body", (x, y, 2.0 * half, 2.0 * half)),
    ]
    if wheels:
        parts += [Part("circle", wheels, (x + s * 0.6 * half, floor - 4.0, 4.0)) for s in (-1, 1)]
    return parts


def washing_machine(motion: Motion) -> Scene:
    """Draw a machine on springs with its rotating unbalance."""
    up = 34.0 * motion.states["u"] / max(motion.reach["u"], 1e-300)
    y = 95.0 - up
    angle = motion.number("speed") * motion.t
    # the force e W^2 cos(W t) initially points upwards
    parts = (
        Part("line", "ground", (70.0, 205.0, 250.0, 205.0)),
        Part("spring", "wire", (130.0, 205.0, 130.0, y + 46.0)),
        Part("spring", "wire", (190.0, 205.0, 190.0, y + 46.0)),
        Part("box", "body", (160.0, y, 104.0, 92.0)),
        Part("circle", "wheel", (160.0, y, 34.0)),
        Part("circle", "mark", (160.0 + 26.0 * np.sin(angle), y - 26.0 * np.cos(angle), 6.0)),
    )
    return Scene(parts, (("mark", "unbalance"),))


SCENES: Mapping[str, Callable[[Motion], Scene] | None] = {
    "pendulum": pendulum,
    "linear_pendulum": pendulum,
    "physical_pendulum": pendulum,
    "elastic_pendulum": elastic_pendulum,
    "vehicle": vehicle,
    "bouncing_ball": bouncing_ball,
    "sliding_box": sliding_box,
    "washing_machine": washing_machine,
}
"""Kind of a model to its drawing; any other model with a displacement is a body on a spring."""


def _outline(x: Floats, y: Floats) -> str:
    """Return a line through points as SVG path data."""
    points = zip(np.round(x).astype(int).tolist(), np.round(y, 1).tolist(), strict=True)
    heights_at: dict[int, float] = {}
    for across, height in points:
        heights_at.setdefault(across, height)
    return "M" + "L".join(f"{across} {height:g}" for across, height in heights_at.items())


def values_of(part: Part, k: int) -> list[float]:
    """Return the numbers of a part at the k-th time."""
    return [float(np.ravel(column)[k if np.size(column) > 1 else 0]) for column in part.at]


def strokes(shape: str, values: Sequence[float]) -> list[list[tuple[float, float]]]:
    """Return the polylines of a shape with these numbers; none if it is too small to be visible."""
    match shape, values:
        case "line", [x0, y0, x1, y1]:
            return [[(x0, y0), (x1, y1)]]
        case "spring", [x0, y0, x1, y1]:
            length = math.hypot(x1 - x0, y1 - y0) or 1.0
            dx, dy = (x1 - x0) / length, (y1 - y0) / length
            line = [(x0, y0)]
            for i in range(2 * COILS):
                s, side = length * (0.1 + 0.8 * (i + 0.5) / (2 * COILS)), 5.0 - 10.0 * (i % 2)
                line.append((x0 + s * dx - side * dy, y0 + s * dy + side * dx))
            return [[*line, (x1, y1)]]
        case "box", [x, y, w, h]:
            left, right, top, bottom = x - w / 2, x + w / 2, y - h / 2, y + h / 2
            return [[(left, top), (right, top), (right, bottom), (left, bottom), (left, top)]]
        case ("circle", [x, y, r]) | ("arc", [x, y, r, _]):
            angle = math.tau if shape == "circle" else math.radians(math.fmod(values[3], 360.0))
            turned = [angle * i / ARC_POINTS for i in range(ARC_POINTS + 1)]
            return [[(x + r * math.sin(a), y + r * math.cos(a)) for a in turned]]
        case "arrow", [x, y, dx, dy]:
            length = math.hypot(dx, dy)
            if length < 2.0:
                return []
            head = min(8.0, 0.6 * length) / length
            bx, by = x + dx * (1.0 - head), y + dy * (1.0 - head)
            nx, ny = -dy * 0.45 * head, dx * 0.45 * head
            tip = x + dx, y + dy
            return [[(x, y), tip], [(bx + nx, by + ny), tip, (bx - nx, by - ny)]]
    raise ValueError(f"{shape} of {len(values)} numbers")


def path_of(part: Part, k: int) -> str:
    """Return the SVG path data of a part at the k-th time, as ``player.js`` does."""
    values = values_of(part, k)
    match part.shape, values:
        case "circle", [x, y, r]:
            return f"M{x - r:.1f} {y:.1f}a{r:g} {r:g} 0 1 0 {2 * r:g} 0a{r:g} {r:g} 0 1 0 {-2 * r:g} 0z"
        case "box", [x, y, w, h]:
            return f"M{x - w / 2:.1f} {y - h / 2:.1f}h{w:g}v{h:g}h{-w:g}z"
    lines = strokes(part.shape, values)
    return "".join("M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in line) for line in lines)


def place_of_label(shape: str, values: Sequence[float]) -> tuple[float, float] | None:
    """Return the centre of the label of an arrow or an arc; None if it is too small for one."""
    if shape == "arrow":
        x, y, dx, dy = values
        length = math.hypot(dx, dy)
        if length < LABELLED:
            return None
        x, y = x + dx - BESIDE * dy / length, y + dy + BESIDE * dx / length
    else:
        x, y, r, degrees = values
        degrees = math.fmod(degrees, 360.0)
        if abs(degrees) < LABELLED:
            return None
        middle = math.radians(degrees / 2.0)
        x, y = x + (r + BESIDE) * math.sin(middle), y + (r + BESIDE) * math.cos(middle)
    return min(max(x, BESIDE), WIDTH - BESIDE), min(max(y, BESIDE), HEIGHT - BESIDE)
