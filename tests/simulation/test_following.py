"""Members that start from the last state of the member before: `follow` in a sweep."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.core.errors import InputError
from vibsim.experiment import canonical, restore
from vibsim.experiment.cost import LevelCost, level_cost
from vibsim.plan import build
from vibsim.report.text import experiment_file
from vibsim.simulation import simulate_record

UP_AND_DOWN = [0.8, 1.2, 1.6, 1.2]
SCHEMES = ["central", "rk4", {"kind": "dop853", "tolerance": 1e-8}]
DUFFING: dict[str, Any] = {
    "title": "A response curve",
    "model": {"kind": "duffing", "delta": 0.1, "beta": 0.04, "gamma": 1.0, "omega": 1.0},
    "initial": {"u": 0.5},
    "time": {"periods": 4, "steps_per_period": 16, "frequency": "model.omega"},
    "levels": [1, 2, 3],
    "schemes": SCHEMES,
    "sweep": {"model.gamma": [1.0, 0.5], "model.omega": UP_AND_DOWN, "follow": "model.omega"},
}


def changed(**sections: Any) -> Experiment:
    return Experiment.from_dict({**DUFFING, **sections})


def alone(settings: dict[str, Any], case: int, u: float, v: float) -> Experiment:
    """Return one member as a file of its own that starts from some state."""
    gamma, omega = np.repeat([1.0, 0.5], 4)[case], np.tile(UP_AND_DOWN, 2)[case]
    model = {**DUFFING["model"], "gamma": float(gamma), "omega": float(omega)}
    rest = {key: value for key, value in DUFFING.items() if key != "sweep"}
    return Experiment.from_dict({**rest, **settings, "model": model, "initial": {"u": u, "v": v}})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("steps_per_period", "every"),
    [
        pytest.param(16, 1, id="plain"),
        pytest.param(4096, 1024, id="compiled", marks=pytest.mark.slow),
    ],
)
def test_each_member_goes_on_where_the_one_before_ended(steps_per_period: int, every: int) -> None:
    """To the bit, for every scheme from its own last state; a chain begins as the file says."""
    time = {**DUFFING["time"], "steps_per_period": steps_per_period}
    settings = {"time": time, "samples": {"every": every}}
    found = simulate(changed(**settings), 2)
    for s in range(len(SCHEMES)):
        u, v = (found[name].values[s] for name in ("u", "v"))
        for case in range(8):
            start = (u[case - 1, -1], v[case - 1, -1]) if case % 4 else (0.5, 0.0)
            assert (u[case, 0], v[case, 0]) == start
        for case in (0, 2, 5):
            own = simulate(alone(settings, case, u[case, 0], v[case, 0]), 2)
            np.testing.assert_array_equal(own["u"].values[s, 0], u[case])
            np.testing.assert_array_equal(own["v"].values[s, 0], v[case])


def test_every_level_follows_its_own_states() -> None:
    """Then levels differ at the start of a member by what they differed by at the end of the one before."""
    experiment = changed(schemes=["central"])
    rows = [simulate(experiment, level)["u"].values[0] for level in (1, 2)]
    np.testing.assert_array_equal(rows[0][1::4, 0], rows[0][0::4, -1])
    assert np.all(rows[0][1::4, 0] != rows[1][1::4, 0])


def test_a_chain_is_made_as_a_whole() -> None:
    """The files of a level hold whole chains, however many there are, and a part is what it is in the whole."""
    experiment = changed(schemes=["rk4"])
    whole, part = simulate_record(experiment, 1), simulate_record(experiment, 1, 4, 8)
    np.testing.assert_array_equal(part["u"], whole["u"][:, 4:])
    for chain in (1, 3, 25, 1000):
        for steps in (100, 10**5, 10**9):
            load = LevelCost(schemes=1, steps=steps, samples=100, series=7, work=1.0, chain=chain)
            assert load.shard % chain == 0
            assert load.shard & (load.shard - 1) == 0 or chain > 1
    more = {**DUFFING["sweep"], "model.gamma": [1.0 / n for n in range(1, 50)]}
    assert (
        level_cost(experiment, 1).shard == level_cost(changed(schemes=["rk4"], sweep=more), 1).shard
    )
    assert all(
        s.start % 4 == 0 for level in build.build(changed(sweep=more)).levels for s in level.shards
    )


def test_a_member_that_breaks_down_stops_its_chain_alone() -> None:
    sweep = {"model.beta": [0.04, -1.0], "model.omega": UP_AND_DOWN, "follow": "model.omega"}
    found = simulate(changed(schemes=["rk4"], sweep=sweep, initial={"u": 2.0}), 2)
    assert not found["status"].values[0, :4].any()
    assert found["status"].values[0, 4:].all()
    assert np.all(found["last_step"].values[0, 5:] < 0) or np.all(
        np.isnan(found["u"].values[0, 5:])
    )


@pytest.mark.slow
def test_levels_are_compared_and_no_exact_solution_is_pretended() -> None:
    linear = {"kind": "duffing", "delta": 0.1, "beta": 0.0, "gamma": 1.0}
    time = {"periods": 4, "steps_per_period": 32, "frequency": "model.omega"}
    sweep = {"model.omega": [0.8, 0.9], "follow": "model.omega"}
    for model in (
        linear,
        {
            "kind": "oscillator",
            "damping": {"linear": 0.2},
            "spring": "k*u",
            "force": "cos(omega*t)",
            "parameters": {"k": 1.0, "omega": 0.8},
        },
    ):
        own = (
            dict(sweep)
            if model is linear
            else {"model.parameters.omega": [0.8, 0.9], "follow": "model.parameters.omega"}
        )
        key = next(iter(own))
        experiment = changed(
            model=model,
            sweep=own,
            schemes=["rk4"],
            time={**time, "frequency": key},
            levels=[1, 2, 3, 4],
        )
        levels = {level: simulate(experiment, level) for level in experiment.levels}
        for data in levels.values():
            assert "u_exact" not in data or np.all(np.isnan(data["u_exact"].values[1]))
        (verdict,) = verdicts(experiment, analyse(experiment, levels))
        assert verdict.status == "PASS", verdict


def test_numbers_along_a_curve_turn_where_the_curve_does() -> None:
    number = {"value": "steady_amplitude", "quantity": "u"}
    checks = [
        {**number, "over": "model.omega", "take": "monotone", "equals": 0},
        {**number, "above": 0.0},
    ]
    curve = [0.8, 1.0, 1.2, 1.0, 0.8]
    sweep = {"model.omega": curve, "follow": "model.omega"}
    experiment = changed(checks=checks, schemes=["rk4"], sweep=sweep)
    found = analyse(experiment, [simulate(experiment, level) for level in experiment.levels])
    along, each = verdicts(experiment, found)
    numbers = {result.case: result.value for result in each.results}
    assert max(numbers, key=numbers.__getitem__) == 2
    assert "turns at model.omega = 1.2" in along.text


def test_what_follows_is_part_of_the_experiment() -> None:
    experiment = changed()
    assert restore(canonical(experiment)) == experiment
    shown = Experiment.from_dict(yaml.safe_load(experiment_file.text(experiment)))
    assert shown == experiment
    free = {key: value for key, value in DUFFING["sweep"].items() if key != "follow"}
    plans = [build.build(changed(sweep=sweep)) for sweep in (DUFFING["sweep"], free)]
    assert plans[0].levels[0].shards[0].digest != plans[1].levels[0].shards[0].digest


def test_a_member_that_follows_is_not_run_alone() -> None:
    assert changed().alone(4).initial["u"] == 0.5
    with pytest.raises(InputError, match=r"starts where the member before ends.*@4"):
        changed().alone(5)


@pytest.mark.parametrize(
    ("sections", "message"),
    [
        (
            {"sweep": {"model.omega": [1, 2], "follow": "model.omeg"}},
            "not a swept key.*model.omega",
        ),
        ({"sweep": {"model.omega": [1, 2], "follow": True}}, "must name a swept key"),
        (
            {"sweep": {"model.omega": [1, 2], "model.gamma": [1, 2], "follow": "model.omega"}},
            "must vary fastest",
        ),
        (
            {
                "sweep": {
                    "zip": {"initial.u": [1, 2], "model.omega": [1, 2]},
                    "follow": "model.omega",
                }
            },
            "start of the first member",
        ),
        ({"time": {"end": 20.0}}, "the force does not repeat after the end of a member, 20 s"),
        ({"time": {"periods": 4, "steps_per_period": 16}}, "the force does not repeat"),
        (
            {
                "model": {"kind": "spring"},
                "sweep": {"model.w": [1, 2], "follow": "model.w"},
                "time": {"end": 1.0},
            },
            "free linear motion",
        ),
        (
            {
                "model": {"kind": "vehicle", "road": "0.1*cos(x)", "speed": 2.0},
                "sweep": {"model.speed": [1, 2], "follow": "model.speed"},
                "time": {"end": 1.0},
            },
            "does not repeat",
        ),
        (
            {"checks": [{"value": "error_l2", "quantity": "u", "below": 1}]},
            "not known for members that start",
        ),
        (
            {"checks": [{"equal": ["rk4", "exact"], "quantity": "u", "atol": 1}]},
            "not known for members that start",
        ),
        ({"output": "best"}, "start as the file says"),
        ({"levels": None, "tolerance": 1e-3}, "start as the file says"),
        (
            {"time": {"periods": 4.5, "steps_per_period": 16, "frequency": "model.omega"}},
            "must be a whole number where frequency",
        ),
        (
            {"time": {"periods": 4, "steps_per_period": 16, "frequency": "omega"}},
            "must be a parameter of the model.*model.omega",
        ),
        ({"time": {"end": 4.0, "frequency": "model.omega"}}, "belongs to periods"),
        (
            {"sweep": {"model.omega": [0.0, 1.0]}},
            "must be an angular frequency greater than 0 where model.omega = 0",
        ),
    ],
)
def test_what_cannot_follow_is_refused(sections: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        changed(**sections)


def test_whole_periods_of_the_force_in_any_parameter() -> None:
    """Every member has its own end, of whole periods of the swept frequency."""
    experiment = changed(sweep={"model.omega": [0.5, 2.0]}, schemes=["rk4"])
    ends = simulate(experiment, 1)["end"].values
    np.testing.assert_allclose(ends, 4 * 2 * np.pi / np.array([0.5, 2.0]), rtol=1e-15)
    assert experiment.time.base_steps == 64
