"""One trajectory to the same error: other solvers against the ladder of levels, extrapolated."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from bench.ladder import LADDERS
from bench.page import Section, table
from bench.peers import Contestant, Found, Problem, compete, versions

TITLE = "One trajectory, same error"
ANSWER = (
    "At an error of 1e-10 the ladder is {0[single.increment_faster_than_dop853]:.0f} times faster than SciPy's DOP853, "
    "and takes {0[single.increment_over_heyoka]:.1f} times the time of heyoka."
)
END = 100.0
WANTED = 1e-10
TOLERANCES = tuple(10.0 ** (-k / 4) for k in range(28, 65))
"""Four to a decade, from 1e-7 to 1e-16."""

HEYOKA, DOP853 = "heyoka", "SciPy solve_ivp, DOP853"
INCREMENT, COMPENSATED = "ladder, increment", "ladder, compensated"

CONTESTANTS = (
    Contestant("solvers:dop853", DOP853, TOLERANCES),
    Contestant("solvers:lsoda", "SciPy solve_ivp, LSODA", TOLERANCES),
    Contestant("solvers:odeint", "SciPy odeint", TOLERANCES),
    Contestant("solvers:diffrax", "diffrax, Dopri8, compiled", TOLERANCES, is_peer=True),
    Contestant("solvers:numbalsoda", "numbalsoda, lsoda", TOLERANCES, is_peer=True),
    Contestant("solvers:heyoka", HEYOKA, TOLERANCES, is_peer=True),
    Contestant("ladder:increment", INCREMENT, LADDERS),
    Contestant("ladder:compensated", COMPENSATED, LADDERS),
    Contestant("ladder:increment_by_hand", "its levels and a plain tableau, increment", LADDERS),
    Contestant("ladder:compensated_by_hand", "the same, compensated", LADDERS),
)


def run(small: bool) -> Section:
    """Tune and time all of them."""
    with tempfile.TemporaryDirectory() as folder:
        problem = write_problem(Path(folder), np.array([1.0]))
        found = compete(CONTESTANTS, problem, 3 if small else 11, 0.01 if small else 0.05)
    caption = (
        f"One pendulum, theta_0 = 1, one core: theta at t = {END:g} within {WANTED:g} of the exact solution, with the "
        "loosest tolerance (four to a decade) or the ladder of fewest steps that reaches that on this problem. "
        f"Compiling is not counted. `vibsim.ladder.solve` bounds its error as well. Versions: {versions()}."
    )
    names = (DOP853, HEYOKA)
    lines = table(caption, header("ms", names), rows(found, 1e3, names))
    figures = {
        "single.increment_faster_than_dop853": ratio(found, DOP853, INCREMENT),
        "single.compensated_faster_than_dop853": ratio(found, DOP853, COMPENSATED),
        "single.increment_over_heyoka": ratio(found, INCREMENT, HEYOKA),
        "single.compensated_over_heyoka": ratio(found, COMPENSATED, HEYOKA),
    }
    return Section(tuple(lines), figures)


def write_problem(folder: Path, theta: Any, tuned_on: int = 0) -> Problem:
    """Write release angles and exact solution where the processes read them."""
    from vibsim.models import MODELS

    parameters = {"g": 1.0, "L": 1.0, "m": 1.0}
    initial = {"theta": theta[:, None], "omega": np.zeros((len(theta), 1))}
    model = MODELS["pendulum"]
    if model.exact is None:
        raise RuntimeError("the pendulum has lost its exact solution")
    exact = model.exact(np.full((len(theta), 1), END), initial, parameters)
    file = folder / "problem.npz"
    np.savez(file, theta=theta, exact=np.asarray(exact["theta"])[:, 0])
    return Problem(str(file), END, WANTED, tuned_on)


def header(unit: str, names: tuple[str, ...]) -> list[str]:
    """Return the columns of `rows`."""
    return [
        "method",
        "tolerance or ladder",
        "error",
        unit,
        *(f"time over {name}" for name in names),
    ]


def rows(found: dict[str, Found | str], scale: float, names: tuple[str, ...]) -> list[list[Any]]:
    """Return a row for each contestant, with its time over that of others."""
    table_: list[list[Any]] = []
    for name, one in found.items():
        if isinstance(one, str):
            table_.append([name, one, *[None] * (2 + len(names))])
            continue
        setting = f"{one.setting:.1e}" if isinstance(one.setting, float) else one.setting
        ratios = [ratio(found, name, other) for other in names]
        cells = [None if math.isnan(value) else value for value in ratios]
        short = "" if one.error <= WANTED else " (the least; not reached)"
        table_.append([name, setting, f"{one.error:.1e}{short}", one.seconds * scale, *cells])
    return table_


def ratio(found: dict[str, Found | str], top: str, bottom: str) -> float:
    """Return the time of one over that of another; NaN where one of them was not measured."""
    a, b = found[top], found[bottom]
    if isinstance(a, str) or isinstance(b, str):
        return math.nan
    return a.seconds / b.seconds
