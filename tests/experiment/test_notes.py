"""Values that are allowed and hardly anybody means have a note; what is wrong names what was meant."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from forked import vibsim

from vibsim.cli import main
from vibsim.core.errors import InputError, nearest
from vibsim.experiment import Experiment

ROOT = Path(__file__).parents[2]
PLAIN: dict[str, Any] = {
    "title": "A pendulum",
    "model": {"kind": "pendulum"},
    "initial": {"theta": 1.0},
    "time": {"end": 20.0},
    "levels": [6, 7, 8],
    "schemes": ["central"],
}


def notes(**changes: Any) -> list[str]:
    return [text for _, text in Experiment.from_dict(PLAIN | changes).notes]


def check(**keys: Any) -> list[str]:
    return notes(checks=[keys])


def wave(angle: str) -> dict[str, Any]:
    """Return a model with the parameter f in hertz and a force that is the cosine of `angle`."""
    return {"kind": "oscillator", "force": f"cos({angle})", "parameters": {"f": "50 Hz"}}


CART: dict[str, Any] = {
    "kind": "system",
    "coordinates": ["x", "th"],
    "mass": {"x": {"x": 3, "th": "cos(th)"}, "th": 1},
    "force": {"x": "-x", "th": "-sin(th)"},
}
"""A pendulum on a cart, whose states have no units."""
TOLD = {
    "angle of a system": (
        {"model": CART, "initial": {"th": 40}, "schemes": ["rk4"]},
        "initial.th: 40 rad are 6.4 turns: 40 degrees are written `40 degree`",
    ),
    "vector of an angle and a place": (
        {
            "model": CART,
            "initial": {"th": 1},
            "schemes": ["rk4"],
            "checks": [{"accurate": "velocity_vector", "relative": 0.1}],
        },
        "checks[0]: velocity_vector adds squares of the rates of th, an angle, and of x: a sum means ",
    ),
    "angle": (
        {"initial": {"theta": 60}},
        "initial.theta: 60 rad are 9.5 turns: 60 degrees are written `60 degree`",
    ),
    "negative angle": ({"initial": {"theta": -90}}, "initial.theta: 90 rad are 14 turns"),
    "list": ({"sweep": {"initial.theta": [0.1, 30]}}, "sweep.initial.theta: 30 rad are"),
    "rule": (
        {"sweep": {"initial.theta": {"linspace": [10, 90, 5]}}},
        "sweep.initial.theta: 90 rad are",
    ),
    "zip": (
        {"sweep": {"zip": {"initial.theta": [10, 20], "model.L": [1, 2]}}},
        "sweep.zip.initial.theta: 20 rad are",
    ),
    "sample": (
        {
            "sweep": {
                "sample": {"method": "sobol", "n": 4, "seed": 1, "over": {"initial.theta": [0, 90]}}
            }
        },
        "sweep.sample.over.initial.theta: 90 rad are",
    ),
    "decimal commas": (
        {"sweep": {"initial.theta": [0, 1, 0, 2]}},
        "sweep.initial.theta: has 0 more than once: a number with a decimal comma becomes two",
    ),
    "relative": (
        {"checks": [{"accurate": "theta", "relative": 5}]},
        "checks[0].relative: is 5 times the size of theta",
    ),
    "order": (
        {"checks": [{"converges": "theta", "order": 2, "tolerance": 10}]},
        "checks[0].tolerance: lets every order up to 12 pass",
    ),
    "two levels": (
        {"levels": [6, 7], "checks": [{"converges": "theta"}]},
        "levels: 2 of them decide no order: three are needed",
    ),
    "digits": (
        {"checks": [{"value": "period", "equals": 6.7}]},
        "checks[0].equals: has no tolerance, and is compared to 1e-9 of it: `atol: 0.05`",
    ),
    "unused": (
        {
            "model": {"kind": "oscillator", "damping": "k2*v", "parameters": {"k2": 1, "k": 2}},
            "initial": {"u": 1},
        },
        "model.parameters.k: no formula names it: use it, or leave it out",
    ),
    "phase": (
        {"model": {**wave("2*t - 90"), "parameters": {}}, "initial": {}},
        "model: 90 rad are 14 turns: 90 degrees are written `90*pi/180`",
    ),
    "declared phase": (
        {
            "model": {**wave("2*t + a"), "parameters": {"a": 30}},
            "initial": {},
        },
        "model.parameters.a: 30 rad are 4.8 turns: 30 degrees are written `30 degree`",
    ),
    "rtol": (
        {"checks": [{"value": "period", "equals": 6.7, "rtol": 5}]},
        "checks[0].rtol: lets every number up to 6 times the expected one pass: 5 percent are 0.05",
    ),
    "damping that drives": (
        {
            "model": {"kind": "oscillator", "damping": "m*v**2/2"},
            "initial": {"u": 1},
            "schemes": ["rk4"],
        },
        "model.damping: is the same for both signs of v",
    ),
    "spring that pushes": (
        {"model": {"kind": "oscillator", "spring": "-4*u"}, "initial": {"u": 1}},
        "model.spring: pushes away from u = 0",
    ),
    "springs of a sweep that all push": (
        {
            "model": {"kind": "oscillator", "spring": "k*u", "parameters": {"k": 1}},
            "initial": {"u": 1},
            "sweep": {"model.parameters.k": [-1, -2]},
        },
        "model.spring: pushes away from u = 0",
    ),
    "hertz": (
        {"model": wave("f*t + 0.1"), "initial": {}},
        "model.parameters.f: the formulas take it for an angular frequency",
    ),
    "of a claim": (
        {"checks": [{"claim": "it is so", "that": {"value": "period", "equals": 6.71}}]},
        "checks[0].that.equals: has no tolerance, and is compared to 1e-9 of it: `atol: 0.005`",
    ),
}


@pytest.mark.parametrize(("changes", "told"), TOLD.values(), ids=TOLD)
def test_what_hardly_anybody_means_has_a_note(changes: dict[str, Any], told: str) -> None:
    (found,) = notes(**changes)
    assert found.startswith(told)


MEANT = {
    "turn": {"initial": {"theta": 6.28}},
    "formula": {"initial": {"theta": "20*pi"}},
    "degrees": {"initial": {"theta": "60 degree"}},
    "swept degrees": {"sweep": {"initial.theta": ["10 degree", "90 degree"]}},
    "count of a rule": {"sweep": {"initial.theta": {"linspace": [0.1, 3, 50]}}},
    "the same length beside two angles": {
        "sweep": {"zip": {"initial.theta": [1, 2], "model.L": [3, 3]}}
    },
    "up and down again": {
        "model": {"kind": "duffing", "gamma": 1},
        "initial": {"u": 1},
        "time": {"periods": 4, "steps_per_period": 4, "frequency": "model.omega"},
        "sweep": {"follow": "model.omega", "model.omega": [1, 2, 1]},
    },
    "velocity": {"initial": {"omega": 60}},
    "displacement": {"model": {"kind": "spring"}, "initial": {"u": 60}},
    "hertz": {"model": wave("t*f*2*pi"), "initial": {}},
    "double well": {
        "model": {"kind": "oscillator", "spring": "u**3 - u", "damping": "v + v**2"},
        "initial": {"u": 1},
        "schemes": ["rk4"],
    },
    "negative stiffness": {
        "model": {
            "kind": "oscillator",
            "spring": "(a - 3*b + c)*u",
            "parameters": {"a": 10, "b": 1, "c": "-4 N/m"},
        },
        "initial": {"u": 1},
    },
    "swept stiffness of one sign": {
        "model": {"kind": "oscillator", "spring": "-k*u", "parameters": {"k": 1}},
        "initial": {"u": 1},
        "sweep": {"model.parameters.k": [-1, -2]},
    },
    "swept stiffness": {
        "model": {"kind": "oscillator", "spring": "(pi - 2)*k*u", "parameters": {"k": -1}},
        "initial": {"u": 1},
        "sweep": {"model.parameters.k": [1, 2]},
    },
    "odd power": {
        "model": {"kind": "oscillator", "damping": "v**(n + 1)", "parameters": {"n": 2}},
        "initial": {"u": 1},
        "schemes": ["rk4"],
    },
    "place of a system": {"model": CART, "initial": {"x": 40}, "schemes": ["rk4"]},
    "tolerance": {"checks": [{"value": "period", "equals": 6.7, "atol": 0.1}]},
    "many digits": {"checks": [{"value": "period", "equals": 6.70024879}]},
    "zero": {"checks": [{"value": "end", "quantity": "theta", "equals": 0}]},
    "border": {"checks": [{"value": "period", "below": 6.7}]},
    "accurate": {"checks": [{"accurate": "theta", "relative": 0.05}]},
}
MEANT["count"] = {
    "model": {"kind": "linear_pendulum"},
    "checks": [{"value": "exact_degree", "equals": 2}],
}


@pytest.mark.parametrize("changes", MEANT.values(), ids=MEANT)
def test_what_may_well_be_meant_has_none(changes: dict[str, Any]) -> None:
    assert notes(**changes) == []


def test_shipped_experiments_mean_what_they_say() -> None:
    files = sorted((ROOT / "configs/showcase").glob("*.yaml"))
    assert files
    assert [file for file in files if Experiment.from_yaml(file).notes] == []


@pytest.mark.slow
def test_commands_print_notes_with_their_place_and_go_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "small.yaml"
    file.write_text(
        "title: T\nmodel: {kind: pendulum}\ninitial: {theta: 60}\ntime: {end: 20}\n"
        "levels: [5, 6]\nschemes: [central]\n"
    )
    told = f"{file}:3: note: initial.theta: 60: 60 rad are 9.5 turns"
    for command in (["check"], ["plan"]):
        # the second time from the plan that is kept
        for _ in range(2):
            assert main([*command, str(file)]) == 0
            assert capsys.readouterr().err.startswith(told)
    for quietly in ([], ["-q"]):
        ended = vibsim("run", *quietly, "--dry-run", "--results", tmp_path / "r", file)
        assert ended.returncode == 0
        assert ended.stderr.startswith(told) if not quietly else ended.stderr == ""
    assert main(["check", str(file), "--set", "initial.theta=45"]) == 0
    told = f"{file}: note: --set initial.theta=45: initial.theta: 45: 45 rad are 7.2 turns"
    assert capsys.readouterr().err.startswith(told)


REFUSED = {
    "capitals": ({"schemes": ["RK4"]}, "did you mean 'rk4'?"),
    "part": ({"schemes": ["Euler"]}, "choose from backward_euler, euler_cromer"),
    "key of time": ({"time": {"end": 20, "dt": 0.1}}, "did you mean 'base_dt'?"),
    "order": (
        {"checks": [{"converges": "theta", "order": "two"}]},
        "two: must be scheme (the order that the scheme promises), or a number greater than 0: "
        "order 2: half the step, a quarter of the error",
    ),
    "kind of a check": ({"checks": [{"converge": "theta"}]}, "did you mean 'converges'?"),
    "steps as levels": ({"levels": [6, 256]}, "level n has 2^n steps; 256 steps are level 8"),
    "odd level": ({"levels": [6, 100]}, "must be at most 40: level n has 2^n steps (times"),
    "levels in words": (
        {"levels": "six"},
        "must be a list: e.g. [6, 7, 8, 9], or {from: 6, to: 9}",
    ),
    "coefficient": (
        {"model": {"kind": "oscillator", "damping": {"quadratic": "c"}, "parameters": {"c": 1}}},
        "with a parameter write the formula: `damping: c*abs(v)*v`",
    ),
    "friction": (
        {"model": {"kind": "oscillator", "damping": {"coulomb": "c"}, "parameters": {"c": 1}}},
        "its values may be swept, as `model.damping.coulomb`",
    ),
    "no force": (
        {"checks": [{"value": "steady_change", "quantity": "theta", "below": 1}]},
        "checks[0].value: steady_change: refers to the last period of a force",
    ),
    "schemes of a number": (
        {"checks": [{"value": "period", "schemes": ["central"], "below": 7}]},
        "checks[0].schemes: [central]: unknown key: write at: {scheme: ...}",
    ),
    "level of a number": (
        {"checks": [{"value": "period", "level": 6, "below": 7}]},
        "checks[0].level: 6: unknown key: write at: {level: ...}",
    ),
    "limit of a number": (
        {"checks": [{"value": "period", "at_least": 7}]},
        "checks[0].at_least: 7: unknown key: did you mean 'above'?",
    ),
    "one scheme": ({"schemes": "rk4"}, "must be a list: write [rk4]"),
    "comma": ({"initial": {"theta": "1,5"}}, "must have a decimal point: write 1.5"),
}


@pytest.mark.parametrize(("changes", "told"), REFUSED.values(), ids=REFUSED)
def test_a_slip_names_what_was_meant(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError) as error:
        Experiment.from_dict(PLAIN | changes)
    assert told in str(error.value)


def test_the_nearest_choice_is_that_of_the_same_letters() -> None:
    assert nearest("g", ["G", "L", "g"]) == "did you mean 'g'?"
    assert nearest("two", ["scheme"]) == "choose from scheme"


@pytest.mark.parametrize(
    ("sweep", "setting", "told"),
    [
        ("{model.L: [1, 2]}", "model.L=3", "model.L: 3: has no effect, because it is swept"),
        ("{zip: {model.L: [1, 2]}}", "model.L=3", "model.L: 3: has no effect"),
        ("{model.L: [1, 2]}", "model.g=3", ""),
        ("{model.L: [1, 2]}", "sweep.model.L=[3, 4]", ""),
    ],
)
def test_a_setting_that_a_sweep_overrides_has_a_note(
    tmp_path: Path, sweep: str, setting: str, told: str
) -> None:
    file = tmp_path / "swept.yaml"
    file.write_text(
        "title: T\nmodel: {kind: pendulum}\ninitial: {theta: 1}\ntime: {end: 20}\n"
        f"levels: [5, 6, 7]\nschemes: [central]\nsweep: {sweep}\n"
    )
    found = [text for _, text in Experiment.from_yaml(file, settings=[setting]).notes]
    assert len(found) == bool(told)
    assert all(told in text for text in found)


def test_a_wall_that_no_formula_needs_has_no_note() -> None:
    """The first coordinate is written out, so the wall of the chain is not met there."""
    chain = {"n": 3, "i": {"x_i": {"force": "x_(i+1) - 2*x_i + x_(i-1)"}}}
    first = {"x_1": {"force": "x_2 - x_1"}}
    model = {"kind": "system", "repeat": chain, "coordinates": first}
    assert notes(model=model, initial={}, schemes=["rk4"]) == []
