"""A system that looks a table up: against a solution from point to point, and what is refused."""

import json
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vibsim import Experiment, InputError, analyse, simulate, verdicts
from vibsim.report.text import experiment_file

SPACING, POINTS = 0.25, 25
HEIGHTS = [0.02 * math.sin(3.1 * SPACING * i) for i in range(POINTS)]
MODEL = {
    "kind": "system",
    "coordinates": ["body", "wheel"],
    "force": {
        "body": "-k*(body - wheel) - c*(vbody - vwheel) - 1e4*(body - wheel)**3",
        "wheel": "k*(body - wheel) + c*(vbody - vwheel) + 1e4*(body - wheel)**3 - kt*(wheel - input)",
    },
    "mass": {"body": 4.0},
    "input": {"table": "road.csv", "at": "speed*t"},
    "outputs": {"road": "input"},
    "parameters": {"k": 50.0, "kt": 300.0, "c": 2.0, "speed": 2.0},
}


@pytest.fixture
def folder(tmp_path):
    rows = (f"{SPACING * i},{height!r}\n" for i, height in enumerate(HEIGHTS))
    (tmp_path / "road.csv").write_text("x,h\n" + "".join(rows))
    return tmp_path


def read(folder, changes=None, **more):
    content = {
        "title": "A quarter car on a measured road",
        "model": {**MODEL, **(changes or {})},
        "initial": {},
        "time": {"steps_per_point": 4},
        "levels": [0, 1, 2, 3],
        "schemes": ["rk4"],
    }
    file = folder / "car.yaml"
    # JSON is YAML
    file.write_text(json.dumps(content | more), encoding="utf-8")
    return Experiment.from_yaml(file)


def piece(i):
    """Return the equations between two points of the table, written out by hand."""
    bends = np.diff(HEIGHTS, 2) / SPACING**2
    bends = np.concatenate([bends[:1], bends, bends[-1:]])

    def slope(t, y):
        body, wheel, vbody, vwheel = y
        w = 2.0 * t / SPACING - i
        line = (1 - w) * HEIGHTS[i] + w * HEIGHTS[i + 1]
        bow = w * (1 - w) * ((2 - w) * bends[i] + (1 + w) * bends[i + 1])
        road = line - SPACING**2 / 6 * bow
        pull = 50 * (body - wheel) + 2 * (vbody - vwheel) + 1e4 * (body - wheel) ** 3
        return vbody, vwheel, -pull / 4, pull - 300 * (wheel - road)

    return slope


@pytest.mark.slow
def test_a_system_follows_its_table_from_point_to_point(folder):
    experiment = read(folder)
    levels = [simulate(experiment, level) for level in experiment.levels]
    judged = verdicts(experiment, analyse(experiment, levels))
    assert [(v.status, v.reason) for v in judged] == [("PASS", "asymptotic")] * 2
    state = np.zeros(4)
    for i in range(POINTS - 1):
        span = SPACING / 2 * i, SPACING / 2 * (i + 1)
        found = solve_ivp(piece(i), span, state, method="DOP853", rtol=1e-12, atol=1e-14)
        state = found.y[:, -1]
    finest = levels[-1]
    for name, known in zip(("body", "wheel"), state[:2], strict=True):
        assert float(finest[name][0, 0, -1]) == pytest.approx(known, abs=1e-8)
        assert float(finest[f"{name}_exact"][0, -1]) == pytest.approx(known, abs=1e-11)
    assert finest["road"][0, 0, :: 4 * 8].values == pytest.approx(HEIGHTS, abs=1e-15)


def test_a_spring_that_hardens_between_body_and_table_is_judged(folder):
    """Stiffness and damping along the motion depend on the table then."""
    pull = "-50*(u - input) - 4000*(u - input)**3 - (1 + 100*input**2)*v"
    one = {"coordinates": ["u"], "force": pull, "mass": 2, "outputs": {"reading": "u - input"}}
    experiment = read(folder, {**one, "parameters": {"speed": 2.0}})
    levels = [simulate(experiment, level) for level in experiment.levels]
    assert {v.status for v in verdicts(experiment, analyse(experiment, levels))} == {"PASS"}


def test_the_work_of_a_table_is_in_the_budget(folder):
    level = simulate(read(folder, schemes=["gauss4"]), 3)
    energy, budget = (np.abs(level[name][0, 0].values) for name in ("energy", "energy_budget"))
    assert np.max(budget) < 1e-4 * np.max(energy)
    assert np.max(np.abs(level["work_done"].values)) > 0.1 * np.max(energy)


def test_a_table_is_written_back(folder):
    experiment = read(folder)
    path = folder / "again.yaml"
    path.write_text(experiment_file.text(experiment), encoding="utf-8")
    assert Experiment.from_yaml(path).model == experiment.model


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        (
            {"input": {"table": "road.csv", "at": "t**2"}},
            "model.input.at: t**2: must be a number times t",
        ),
        (
            {"input": {"table": "road.csv", "at": "t + 1"}},
            "model.input.at: t + 1: must be a number times t",
        ),
        (
            {"input": {"table": "street.csv"}},
            "model.input.table: street.csv: there is no such file",
        ),
        ({"potential": "input"}, "model.potential: input: unknown name 'input'"),
        ({"events": [{"when": "body"}]}, "must not be given together with events or a stop"),
        (
            {"exact": {"body": "t", "wheel": "t"}},
            "must not be given together with an exact solution",
        ),
        (
            {"parameters": {**MODEL["parameters"], "input": 1}},
            "model.input: a table is looked up under that name",
        ),
        ({"input": None}, "unknown name 'input'"),
    ],
)
def test_what_a_table_cannot_be_is_refused(folder, changes, told):
    with pytest.raises(InputError) as caught:
        read(folder, changes)
    assert told in str(caught.value)


def test_a_table_that_is_too_short_is_refused(folder):
    with pytest.raises(InputError, match="the table ends at 6, but the motion comes to 8"):
        read(folder, time={"end": 4.0, "base_steps": 16})
