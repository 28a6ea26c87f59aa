"""Verdicts on a force from a table: the order of the scheme where steps end at its points, an open one elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from whole import analysed, simulated

from vibsim import Experiment, Verdict, simulate, verdicts
from vibsim.analysis import analyse_records
from vibsim.apriori.formal_orders import left_to_the_mesh
from vibsim.apriori.table_corners import table_corners
from vibsim.models.table import Table
from vibsim.models.vehicle import written

pytestmark = pytest.mark.usefixtures("without_series")

MODEL = {"kind": "vehicle", "m": 60, "b": 80, "speed": 5, "spring": "600*u"}
LEVELS = [0, 1, 2, 3, 4]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    h = np.random.default_rng(5).normal(scale=0.01, size=101)
    rows = [f"{i / 10:g},{height:.6f}" for i, height in enumerate(h)]
    (tmp_path / "road.csv").write_text("\n".join(["x,h", *rows]) + "\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def experiment(steps: int, schemes: list[Any], checks: list[Any], **changes: Any) -> Experiment:
    return Experiment.from_dict(
        {
            "title": "t",
            "model": {**MODEL, "road": {"table": "road.csv"}},
            "initial": {"u": 0.01},
            "time": {"end": 2.0, "base_steps": steps},
            "levels": LEVELS,
            "schemes": schemes,
            "checks": checks,
            "samples": "common",
            **changes,
        }
    )


def judged(made: Experiment) -> list[Verdict]:
    return list(verdicts(made, analyse_records(made, simulated(made))))


def test_steps_that_end_at_the_points_have_the_order_of_the_scheme(folder: Path) -> None:
    names = ("u", "v", "energy", "absolute_position", "work_done")
    checks = [{"converges": name, "order": "scheme"} for name in names]
    made = experiment(100, ["central", "rk4"], checks)
    record = analysed(made)
    found = [(v.status, v.reason) for v in verdicts(made, record)]
    assert found == [("PASS", "asymptotic")] * len(names)
    formal = {name: record[f"{name}_formal_order"].values.tolist() for name in names}
    assert formal["u"] == [2.0, 4.0]
    assert formal["work_done"] == [2.0, 2.0]


def test_even_powers_are_kept_between_the_corners(folder: Path) -> None:
    """Extrapolation over even powers of dt gains two orders at each level, as without a table."""
    made = experiment(100, ["central"], [], levels=[0, 1, 2, 3])
    fine = experiment(100, ["gauss4"], [], levels=[0, 6])
    exact = simulate(fine, 6)["u"].values[0, 0, -1]
    u = [simulate(made, level)["u"].values[0, 0, -1] for level in made.levels]
    rows = [u]
    for k in (1, 2):
        rows.append(
            [b + (b - a) / (4**k - 1) for a, b in zip(rows[-1], rows[-1][1:], strict=False)]
        )
    first, second = (np.abs(np.array(row) - exact) for row in rows[:2])
    assert np.log2(first[:-1] / first[1:]) == pytest.approx(2.0, abs=0.05)
    assert np.log2(second[:-1] / second[1:]) == pytest.approx(4.0, abs=0.2)
    assert abs(rows[2][-1] - exact) < 0.02 * second[-1]


def test_corners_within_steps_are_told(folder: Path) -> None:
    checks: list[Any] = [
        {"converges": "u", "order": "scheme", "schemes": ["central"]},
        {"converges": "u", "order": 4, "schemes": ["rk4"]},
        {"converges": "u", "order": "scheme", "schemes": ["rk4"]},
    ]
    made = experiment(70, ["central", "rk4", "backward_euler"], checks)
    central, claimed, rk4 = judged(made)
    assert (central.status, central.reason) == ("INCONCLUSIVE", "non_smooth")
    assert "corners within steps" in central.text
    assert "end at every point of the table" in central.advice
    assert claimed.status != "PASS"
    assert rk4.reason in ("asymptotic", "non_smooth", "pre_asymptotic")
    # an error of first order is the scheme's own
    left = left_to_the_mesh(made, {}, np.array([True]))
    assert left.tolist()[:2] == [[2.0], [2.0]]
    assert np.isnan(left[2])


@pytest.mark.slow
def test_an_adaptive_scheme_finds_the_same_motion(folder: Path) -> None:
    made = experiment(100, ["rk4", {"kind": "dop853", "tolerance": 1e-10}], [], levels=[0, 5])
    u = simulate(made, 5)["u"].values[:, 0]
    assert np.abs(u[1] - u[0]).max() < 1e-6 * np.abs(u[0]).max()


@pytest.mark.slow
@pytest.mark.usefixtures("with_series")
def test_the_road_is_an_output(folder: Path) -> None:
    made = experiment(100, ["central"], [], levels=[0, 3])
    heights = np.loadtxt("road.csv", delimiter=",", skiprows=1)[:, 1]
    for level in made.levels:
        found = simulate(made, level)
        # samples are the times of the coarsest level, where the wheel is at the points
        assert found["road_height"].values[0, 0] == pytest.approx(heights, abs=1e-15)
        absolute = found["u"] + found["road_height"]
        assert found["absolute_position"].values == pytest.approx(absolute.values, abs=1e-16)


LOADED = {"kind": "structure", "stiffness": [4], "damping": [0.1]}


def loaded(points: list[tuple[float, float]], folder: Path, **changes: Any) -> Experiment:
    """Return a mass on a spring, at rest, under a load with these points."""
    rows = [f"{t},{p}" for t, p in points]
    (folder / "load.csv").write_text("\n".join(["t,p", *rows]) + "\n")
    checks = [{"converges": name, "order": "scheme"} for name in ("u1", "vu1")]
    model = {**LOADED, "load": {1: {"table": "load.csv"}}}
    given = {"model": model, "initial": {}, "levels": [0, 1, 2, 3], **changes}
    return experiment(32, ["newmark", "central"], checks, **{"time": time(32), **given})


def time(steps: int) -> dict[str, Any]:
    return {"end": 10, "base_steps": steps}


def end_of(points: list[tuple[float, float]]) -> np.ndarray[Any, Any]:
    """Return the state at t = 10, exact on every piece of the load."""
    t, p = np.transpose(points)
    a, w = 0.05, np.sqrt(4.0 - 0.05**2)
    state = np.zeros(2)
    for k, (begin, end) in enumerate(zip(t[:-1], np.minimum(t[1:], 10.0), strict=True)):
        if begin >= end:
            break
        s = (p[k + 1] - p[k]) / (t[k + 1] - t[k])
        # u = (p - c u')/k moves along the load
        along, h = np.array([(p[k] - 0.1 * s / 4.0) / 4.0, s / 4.0]), end - begin
        free = state - along
        c = np.array([free[0], (free[1] + a * free[0]) / w])
        turned = c[0] * np.cos(w * h) + c[1] * np.sin(w * h)
        turning = w * (c[1] * np.cos(w * h) - c[0] * np.sin(w * h))
        u, v = np.exp(-a * h) * np.array([turned, turning - a * turned])
        state = np.array([u + along[0] + along[1] * h, v + along[1]])
    return state


RAMP = [(0.0, 0.0), (2.61, 3.0), (11.0, 0.0)]
ZIGZAG = [(0.0, 0.0), *((t, (-1.0) ** i * t) for i, t in enumerate((0.93, 2.2, 2.9, 4.1, 7.7)))]


@pytest.mark.usefixtures("with_series")
@pytest.mark.parametrize("points", [RAMP, [*ZIGZAG, (11.0, 0.0)]])
def test_points_of_a_load_within_steps_are_told_and_bounded(folder: Path, points: Any) -> None:
    made = loaded(points, folder)
    record = analysed(made)
    found = list(verdicts(made, record))
    assert {(v.status, v.reason) for v in found} == {("INCONCLUSIVE", "non_smooth")}
    assert f"At t = {points[1][0]:.4g} it is not" in found[0].advice
    for name, exact in zip(("u1", "vu1"), end_of(points), strict=True):
        off = np.abs(record[f"{name}_end_richardson"].values[:, 0] - exact)
        bound = record[f"{name}_end_richardson_error"].values[:, 0]
        assert (off <= bound).all(), (name, off, bound)
        assert (bound < 0.25).all(), bound


def test_no_point_of_a_load_is_within_a_step_that_ends_there(folder: Path) -> None:
    made = loaded([(0.0, 0.0), (2.5, 3.0), (11.0, 0.0)], folder)
    record = analysed(made)
    assert np.isnan(record["table_corner_time"].values).all()
    found = [(v.status, v.reason) for v in verdicts(made, record)]
    assert found == [("PASS", "asymptotic")] * 2


STRAIGHT = [(0.0, 0.0), (0.7, 0.07), (1.1, 0.11), (2.5, 0.25), (11.0, 9.0)]


@pytest.mark.parametrize("points", [STRAIGHT, [(0.0, 0.0), (11.0, 1.0)]])
def test_a_point_on_a_straight_line_is_no_corner(folder: Path, points: Any) -> None:
    made = loaded(points, folder)
    record = analysed(made)
    assert np.isnan(record["table_corner_time"].values).all()


def test_members_have_corners_of_their_own(folder: Path) -> None:
    """With 32 steps to t = 8 the point at 2.5 is a grid point, with as many to t = 9 it is none."""
    points = [(0.0, 0.0), (2.5, 3.0), (11.0, 0.0)]
    made = loaded(points, folder, sweep={"time.end": [8.0, 9.0]})
    record = analysed(made)
    times = record["table_corner_time"].values
    assert np.isnan(times[0])
    assert times[1] == 2.5


def test_a_pulse_of_a_load_between_the_points_of_every_level_is_told(folder: Path) -> None:
    points = [(0.0, 0.0), (3.001, 0.0), (3.002, 1000.0), (3.003, 0.0), (11.0, 0.0)]
    made = loaded(points, folder, initial={"u1": 1.0})
    for verdict in judged(made):
        assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "non_smooth")
        assert "a pulse about 0.001 long near t = 3.002" in verdict.text


def test_what_a_table_holds_behind_the_end_does_not_count() -> None:
    """The error at corners is relative to the force of the run; a large bump later made it 1000 times too small."""
    h = np.array([0.0, 0.0, 1.0, -1.0, 2.0, 0.0, 0.0, 0.0, 0.0])
    later = np.concatenate([h, [0.0, 3000.0, 0.0, 0.0]])
    columns = {"m": np.array([1.0]), "b": np.array([0.0]), "speed": np.array([1.0])}
    end, dt = np.array([5.0]), np.array([0.9])
    found = [
        table_corners(written({}, (), Table(0.0, 1.0, heights)), columns, end, dt)
        for heights in (h, later)
    ]
    np.testing.assert_array_equal(*found)
    assert np.isfinite(found[0]).all()
