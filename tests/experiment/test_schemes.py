"""Schemes and their options: words, numbers and flags, in a file, in a sweep, and of one member alone."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from experiment_files import GOOD, build, faults_of, file_faults, only_fault

from vibsim.experiment import Experiment, canonical, kinds, restore, sweep_columns
from vibsim.experiment.schema.sweep import tolerance_name
from vibsim.models import MODELS
from vibsim.schemes import FIXED_STEP, SCHEMES, AnyOption, Flag, NumberOption, Option

EVERY = [(kind, option) for kind, scheme in SCHEMES.items() for option in scheme.options]
NAMES = [f"{kind}-{option.name}" for kind, option in EVERY]
ADAPTIVE = sorted(set(SCHEMES) - set(FIXED_STEP))


def of_type(kind: type[AnyOption]) -> list[Any]:
    pairs = zip(EVERY, NAMES, strict=True)
    return [pytest.param(*row, id=name) for row, name in pairs if isinstance(row[1], kind)]


def values_of(option: AnyOption) -> list[str | float | bool]:
    """Return two values that a user may give."""
    if isinstance(option, Option):
        return [option.choices[-1], option.choices[0]]
    if isinstance(option, Flag):
        return [True, False]
    most = option.most if math.isfinite(option.most) else option.least + 1.0
    return [option.least, most]


def entry(kind: str, **options: Any) -> list[Any]:
    """Return a list with one scheme of a kind, and one that has levels."""
    return ["central", {"kind": kind, "label": "mine", **options}]


def same(experiment: Experiment) -> bool:
    return restore(json.loads(json.dumps(canonical(experiment)))) == experiment


@pytest.mark.parametrize(("kind", "option"), EVERY, ids=NAMES)
def test_an_option_is_a_value_of_its_own_type(kind: str, option: AnyOption) -> None:
    for value in values_of(option):
        experiment = build(schemes=entry(kind, **{option.name: value}))
        found = experiment.schemes[1].options[option.name]
        assert (found, type(found)) == (value, type(option.default))
        assert same(experiment)
        assert hash(experiment) == hash(restore(canonical(experiment)))
    given = build(schemes=entry(kind, **{option.name: option.default}))
    assert given == build(schemes=entry(kind))


@pytest.mark.parametrize(("kind", "option"), EVERY, ids=NAMES)
def test_an_option_can_be_swept(kind: str, option: AnyOption) -> None:
    values, key = values_of(option), f"schemes.mine.{option.name}"
    experiment = build(schemes=entry(kind), sweep={key: values, "model.g": [1, 2]})
    columns = sweep_columns.columns(experiment, 0, 4)
    assert columns[key].dtype.kind == ("f" if isinstance(option, NumberOption) else "U")
    groups = sweep_columns.option_groups(experiment, 1, columns)
    assert [(options[option.name], list(where)) for options, where in groups] == [
        (values[0], [0, 1]),
        (values[1], [2, 3]),
    ]
    for options, where in groups:
        assert type(options[option.name]) is type(option.default)
        for case in where:
            alone = experiment.alone(int(case))
            assert alone.schemes[1].options == options
            assert same(alone)
    assert same(experiment)


@pytest.mark.parametrize(("kind", "option"), of_type(NumberOption))
def test_a_number_keeps_to_its_bounds(kind: str, option: NumberOption) -> None:
    for value, word in ((option.least - 1.0, "at least"), (option.most + 1.0, "at most")):
        if not math.isfinite(value):
            continue
        fault = only_fault(schemes=entry(kind, **{option.name: value}))
        assert (fault.key, fault.rule[: 5 + len(word)]) == (
            f"schemes[1].{option.name}",
            f"must {word}".replace("must ", "must be ")[: 5 + len(word)],
        )
        key = f"schemes.mine.{option.name}"
        swept = only_fault(schemes=entry(kind), sweep={key: [option.default, value]})
        assert swept.key == f"sweep.{key}[1]"
        assert word in swept.rule
        rule = {"linspace": [option.default, value, 3]}
        assert word in only_fault(schemes=entry(kind), sweep={key: rule}).rule
    formula = f"{option.default!r}*2/2"
    experiment = build(schemes=entry(kind, **{option.name: formula}))
    assert experiment.schemes[1].options[option.name] == option.default
    for bad in ("x", True, None):
        faults = faults_of(schemes=entry(kind, **{option.name: bad}))
        assert [fault.key for fault in faults] == [f"schemes[1].{option.name}"]


@pytest.mark.parametrize(("kind", "option"), of_type(Flag))
def test_a_flag_is_true_or_false(kind: str, option: Flag) -> None:
    for bad in ("yes", 1, 0.0):
        fault = only_fault(schemes=entry(kind, **{option.name: bad}))
        assert (fault.key, fault.rule) == (
            f"schemes[1].{option.name}",
            "must be true or false",
        )
    key = f"schemes.mine.{option.name}"
    fault = only_fault(schemes=entry(kind), sweep={key: [True, "true"]})
    assert (fault.key, fault.rule) == (f"sweep.{key}[1]", "must be true or false")
    over = {"method": "random", "n": 2, "seed": 0, "over": {key: [0, 1]}}
    assert "cannot be drawn" in only_fault(schemes=entry(kind), sweep={"sample": over}).rule
    rule = {"linspace": [0, 1, 2]}
    assert "list of true and false" in only_fault(schemes=entry(kind), sweep={key: rule}).rule


def test_truth_is_no_number_elsewhere() -> None:
    fault = only_fault(sweep={"model.g": [1.0, True]})
    assert (fault.key, fault.rule[:16]) == ("sweep.model.g[1]", "must be a number")


@pytest.mark.parametrize(("kind", "option"), EVERY, ids=NAMES)
def test_a_misspelt_option_is_named(kind: str, option: AnyOption) -> None:
    fault = only_fault(schemes=entry(kind, **{f"{option.name}x": 1}))
    assert (fault.key, fault.rule) == (f"schemes[1].{option.name}x", "unknown key")
    assert fault.hint == f"did you mean '{option.name}'?"


@pytest.mark.parametrize("kind", ADAPTIVE)
def test_several_tolerances_are_several_schemes(kind: str) -> None:
    tolerances = [1e-4, "10**-8", 2.5e-5]
    schemes = [{"kind": kind, "tolerance": tolerances}, "central", {"kind": kind, "label": "own"}]
    experiment = build(schemes=schemes)
    names = [f"{kind}_1e-04", f"{kind}_1e-08", f"{kind}_2.5e-05", "central", "own"]
    assert [scheme.name for scheme in experiment.schemes] == names
    found = [scheme.options.get("tolerance") for scheme in experiment.schemes[:3]]
    assert found == [1e-4, 1e-8, 2.5e-5]
    assert experiment.ladder == (3,)
    assert not any(scheme.own_velocity for scheme in experiment.schemes)
    assert same(experiment)
    labelled = build(schemes=["rk4", {"kind": kind, "label": "ref", "tolerance": [1e-4]}])
    assert labelled.schemes[1].name == "ref_1e-04"
    one = build(schemes=["rk4", {"kind": kind, "tolerance": 1e-4}])
    assert one.schemes[1].name == kind
    # they can be named in checks, and their tolerance swept
    build(schemes=schemes, checks=[{"converges": "theta", "schemes": [f"{kind}_1e-08"]}])
    assert build(schemes=entry(kind), sweep={"schemes.mine.tolerance": [1e-4, 1e-6]}).members == 2


@pytest.mark.parametrize("kind", ADAPTIVE)
def test_what_is_wrong_with_tolerances_is_told(kind: str) -> None:
    repeated = entry(kind, tolerance=[1e-4, 1e-5, "1e-4"])
    fault = only_fault(schemes=repeated)
    assert (fault.key, fault.rule) == (
        "schemes[1].tolerance[2]",
        "a tolerance must not be repeated",
    )
    fault = only_fault(schemes=entry(kind, tolerance=[1e-4, -1]))
    assert (fault.key, fault.rule[:16]) == ("schemes[1].tolerance[1]", "must be at least")
    assert only_fault(schemes=entry(kind, tolerance=[])).rule == "must not be empty"
    for only in ([kind], [{"kind": kind, "tolerance": [1e-4, 1e-5]}], ADAPTIVE):
        fault = only_fault(schemes=only)
        assert (fault.key, fault.hint) == ("schemes", "choose from " + ", ".join(FIXED_STEP))
        assert fault.rule.startswith("at least one scheme must take equal steps")


@pytest.mark.parametrize("tolerance", [1e-4, 1e-12, 2.5e-5, 0.1, 1 / 3, 5e-324])
def test_the_name_of_a_tolerance_tells_it(tolerance: float) -> None:
    name = tolerance_name("ref", tolerance)
    assert float(name.removeprefix("ref_")) == tolerance


def test_an_experiment_with_a_tolerance_is_about_the_schemes_with_levels() -> None:
    experiment = build(levels=None, tolerance=1e-8, schemes=["central", *ADAPTIVE])
    assert experiment.ladder == (0,)
    assert experiment.with_levels([5, 6]).levels == (5, 6)


@pytest.mark.parametrize("kind", FIXED_STEP)
def test_a_step_that_is_too_long_is_not_refused(kind: str) -> None:
    """Two steps in a hundred periods are far beyond every limit."""
    time = {"periods": 100, "steps_per_period": 0.02}
    experiment = build(schemes=["central", {"kind": kind, "label": "x"}], time=time, levels=[0, 1])
    assert experiment.steps(0) == 2


def test_a_scheme_for_forces_without_velocity_names_those_that_can(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    schemes = dict(SCHEMES) | {"central": SCHEMES["central"]}
    model = replace(MODELS["pendulum"], variant=None, acceleration="-(g/L)*sin(theta) - 0.1*omega")
    monkeypatch.setattr(kinds, "SCHEMES", schemes)
    build()
    monkeypatch.setattr(kinds, "MODELS", {"pendulum": model})
    (fault,) = file_faults(tmp_path, GOOD)
    rule = "cannot treat pendulum, whose acceleration depends on omega by more than linear or quadratic damping"
    assert fault.rule == rule
    able = [kind for kind, scheme in schemes.items() if scheme.velocity_forces]
    assert able
    assert fault.hint == "choose from " + ", ".join(able)
    build(schemes=[able[0]])


def test_a_scheme_may_not_have_the_name_of_a_solution() -> None:
    for label in ("exact", "discrete"):
        fault = only_fault(schemes=[{"kind": "central", "label": label}])
        assert (fault.key, fault.value) == ("schemes[0].label", label)


def test_many_sets_of_options_come_in_the_order_of_the_members() -> None:
    numbers = [kind for kind, option in EVERY if isinstance(option, NumberOption)]
    kind = next(kind for kind in numbers if kind in FIXED_STEP)
    option = next(o for o in SCHEMES[kind].options if isinstance(o, NumberOption))
    low, high = (float(end) for end in values_of(option))
    drawn = {
        "method": "random",
        "n": 300,
        "seed": 1,
        "over": {f"schemes.mine.{option.name}": [low, high]},
    }
    experiment = build(schemes=entry(kind), sweep={"model.g": [1, 2], "sample": drawn})
    columns = sweep_columns.columns(experiment, 0, 600)
    groups = sweep_columns.option_groups(experiment, 1, columns)
    column = columns[f"schemes.mine.{option.name}"]
    assert [options[option.name] for options, _ in groups] == list(column[:300])
    for i, (_, where) in enumerate(groups):
        np.testing.assert_array_equal(where, [i, i + 300])
