"""What an experiment is once it is read."""

from __future__ import annotations

import json
import math
import pickle
import subprocess
import sys
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from experiment_files import GOOD, build, content, only_fault, smallest_section, write
from pydantic import ValidationError

from vibsim.core.errors import InputError
from vibsim.experiment import Experiment, canonical, restore
from vibsim.experiment import collection as collections
from vibsim.experiment.storage import sampling, stride
from vibsim.models import MODELS
from vibsim.plan import choose
from vibsim.plan import load as load_plan
from vibsim.schemes import SCHEMES

ROOT = Path(__file__).resolve().parents[2]

EXAMPLE = """\
# yaml-language-server: $schema=../../workflow/schemas/experiment.schema.json
title: Nonlinear pendulum on four levels
source: pendulum lecture, section 2.5   # what this experiment comes from (free text)
model: {kind: pendulum, g: 1.0, L: 1.0, m: 1.0}
initial: {theta: 1.0, omega: 0.0}
time: {end: 20.0}
levels: {from: 6, to: 9}                # both included; or a list [6, 7, 8, 9]
schemes: [central, {kind: central, label: classical, arithmetic: increment}]
checks:
  - {converges: theta, order: scheme}
  - {converges: energy_deviation, order: 2, schemes: [central]}
  - claim: the estimate -4/3 (u_l - u_(l+1)) is right to 2 % of the largest error
    source: pendulum lecture, section 2.5
    that: {value: error_estimate_defect, quantity: theta, at: {scheme: central, level: 6}, below: 0.02}
    holds: true
"""


def test_the_first_example(tmp_path: Path) -> None:
    experiment = Experiment.from_yaml(write(tmp_path, EXAMPLE, "four_levels.yaml"))
    assert (experiment.collection, experiment.name) == ("adhoc", "four_levels")
    assert experiment.model.parameters == {"g": 1.0, "L": 1.0, "m": 1.0, "drag": 0.0}
    assert experiment.levels == (6, 7, 8, 9)
    assert [experiment.steps(level) for level in experiment.levels] == [64, 128, 256, 512]
    assert [scheme.name for scheme in experiment.schemes] == ["central", "classical"]
    assert experiment.schemes[1].options["arithmetic"] == "increment"
    assert [check.id for check in experiment.checks] == ["check_1", "check_2", "check_3"]
    assert [check.kind for check in experiment.checks] == ["converges", "converges", "claim"]
    claim = experiment.checks[2]
    assert claim.that.at.level == 6
    assert claim.that.below == 0.02
    assert experiment.file == tmp_path / "four_levels.yaml"


def test_defaults_are_filled_in() -> None:
    experiment = build(initial=None)
    model = MODELS["pendulum"]
    assert experiment.model.parameters == {p.name: p.default for p in model.parameters}
    assert experiment.initial == {"theta": 0.0, "omega": 0.0}
    assert experiment.schemes[0].options == SCHEMES["central"].defaults()
    assert (experiment.samples, experiment.sweep, experiment.members) == ("auto", None, 1)
    (check,) = experiment.checks
    assert (check.kind, check.id, check.converges, check.order) == (
        "converges",
        "check_1",
        "theta",
        "scheme",
    )
    assert build(checks=[]).checks == experiment.checks


@pytest.mark.parametrize("kind", MODELS)
def test_every_model_and_scheme_of_the_registries_can_be_named(kind: str) -> None:
    model = MODELS[kind]
    treated = [name for name, scheme in SCHEMES.items() if scheme.treats(model)]
    # levels need a scheme with equal steps
    schemes = ["central", *({"kind": name, "label": f"named_{name}"} for name in treated)]
    experiment = build(model=smallest_section(kind), initial={}, schemes=schemes)
    for name, named in zip(treated, experiment.schemes[1:], strict=True):
        defaults = {option.name: option.default for option in SCHEMES[name].options_on(model)}
        assert named.options == {**SCHEMES[name].defaults(), **defaults}, name
    assert tuple(experiment.initial) == tuple(state.name for state in model.states)
    for name in set(SCHEMES) - set(treated):
        with pytest.raises(InputError, match="cannot treat"):
            build(
                model=smallest_section(kind),
                initial={},
                schemes=["central", {"kind": name, "label": "named"}],
            )


def test_formulas_as_numbers() -> None:
    experiment = build(
        model={"kind": "pendulum", "g": "9.81", "L": "9.81/(4*pi**2)"},
        initial={"theta": "2*pi/30", "omega": -1},
        time={"end": "10*2*pi"},
        sweep={"initial.theta": ["pi/4", 1, 2.5]},
    )
    assert experiment.model.parameters["L"] == 9.81 / (4 * (math.pi * math.pi))
    assert experiment.initial == {"theta": 2 * math.pi / 30, "omega": -1.0}
    assert experiment.time.end == 10 * 2 * math.pi
    assert experiment.sweep.axes[0].values == ((math.pi / 4, 1.0, 2.5),)


@pytest.mark.parametrize(
    ("time", "end", "base_steps"),
    [
        ({"end": 20}, 20.0, 1),
        ({"end": 20, "base_steps": 5}, 20.0, 5),
        ({"end": 20, "base_steps": 5.0}, 20.0, 5),
        ({"end": 1, "base_dt": 0.1}, 1.0, 10),
        ({"end": 0.3, "base_dt": 0.1}, 0.3, 3),
        ({"periods": 3, "steps_per_period": 4}, 3 * (2 * math.pi / 2.0), 12),
        ({"periods": 1.5, "steps_per_period": 2}, 1.5 * (2 * math.pi / 2.0), 3),
        ({"periods": "1/3", "steps_per_period": 9}, 1 / 3 * (2 * math.pi / 2.0), 3),
    ],
)
def test_ways_to_give_the_time(time: dict[str, float], end: float, base_steps: int) -> None:
    experiment = build(model={"kind": "pendulum", "g": 4.0}, time=time)
    assert experiment.time.end == pytest.approx(end, rel=1e-15)
    assert experiment.time.base_steps == base_steps
    assert experiment.steps(7) == 128 * base_steps


def test_levels_as_list_and_level_zero() -> None:
    assert build(levels=[6, 8, 9]).levels == (6, 8, 9)
    assert build(levels=[3]).levels == (3,)
    assert build(levels={"from": 0, "to": 2}, time={"end": 1, "base_steps": 2}).levels == (0, 1, 2)


def test_sweep_is_a_grid_in_written_order() -> None:
    sweep = build(
        sweep={"model.L": [1, 2], "initial.theta": {"linspace": [0.1, 3.1, 4]}, "time.end": [5]}
    ).sweep
    assert sweep.keys == ("model.L", "initial.theta", "time.end")
    assert [axis.count for axis in sweep.axes] == [2, 4, 1]
    assert sweep.count == 8


@pytest.mark.parametrize(
    ("changes", "varies"),
    [
        ({}, False),
        ({"sweep": {"model.g": [1, 2]}}, False),
        ({"sweep": {"time.end": [1, 2]}}, True),
        ({"sweep": {"time.end": [2, 2]}}, False),
        ({"sweep": {"time.end": {"linspace": [1, 2, 3]}}}, True),
        ({"sweep": {"model.g": [1, 2]}, "time": {"periods": 2, "steps_per_period": 4}}, True),
        ({"sweep": {"initial.theta": [1]}, "time": {"periods": 2, "steps_per_period": 4}}, False),
    ],
)
def test_whether_the_end_varies(changes: dict[str, object], varies: bool) -> None:
    assert build(**changes).end_varies is varies


def test_end_in_natural_periods_belongs_to_the_member() -> None:
    time = {"periods": 3, "steps_per_period": 4}
    experiment = build(time=time, sweep={"model.g": [1, 4]})
    ends = experiment.natural_end({"g": np.array([1.0, 4.0]), "L": 1.0, "m": 1.0})
    assert list(ends) == [6 * math.pi, 3 * math.pi]
    assert experiment.natural_end(experiment.model.parameters) == experiment.time.end
    assert build().natural_end({}) == 20.0


def test_ids_are_unique_and_kept() -> None:
    checks = [
        {"converges": "theta"},
        {"id": "check_1", "converges": "omega"},
        {"converges": "energy"},
    ]
    ids = [check.id for check in build(checks=checks).checks]
    assert ids[1:] == ["check_1", "check_3"]
    assert len(set(ids)) == 3


@pytest.mark.parametrize("at", [{"level": "best"}, {"best": True}])
def test_best_level(at: dict[str, object]) -> None:
    check = {"value": "error_linf", "quantity": "theta", "at": at, "below": 1e-3}
    assert build(checks=[check]).checks[0].at.level == "best"


def test_best_solution_has_the_times_of_the_coarsest_level() -> None:
    def check(**at: object) -> dict[str, object]:
        return {"value": "end", "quantity": "theta", "at": {"level": "best", **at}, "below": 2}

    build(checks=[check(), check(t=20 / 64), check(step=64)])
    assert "nearest are 0 and 0.3125" in only_fault(checks=[check(t=20 / 128)]).hint
    assert "at most 64" in only_fault(checks=[check(step=65)]).rule
    kinetic = check() | {"quantity": "kinetic_energy"}
    assert only_fault(checks=[kinetic]).key == "checks[0].quantity"


def test_equal_content_is_equal_and_hashes_alike(tmp_path: Path) -> None:
    one = Experiment.from_yaml(write(tmp_path, GOOD, "same.yaml"))
    (tmp_path / "other").mkdir()
    two = Experiment.from_yaml(write(tmp_path / "other", GOOD, "same.yaml"))
    assert one.file != two.file
    assert one == two
    assert hash(one) == hash(two)
    assert one != build()
    assert one != "experiment"


def test_frozen_to_the_bottom() -> None:
    experiment = build()
    with pytest.raises(ValidationError):
        experiment.title = "other"
    for table in (experiment.initial, experiment.model.parameters, experiment.schemes[0].options):
        before = dict(table)
        for change in (
            lambda t: t.update(x=1),
            lambda t: t.pop("theta", None),
            lambda t: t.clear(),
            lambda t: t.setdefault("x", 1),
            lambda t: t.__setitem__("x", 1),
            lambda t: t.__delitem__(next(iter(t))),
            lambda t: t.__ior__({"x": 1}),
        ):
            with pytest.raises(TypeError, match="does not change"):
                change(table)
        assert table == before


def test_copies_and_pickles() -> None:
    experiment = build(sweep={"model.g": [1, 2]})
    for other in (pickle.loads(pickle.dumps(experiment)), deepcopy(experiment)):
        assert other == experiment
        assert hash(other) == hash(experiment)


REWRITTEN = """\
# a comment
schemes:
  - kind: central          # the same scheme
    start: centred
levels: [6, 7, 8, 9]
checks:
initial: {omega: 0, theta: 1.00}
time:
  base_steps: 1
  end: 2e1
model: {m: 1., L: 1, kind: pendulum, g: 1.0e0}
title: "A pendulum"
"""


def test_canonical_ignores_spelling(tmp_path: Path) -> None:
    one = canonical(Experiment.from_yaml(write(tmp_path, GOOD)))
    two = canonical(Experiment.from_yaml(write(tmp_path, REWRITTEN)))
    assert json.dumps(one) == json.dumps(two)


def test_canonical_is_separable_json() -> None:
    experiment = build(
        sweep={"model.g": [1, 2]},
        checks=[{"claim": "x", "that": {"converges": "theta", "expect": {"status": "PASS"}}}],
    )
    data = canonical(experiment)
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert set(data) == {
        *("collection", "name", "title", "source", "model", "initial", "time", "levels"),
        *("schemes", "sweep", "samples", "output", "tolerance", "checks"),
    }
    other = canonical(build(title="Other", sweep={"model.g": [1, 2]}))
    assert {key for key in data if data[key] != other[key]} == {"title", "checks"}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"samples": {"every": 4}, "sweep": {"model.g": [1, 2], "initial.theta": [0.5]}},
        {"time": {"periods": 2, "steps_per_period": 8}},
        {"checks": [{"claim": "c", "that": {"value": "period", "equals": 6.7, "rtol": 0.1}}]},
        {"checks": [{"value": "at", "quantity": "theta", "at": {"t": 10}, "below": 2}]},
    ],
)
def test_restored_from_canonical(changes: dict[str, object]) -> None:
    experiment = build(**changes)
    again = restore(json.loads(json.dumps(canonical(experiment), sort_keys=True)))
    assert again == experiment
    assert hash(again) == hash(experiment)


@pytest.mark.parametrize("samples", ["auto", "common", "all", {"every": 2}, {"every": 16}])
@pytest.mark.parametrize("levels", [[6, 7, 9], [5, 18], [6]])
def test_stride_is_the_plans(samples: object, levels: list[int]) -> None:
    """Checks on stored times must mean the samples that the plan keeps."""
    experiment = build(samples=samples, levels=levels)
    coarsest = experiment.steps(levels[0])
    for level in levels:
        steps = experiment.steps(level)
        every = stride(experiment.samples, coarsest, steps, 1)
        assert every == sampling(experiment, level)
        assert steps % every == 0


def test_numpy_numbers_and_tuples() -> None:
    data = content(
        initial={"theta": np.float64(1.0), "omega": np.float32(0.5)},
        levels=(np.int64(6), 7),
        sweep={"model.g": np.array([1.0, 2.0])},
    )
    experiment = Experiment.from_dict(data, name="mine", collection="tests")
    assert experiment.initial == {"theta": 1.0, "omega": 0.5}
    assert experiment.levels == (6, 7)
    assert (experiment.collection, experiment.name) == ("tests", "mine")


@pytest.mark.parametrize(
    ("path", "collection"),
    [
        ("configs/lab/a.yaml", "lab"),
        ("configs/deep/er/a.yaml", "adhoc"),
        ("configs/a.yaml", "adhoc"),
        ("elsewhere/configs/lab/a.yaml", "adhoc"),
        ("elsewhere/a.yaml", "adhoc"),
    ],
)
def test_collection(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: str, collection: str
) -> None:
    file = tmp_path / path
    file.parent.mkdir(parents=True)
    file.write_text(GOOD)
    assert Experiment.from_yaml(file).collection == "adhoc"
    assert Experiment.from_yaml(file, configs=tmp_path / "configs").collection == collection
    assert Experiment.from_yaml(file, configs=tmp_path / "others").collection == "adhoc"
    assert Experiment.from_yaml(file, collection="mine").collection == "mine"
    monkeypatch.setattr(collections, "home", lambda: tmp_path)
    assert (
        Experiment.from_yaml(file).collection == Experiment.from_yaml(file).collection == collection
    )
    assert [choice.collection for choice in choose([str(file)], tmp_path)] == [collection]


def test_a_plan_that_is_kept_needs_no_validation() -> None:
    program = (
        "import sys; import vibsim.plan, vibsim.experiment.collection\n"
        "heavy = {'numpy', 'pydantic', 'yaml'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


@pytest.mark.parametrize("name", ["A", "a-b", "a b", "\u00e4", "a.b", ""])
def test_names_must_be_plain(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="a to z, 0 to 9 and _"):
        Experiment.from_yaml(write(tmp_path, GOOD, f"{name}.yaml"))
    with pytest.raises(InputError, match="a to z, 0 to 9 and _"):
        Experiment.from_dict(content(), collection=name)


def test_collection_must_be_plain(tmp_path: Path) -> None:
    folder = tmp_path / "configs" / "My Lab"
    folder.mkdir(parents=True)
    with pytest.raises(InputError, match="name of the collection, 'My Lab'"):
        Experiment.from_yaml(write(folder, GOOD), configs=tmp_path / "configs")
    with pytest.raises(InputError, match="name of the collection, 'My Lab'"):
        load_plan(*choose([str(folder / "case.yaml")], tmp_path))


def test_dictionary_that_contains_itself() -> None:
    data = content()
    data["model"] = data
    with pytest.raises(InputError, match="nest deeper"):
        Experiment.from_dict(data)


@pytest.mark.parametrize("content", [None, [1], "my_pendulum.yaml"])
def test_what_is_no_dictionary_is_refused(content: Any) -> None:
    with pytest.raises(InputError, match="must be a mapping of keys to values"):
        Experiment.from_dict(content)


def test_dictionary_faults_have_no_line() -> None:
    assert only_fault(levels={"from": 9, "to": 6}).line == 0


def test_every_check_tells_what_is_measured() -> None:
    that = {"value": "period", "equals": 6.7, "rtol": 0.1}
    checks = build(checks=[{"converges": "theta"}, that, {"claim": "c", "that": that}]).checks
    assert [check.measured.kind for check in checks] == ["converges", "value", "value"]
    assert checks[0].measured is checks[0]
    assert checks[1].measured is checks[1]
    assert checks[2].measured is checks[2].that


@pytest.mark.parametrize(
    "sweep",
    [
        None,
        {"model.g": [1, 2]},
        {"model.g": [2, 2]},
        {"model.m": {"linspace": [1, 1, 3]}},
        {"initial.theta": [1, 2]},
    ],
)
@pytest.mark.parametrize(
    "time", [{"end": 20}, {"periods": 2, "steps_per_period": 4}], ids=["end", "periods"]
)
def test_checks_and_jobs_agree_on_whether_the_end_varies(
    sweep: dict[str, object] | None, time: dict[str, float]
) -> None:
    """A `t` is a fraction for checks exactly where it is one in the data."""
    check = {"value": "at", "quantity": "theta", "at": {"t": 1}, "below": 9}
    changes = {"sweep": sweep, "time": time, "samples": "common"}
    varies = build(**changes).end_varies
    changes["checks"] = [check]
    if varies:
        build(**changes)
    else:
        assert "not a stored sample time" in only_fault(**changes).rule
