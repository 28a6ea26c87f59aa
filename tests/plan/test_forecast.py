"""What a plan says of references, analysis and page, and of the time on several cores."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from vibsim.cli import main
from vibsim.core.home import home
from vibsim.experiment import Experiment, cost
from vibsim.plan import build, forecast

CONFIGS = home() / "configs"


def planned(name: str) -> Any:
    return build.build(Experiment.from_yaml(CONFIGS / f"{name}.yaml"))


@pytest.mark.parametrize(
    ("name", "is_computed"),
    [
        ("pendulum_lab/theta_convergence", False),  # an exact solution is known
        ("showcase/van_der_pol", True),
        ("showcase/two_beads", False),  # events
        ("showcase/duffing_branches", False),  # members follow each other
        ("showcase/cantilever", False),  # modes
        ("pendulum_lab/period_map", False),
    ],
)
def test_a_reference_is_planned_where_one_is_computed(name: str, is_computed: bool) -> None:
    assert (planned(name).reference_seconds > 0.0) == is_computed


def test_each_level_of_a_structure_counts_in_its_job(tmp_path: Path) -> None:
    """Schemes that choose their own steps run once for all levels; a structure is stepped at each."""
    file = tmp_path / "frame.yaml"
    file.write_text(
        "title: Frame\nmodel: {kind: structure, stiffness: [1, 2]}\ntime: {end: 10, base_steps: 500}\n"
        "levels: [0, 1, 2]\nschemes: [newmark]\nsweep: {model.rayleigh.alpha: {linspace: [0, 1, 20]}}\n"
    )
    plan = build.build(Experiment.from_yaml(file))
    jobs = sum(batch.seconds - cost.JOB_SECONDS for batch in plan.batches)
    assert jobs == pytest.approx(sum(level.seconds for level in plan.levels), rel=0.01)


def test_every_scheme_takes_time_beside_its_steps(tmp_path: Path) -> None:
    """In the analysis and on the page, however few its members and steps are."""
    seconds = []
    for schemes in ("rk4", "rk4, heun, central, ab2, bdf2"):
        file = tmp_path / "many.yaml"
        file.write_text(
            f"title: Many\nmodel: {{kind: spring}}\ninitial: {{u: 1}}\nschemes: [{schemes}]\n"
            "time: {end: 10, base_steps: 10}\nlevels: [0]\n"
        )
        own = Experiment.from_yaml(file)
        seconds.append(build.build(own).other_seconds)
    assert 4 * forecast.SCHEME_SECONDS <= seconds[1] - seconds[0] < 6 * forecast.SCHEME_SECONDS


def test_checking_and_planning_compute_no_reference(
    monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    """A long one is told, with the reason."""
    from vibsim.simulation.reference import solve

    def refuse(*_: Any) -> None:
        raise AssertionError("a reference was computed")

    monkeypatch.setattr(solve, "computed", refuse)
    for command in ("check", "plan"):
        assert main([command, str(CONFIGS / "vibration_text" / "bumpy_road.yaml")]) == 0
        told = capsys.readouterr()
        assert "a reference solution of vehicle is computed once, which takes about" in told.err
        assert "its exact solution is not known" in told.err


def test_the_times_of_a_plan_hang_together(capsys: Any) -> None:
    assert main(["plan", "showcase/quarter_car", "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    total = found["total"]
    assert total["cpu_seconds"] == pytest.approx(
        forecast.RUN_SECONDS
        + total["seconds"]
        + found["reference_seconds"]
        + found["other_seconds"]
    )
    assert total["wall_seconds"]["1"] == pytest.approx(total["cpu_seconds"])
    plan = planned("pendulum_lab/theta_convergence")
    several = [plan.wall_seconds(cores) for cores in (1, 2, 64)]
    assert several == sorted(several, reverse=True)
    assert several[-1] >= plan.other_seconds
    assert main(["plan", "showcase/quarter_car"]) == 0
    told = capsys.readouterr().out
    assert "reference: about" in told
    assert "of CPU time" in told


def test_loads_of_a_structure_are_searched_for_pulses_like_other_forces() -> None:
    def gaps(load: str) -> int:
        made = Experiment.from_dict(
            {
                "title": "t",
                "model": {"kind": "structure", "stiffness": [1, 2], "load": {"2": load}},
                "time": {"end": 10.0, "base_steps": 50},
                "levels": [0, 1],
                "schemes": ["newmark"],
            }
        )
        return forecast.gaps(made, [cost.level_cost(made, level) for level in made.levels])

    assert (gaps("1"), gaps("cos(t)")) == (0, 100)
