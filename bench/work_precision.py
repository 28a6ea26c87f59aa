"""What an error costs: the time of one trajectory for every scheme and for SciPy's adaptive references."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bench.ours import Floats
from bench.page import Section, chart, gather, table
from bench.timing import interleave, seconds
from vibsim.engine import integrate
from vibsim.models import MODELS
from vibsim.schemes import FIXED_STEP, adaptive
from vibsim.simulation.adaptive import CLASSES

TITLE = "Work against precision"
ANSWER = (
    "An error of 1e-09 takes {0[precision.pefrl]:.2g} ms with `pefrl`, {0[precision.rk4]:.2g} ms with `rk4` and "
    "{0[precision.dop853]:.2g} ms with SciPy's DOP853."
)
PICTURE = Path(__file__).resolve().parents[1] / "docs" / "images" / "work-precision.svg"
DRAWN = ("central", "rk4", "pefrl", "dop853")
LONGEST = 1.5
"""Seconds that SciPy may take with a setting, as they are expected, for it to be tried."""
TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(4, 28))
"""Two to a decade, from 1e-2 to 3e-14."""
Measured = tuple[list[str], dict[str, float]]


@dataclass(frozen=True)
class Task:
    """One pendulum to its end, and the errors to be reached."""

    end: float
    wanted: tuple[float, ...]
    most: int
    """Steps at most."""
    samples: int
    """Times at which errors are taken."""

    @property
    def times(self) -> Floats:
        """Where errors are taken, and the start."""
        return np.linspace(0.0, self.end, self.samples + 1)

    def exact(self) -> Floats:
        """Return the exact angle at `times`."""
        model = MODELS["pendulum"]
        assert model.exact is not None
        parameters = {"g": 1.0, "L": 1.0, "m": 1.0}
        return np.asarray(
            model.exact(self.times, {"theta": 1.0, "omega": 0.0}, parameters)["theta"]
        )


@dataclass(frozen=True)
class Point:
    """A method with a setting."""

    run: Callable[[], Any]
    """Returns angle and angular velocity at the times of the task."""
    steps: int
    error: float
    growth: float
    """The power of t with which the largest energy error so far grows over the last decade of time."""


def run(small: bool) -> Section:
    """Measure a run of some periods and a long one."""
    short = Task(100.0, (1e-3, 1e-6, 1e-9), 200 * 2 ** (4 if small else 13), 200)
    long = Task(2000.0, (1e-2, 1e-5), 2000 * 2 ** (2 if small else 10), 2000)
    return gather(
        {
            "short": partial(compare, short, "short", small),
            "long": partial(compare, long, "long", small),
        }
    )


def compare(task: Task, word: str, small: bool) -> Measured:
    """Find the cheapest setting of every method for every error, and time them in turn."""
    found = {
        (kind, wanted): point
        for kind in (*FIXED_STEP, *CLASSES)
        for wanted, point in cheapest(settings(kind, task, small), task.wanted)
    }
    times = interleave(
        {f"{kind} {wanted}": seconds(point.run) for (kind, wanted), point in found.items()},
        1 if small else 3,
    )
    rows: list[list[object]] = []
    for kind in (*FIXED_STEP, *CLASSES):
        cells: list[object] = []
        points = [found.get((kind, wanted)) for wanted in task.wanted]
        for wanted, point in zip(task.wanted, points, strict=True):
            time = times.get(f"{kind} {wanted}")
            cells += [point.steps, time * 1e6] if point and time else [None, None]
        growth = next((point.growth for point in reversed(points) if point), None)
        rows.append([kind, *cells, None if growth is None else round(growth, 1)])
    caption = (
        f"One pendulum, theta_0 = 1, to t = {task.end:g}: steps and microseconds of the cheapest setting that reaches "
        f"the largest error of theta at {task.samples} times; empty where none does. Schemes take {task.samples} "
        f"times a power of two steps, {task.most} at most, compiled, stepping alone. SciPy's `solve_ivp` (with "
        "`math.sin`) has tolerances two to a decade. The last column is the power of t with which the largest energy "
        "error grows over the last decade of time (0: bounded, 1: linear)."
    )
    if word == "long":
        caption = f"The same to t = {task.end:g}, at {task.samples} times and with {task.most} steps at most."
    header = ["method"]
    for wanted in task.wanted:
        header += [f"steps to {wanted:g}", "us"]
    lines = table(caption, [*header, "growth of the energy error"], rows)
    if word == "long":
        return lines, {}
    if not small:
        lines += [*picture(found, times, task), ""]
    finest = task.wanted[-1]
    return lines, {
        f"precision.{kind}": times.get(f"{kind} {finest}", math.nan) * 1e3 for kind in DRAWN
    }


def picture(found: dict[Any, Point], times: dict[str, float], task: Task) -> list[str]:
    """Draw time against error."""
    curves = {
        kind: [
            (found[kind, wanted].error, times[f"{kind} {wanted}"] * 1e6)
            for wanted in task.wanted
            if (kind, wanted) in found
        ]
        for kind in DRAWN
    }
    PICTURE.write_text(chart("Time of a trajectory against its error", "us", curves))
    return [f"![Time of a trajectory against its error](images/{PICTURE.name})"]


def cheapest(points: Iterator[Point], wanted: tuple[float, ...]) -> Iterator[tuple[float, Point]]:
    """Yield each error with the first of the points, from cheap to dear, that reaches it."""
    left = list(wanted)
    for point in points:
        while left and point.error <= left[0]:
            yield left.pop(0), point
        if not left:
            return


def settings(kind: str, task: Task, small: bool) -> Iterator[Point]:
    """Yield a method with every setting, from cheap to dear."""
    exact = task.exact()
    if kind in CLASSES:
        for tolerance in TOLERANCES:
            expected = adaptive.seconds(kind, tolerance, task.end / (2.0 * math.pi))
            if expected > (LONGEST / 20 if small else LONGEST):
                return
            go = partial(by_scipy, CLASSES[kind], task, tolerance)
            states, steps = go()
            yield point(go, states, steps, exact)
        return
    steps = task.samples
    while steps <= task.most:
        go = partial(by_engine, kind, task, steps)
        yield point(go, go(), steps, exact)
        steps *= 2


def point(go: Callable[[], Any], states: Floats, steps: int, exact: Floats) -> Point:
    """Measure the errors of a run."""
    theta, omega = states
    deviation = np.abs(0.5 * omega**2 + 2.0 * np.sin(0.5 * theta) ** 2 - 2.0 * math.sin(0.5) ** 2)
    early = np.max(deviation[: len(deviation) // 10 + 1])
    error = float(np.max(np.abs(theta - exact)))
    return Point(
        go,
        steps,
        error if math.isfinite(error) else math.inf,
        float(np.log10(np.max(deviation) / early)),
    )


def by_engine(kind: str, task: Task, steps: int) -> Floats:
    """Step one pendulum."""
    scheme = FIXED_STEP[kind]
    found = integrate(
        MODELS["pendulum"],
        scheme,
        scheme.defaults(),
        np.ones((1, len(MODELS["pendulum"].parameters))),
        np.array([[1.0, 0.0]]),
        np.array([task.end / steps]),
        steps,
        steps // task.samples,
        lane="scalar",
        with_gathered=False,
    )
    return np.array([found.position[0], found.velocity[0]])


def by_scipy(method: str, task: Task, tolerance: float) -> tuple[Floats, int]:
    """Solve as a user of SciPy does, and count the steps that were accepted."""
    from scipy.integrate import solve_ivp

    more = {"jac": lambda t, y: [[0.0, 1.0], [-math.cos(y[0]), 0.0]]} if method != "DOP853" else {}
    found = solve_ivp(
        lambda t, y: (y[1], -math.sin(y[0])),
        (0.0, task.end),
        (1.0, 0.0),
        method=method,
        rtol=max(tolerance, 2.3e-14),
        atol=tolerance,
        dense_output=True,
        **more,
    )
    return found.sol(task.times), len(found.t) - 1
