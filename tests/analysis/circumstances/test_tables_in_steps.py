"""Verdicts on a force from a table: the order of the scheme where steps end at its points, an open one elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vibsim import Experiment, Verdict, analyse, simulate, verdicts
from vibsim.apriori.formal_orders import left_to_the_mesh

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
    return list(verdicts(made, analyse(made, [simulate(made, level) for level in made.levels])))


def test_steps_that_end_at_the_points_have_the_order_of_the_scheme(folder: Path) -> None:
    names = ("u", "v", "energy", "absolute_position", "work_done")
    checks = [{"converges": name, "order": "scheme"} for name in names]
    made = experiment(100, ["central", "rk4"], checks)
    record = analyse(made, [simulate(made, level) for level in made.levels])
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
    left = left_to_the_mesh(made, {})
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
