"""The road of the catalogue: its heights are those of its formula, and the motion that its file claims is SciPy's."""

from __future__ import annotations

from contextlib import chdir
from math import pi, sin
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.linalg import expm

from vibsim import analyse, simulate, verdicts
from vibsim.experiment import Experiment

FOLDER = Path(__file__).parents[1] / "configs" / "vibration_text"
ROAD = FOLDER / "bumpy_road.csv"


def height(x: float) -> float:
    swell = 0.03 * sin(2 * pi * x / 40)
    washboard = 0.012 * sin(2 * pi * x / 1.6) if 20 <= x <= 36 else 0.0
    bump = 0.08 * sin(pi * (x - 50) / 2) ** 2 if 50 <= x <= 52 else 0.0
    return swell + washboard + bump


def test_the_heights_are_those_of_the_formula() -> None:
    x, h = np.loadtxt(ROAD, delimiter=",", skiprows=3).T
    assert x.tolist() == [i / 10 for i in range(801)]
    assert np.abs(h - [height(place) for place in x]).max() < 0.51e-4


def by_another_solver(speed: float) -> float:
    """Return the position at the end of the road, by SciPy's matrix exponential from corner to corner of the force."""
    _, h = np.loadtxt(ROAD, delimiter=",", skiprows=3).T
    q = np.empty(801)
    q[1:-1] = (h[:-2] - 2 * h[1:-1] + h[2:]) / 0.1**2
    q[0], q[-1] = q[1], q[-2]
    rates = np.diff(q) * 10 * speed
    # of position, velocity, bend of the road, and its rate, which is constant from corner to corner
    matrix = [[0, 1, 0, 0], [-600 / 60, -80 / 60, -(speed**2), 0], [0, 0, 0, 1], [0, 0, 0, 0]]
    step = expm(np.array(matrix) / (10 * speed))
    y = np.zeros(2)
    for bend, rate in zip(q[:-1], rates, strict=True):
        y = (step @ [*y, bend, rate])[:2]
    return float(y[0])


def test_the_claimed_end_is_that_of_another_solver() -> None:
    end = by_another_solver(8.0)
    (claim,) = (
        c
        for c in Experiment.from_yaml(FOLDER / "bumpy_road.yaml").checks
        if c.id == "by_another_solver"
    )
    assert abs(claim.measured.equals - end) < 1e-9 * abs(end)


@pytest.mark.slow
def test_steps_from_point_to_point_keep_their_order_at_every_speed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # the other solver is what they are compared with
    monkeypatch.setattr("vibsim.experiment.storage.MOST_REFERENCES", 0)
    given = yaml.safe_load((FOLDER / "bumpy_road.yaml").read_text())
    speeds = [3.7, 13.3]
    content = {
        "title": "Two speeds",
        "model": given["model"],
        "time": {"steps_per_point": 1},
        "levels": [0, 1, 2, 3],
        "schemes": ["rk4"],
        "sweep": {"model.speed": speeds},
    }
    with chdir(FOLDER):
        experiment = Experiment.from_dict(content)
    levels = [simulate(experiment, level) for level in experiment.levels]
    for found in verdicts(experiment, analyse(experiment, levels)):
        assert (found.status, found.reason) == ("PASS", "asymptotic")
        assert all(abs(row.facts["order"] - 4) < 0.1 for row in found.results)
    for case, speed in enumerate(speeds):
        ends = [float(level.u[0, case, -1]) for level in levels]
        errors = [abs(end - by_another_solver(speed)) for end in ends[:2]]
        assert errors[1] < errors[0] / 12 < 1e-7
