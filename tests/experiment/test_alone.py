"""One member of a sweep as an experiment of its own, and experiments whose levels are still to be chosen."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from experiment_files import GOOD, build, write

from vibsim.core.errors import InputError
from vibsim.experiment import Experiment, canonical, restore, sweep_columns

SWEEP: dict[str, Any] = {
    "schemes.trap.start": ["centred", "first_order"],
    "zip": {"model.g": [1, 4, 9], "initial.theta": {"linspace": [0.1, 0.3, 3]}},
    "sample": {"method": "random", "n": 4, "seed": 3, "over": {"time.end": [5, 9]}},
}
SCHEMES = ["central", {"kind": "central", "label": "trap", "arithmetic": "increment"}]


def test_alone_has_the_values_of_the_member() -> None:
    whole = build(schemes=SCHEMES, sweep=SWEEP, model={"kind": "pendulum", "L": 2})
    columns = sweep_columns.columns(whole, 0, whole.members)
    for case in range(whole.members):
        one = whole.alone(case)
        assert one.name == f"experiment_case_{case}"
        assert (one.sweep, one.members, one.end_varies) == (None, 1, False)
        assert one.model.parameters == {
            "g": columns["model.g"][case],
            "L": 2.0,
            "m": 1.0,
            "drag": 0.0,
        }
        assert one.initial == {"theta": columns["initial.theta"][case], "omega": 0.0}
        assert one.time.end == columns["time.end"][case]
        assert one.schemes[0] == whole.schemes[0]
        start = columns["schemes.trap.start"][case]
        assert one.schemes[1].options == {**whole.schemes[1].options, "start": start}
        assert restore(json.loads(json.dumps(canonical(one)))) == one
        assert {type(value) for value in one.initial.values()} == {float}


def test_alone_is_what_a_file_without_a_sweep_would_be() -> None:
    one = build(sweep={"model.g": [1, 2], "initial.theta": [0.5, 1]}).alone(3)
    written = build(model={"kind": "pendulum", "g": 2}, initial={"theta": 1})
    assert one == written.model_copy(update={"name": "experiment_case_3"})
    assert hash(one) == hash(restore(canonical(one)))


def test_alone_ends_after_its_own_periods() -> None:
    time = {"periods": 3, "steps_per_period": 4}
    whole = build(time=time, sweep={"model.g": [1, 4]})
    assert [whole.alone(case).time.end for case in (0, 1)] == [6 * math.pi, 3 * math.pi]
    assert whole.alone(1).time.periods == 3


def test_alone_keeps_the_checks_that_concern_it() -> None:
    def check(**at: object) -> dict[str, object]:
        return {"value": "end", "quantity": "theta", "at": at, "below": 2}

    checks = [
        {"converges": "theta"},
        {"id": "other", **check(case=0)},
        {"id": "mine", **check(case=1, t=0.5)},
        {"id": "all", **check()},
        {"id": "said", "claim": "c", "that": check(case=1, step=4)},
        {"id": "said_of_other", "claim": "c", "that": check(case=0)},
    ]
    whole = build(sweep={"time.end": [10, 40]}, checks=checks)
    one = whole.alone(1)
    assert [found.id for found in one.checks] == ["check_1", "mine", "all", "said"]
    assert [c.measured.at.case for c in one.checks[1:]] == [None] * 3
    # a time that was a fraction of the end
    assert one.checks[1].at.t == 20.0
    assert one.checks[3].that.at.step == 4
    fixed = build(sweep={"model.g": [1, 2]}, checks=[{"id": "mine", **check(case=1, t=5)}])
    assert fixed.alone(1).checks[0].at.t == 5


def test_alone_without_any_check_left_converges() -> None:
    check = {"value": "max", "quantity": "omega", "at": {"case": 0}, "below": 2}
    whole = build(sweep={"model.g": [1, 2]}, checks=[check])
    assert whole.alone(1).checks == build().checks
    assert len(whole.alone(0).checks) == 1


@pytest.mark.parametrize("case", [-1, 6, 10**18])
def test_a_case_that_is_none_is_refused_with_the_number_of_members(
    tmp_path: Any, case: int
) -> None:
    file = write(tmp_path, GOOD + "sweep: {model.g: [1, 2, 3], model.L: [1, 2]}\n")
    whole = Experiment.from_yaml(file)
    assert whole.alone(5).file == file
    with pytest.raises(InputError, match=r"case\.yaml: .* from 0 to 5: there are 6 members") as e:
        whole.alone(case)
    assert e.value.faults[0].value == str(case)


def test_without_a_sweep_there_is_one_case() -> None:
    assert build().alone(0) == build().model_copy(update={"name": "experiment_case_0"})
    with pytest.raises(InputError, match="there is 1 member"):
        build().alone(1)


def by_tolerance(**changes: Any) -> Experiment:
    return build(levels=None, tolerance="1e-10", **changes)


def test_a_tolerance_leaves_the_levels_open() -> None:
    experiment = by_tolerance(samples={"every": 4}, sweep={"model.g": [1, 2]}, output="best")
    assert (experiment.tolerance, experiment.levels, experiment.output) == (1e-10, (), "best")
    assert restore(json.loads(json.dumps(canonical(experiment)))) == experiment
    chosen = experiment.with_levels(range(5, 8, 2))
    assert chosen.levels == (5, 7)
    assert chosen.tolerance == 1e-10
    assert chosen == build(
        levels=[5, 7], samples={"every": 4}, sweep={"model.g": [1, 2]}
    ).model_copy(update={"tolerance": 1e-10, "output": "best"})
    assert restore(json.loads(json.dumps(canonical(chosen)))) == chosen
    assert (build().tolerance, build().output) == (None, "verdict")


def test_chosen_levels_are_held_to_the_rules_of_a_file() -> None:
    at = {"value": "end", "quantity": "theta", "below": 2}
    claim = {"claim": "c", "that": {**at, "at": {"t": 5}}}
    checks = [{**at, "at": {"t": 5}}, {**at, "at": {"best": True, "t": 10}}, claim]
    experiment = by_tolerance(checks=checks, samples="common")
    assert experiment.with_levels([2, 3]).checks == experiment.checks
    for levels, told in (([1, 2], "not a stored sample time"), ([2, 40], "must not take more")):
        with pytest.raises(InputError, match=told):
            experiment.with_levels(levels)
    with pytest.raises(InputError, match="must divide the 4 steps"):
        by_tolerance(samples={"every": 3}).with_levels([2, 3])
    for bad, told in (
        ([], r"levels: \[\]: must not be empty"),
        ([3, 3], r"levels\[1\]: 3: levels must not be repeated"),
        ([4, 3], r"levels\[1\]: 3: levels must be in increasing order"),
        ([-1, 2], r"levels\[0\]: -1: must be at least 0"),
        ([3, 41], r"levels\[1\]: 41: must be at most 40"),
        ([1, 2.5], r"levels\[1\]: 2.5: must be a whole number"),
    ):
        with pytest.raises(InputError, match=told):
            experiment.with_levels(bad)


def test_a_member_alone_may_have_its_levels_chosen_later() -> None:
    one = by_tolerance(sweep={"model.g": [1, 2]}).alone(1)
    assert (one.levels, one.tolerance) == ((), 1e-10)
    assert one.with_levels([6, 7]).levels == (6, 7)
