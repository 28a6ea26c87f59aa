"""Data of programs that are wrong, judged by the experiment that they should have been made by."""

from __future__ import annotations

from typing import Any

import pytest
from thinned import thinned

from vibsim import Experiment, Verdict, analyse, simulate, verdicts


def spring(w: float, levels: tuple[int, ...]) -> dict[str, Any]:
    return {
        "title": "test",
        "model": {"kind": "spring", "w": w},
        "initial": {"u": 1.0},
        "time": {"end": 10.0},
        "levels": list(levels),
        "schemes": ["central"],
        "samples": "all",
        "checks": [{"converges": "u", "order": 2}],
    }


def ball(g: float, levels: tuple[int, ...]) -> dict[str, Any]:
    return {
        "title": "test",
        "model": {"kind": "bouncing_ball", "g": g, "restitution": 0.638},
        "initial": {"h": 1.918},
        "time": {"end": 2.0, "base_steps": 3},
        "levels": list(levels),
        "schemes": [{"kind": "backward_euler", "events": "mesh"}],
        "samples": "all",
        "checks": [{"converges": "h"}],
    }


def judged(meant: dict[str, Any], made: dict[str, Any]) -> Verdict:
    """Judge by one experiment the states that another one computes."""
    right, wrong = Experiment.from_dict(meant), Experiment.from_dict(made)
    levels = []
    names = [state.name for state in right.model.definition.states]
    for level in right.levels:
        data, faulty = simulate(right, level).copy(deep=True), simulate(wrong, level)
        for name in names:
            data[name] = (data[name].dims, faulty[name].values, data[name].attrs)
        levels.append(data)
    (found,) = verdicts(right, analyse(right, levels))
    return found


@pytest.mark.parametrize("levels", [(6, 7, 8), (6, 7, 8, 9), (6, 7, 8, 9, 10, 11)])
@pytest.mark.parametrize("w", thinned([1.701, 1.71, 1.8], 3))
def test_a_wrong_frequency_is_a_wrong_limit(w: float, levels: tuple[int, ...]) -> None:
    """The error that stays is 0.01 and more; at the finest level that of the scheme is 5e-5 to 3e-3."""
    found = judged(spring(1.7, levels), spring(w, levels))
    assert found.reason == "wrong_limit"


def test_an_error_that_stays_is_seen_in_three_levels() -> None:
    """What stays is a third of the error at the finest level: a tenth would spoil an order."""
    found = judged(spring(1.7, (6, 7, 8)), spring(1.7001, (6, 7, 8)))
    assert found.status == "INCONCLUSIVE"


def test_an_event_on_the_mesh_is_no_wrong_limit() -> None:
    """Nothing is wrong: two levels of three lie near each other as the ground lies between their points."""
    right = ball(1.713, (4, 5, 6))
    assert judged(right, right).reason == "non_smooth"
    wrong = judged(ball(1.713, (4, 5, 6, 7, 8)), ball(1.9, (4, 5, 6, 7, 8)))
    assert wrong.status != "PASS"


def test_a_ball_at_rest_at_every_common_time_is_no_wrong_limit() -> None:
    """Long implicit steps damp the ball until it lies: finer ones, on which it bounces, are what is missing."""
    data = {
        "title": "test",
        "model": {"kind": "bouncing_ball", "g": 1.439, "restitution": 0.69, "eps_v": 0.05},
        "initial": {"h": 0.812},
        "time": {"end": 40.0, "base_steps": 2},
        "levels": [3, 4, 5, 6],
        "schemes": ["backward_euler"],
        "checks": [{"converges": "h"}],
    }
    found = judged(data, data)
    assert (found.status, found.reason) == ("INCONCLUSIVE", "pre_asymptotic")
    assert "level" in found.advice


def test_what_no_level_can_tell_is_said() -> None:
    """Nothing is known of friction with a spring of its own: 1 % more of it is another motion, and looks as good."""
    data = {
        "title": "test",
        "model": {"kind": "sliding_box", "alpha": 0.5, "mu": 0.1},
        "initial": {"u": 2.0},
        "time": {"end": 10.0},
        "levels": [7, 8, 9, 10],
        "schemes": ["rk2"],
        "samples": "all",
        "checks": [{"converges": "u"}],
    }
    found = judged(data, {**data, "model": {"kind": "sliding_box", "alpha": 0.5, "mu": 0.101}})
    assert found.status == "PASS"
    assert "convergence to a wrong answer would go unnoticed" in found.text
    assert "noticed" not in judged(spring(1.7, (6, 7, 8, 9)), spring(1.7, (6, 7, 8, 9))).text


def test_noise_of_storing_in_single_precision_is_round_off() -> None:
    """And not a step that is too coarse, which finer levels would mend."""
    content = {
        "title": "t",
        "model": {"kind": "pendulum"},
        "initial": {"theta": 1.0},
        "time": {"end": 5.0},
        "levels": [5, 6, 7, 8],
        "schemes": ["rk4"],
        "checks": [{"converges": "theta"}],
    }
    made = Experiment.from_dict(content)
    levels = [simulate(made, level) for level in made.levels]
    assert verdicts(made, analyse(made, levels))[0].status == "PASS"
    single = [data.assign(theta=data.theta.astype("float32")) for data in levels]
    (verdict,) = verdicts(made, analyse(made, single))
    assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "round_off")
    assert "single precision" in verdict.text
    assert verdict.advice.startswith("Store the states in double precision")
