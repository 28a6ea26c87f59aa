"""Other ways to write a model: each gives the experiment of the usual one, and faults stand where they were written."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from vibsim import Experiment, InputError
from vibsim.experiment.shorthand import solved
from vibsim.formula import ExpressionError, evaluate, parse

REST = """
title: t
time: {end: 4}
levels: [5, 6, 7]
schemes: [SCHEME]
"""
PAIRS = {
    "an equation": (
        """model: {kind: system, equation: "u'' + (u**2 - 1)*u' + u = 0"}""",
        """model: {kind: system, acceleration: "-((u**2 - 1)*v) - u"}""",
    ),
    "an equation of another coordinate": (
        """model: {kind: system, equation: "m*x'' = F*cos(t) - k*x", parameters: {m: 2, F: 1, k: 3}}""",
        """model: {kind: system, coordinates: [x], acceleration: (F*cos(t) - k*x)/m, parameters: {m: 2, F: 1, k: 3}}""",
    ),
    "formulas of each coordinate": (
        """model:
  kind: system
  coordinates:
    x: {acceleration: -k*x + c*(y - x)}
    y: {mass: 2.0, force: -k*y - c*(y - x) - d*vy}
  parameters: {k: 1.0, c: 0.2, d: 0.05}
initial: {x: 1.0}
stop: x < -0.5
events: [{when: x - 0.9, falling: true, then: {vx: -0.8*vx}}]""",
        """model:
  kind: system
  coordinates: [x, y]
  mass: {x: 1, y: 2.0}
  force: {x: -k*x + c*(y - x), y: -k*y - c*(y - x) - d*vy}
  parameters: {k: 1.0, c: 0.2, d: 0.05}
  stop: x < -0.5
  events: [{when: x - 0.9, falling: true, then: {vx: -0.8*vx}}]
initial: {x: 1.0}""",
    ),
    "accelerations of each": (
        "model: {kind: system, coordinates: {x: {acceleration: -x}, y: {acceleration: x - y}}}",
        "model: {kind: system, coordinates: [x, y], acceleration: {x: -x, y: x - y}}",
    ),
    "repeated coordinates": (
        """model:
  kind: system
  repeat: {i: [1, 3]}
  coordinates:
    q{i}: {mass: 2, force: "q{i+1} - 2*q{i} + q{i-1}"}
  parameters: {q0: 0, q4: 0}""",
        """model:
  kind: system
  coordinates: [q1, q2, q3]
  mass: {q1: 2, q2: 2, q3: 2}
  force: {q1: q2 - 2*q1 + q0, q2: q3 - 2*q2 + q1, q3: q4 - 2*q3 + q2}
  parameters: {q0: 0, q4: 0}""",
    ),
    "events beside an oscillator": (
        """model: {kind: oscillator, spring: u}
initial: {u: 1}
stop: u < 0""",
        """model: {kind: oscillator, spring: u, stop: u < 0}
initial: {u: 1}""",
    ),
    "letters of a structure": (
        "model: {kind: structure, M: [2, 1], C: [0.1, 0.2], K: [[3, -1], [-1, 1]], load: {2: cos(t)}}",
        "model: {kind: structure, mass: [2, 1], damping: [0.1, 0.2], stiffness: [[3, -1], [-1, 1]], load: {2: cos(t)}}",
    ),
    "a check of all cases": (
        """model: {kind: pendulum}
initial: {theta: 1}
sweep: {model.L: [1, 2]}
checks: [{value: period, over: cases, take: where, equals: 2}]""",
        """model: {kind: pendulum}
initial: {theta: 1}
sweep: {model.L: [1, 2]}
checks: [{value: period, over: model.L, take: where_largest, equals: 2}]""",
    ),
    "a check of the cases with one value": (
        """model: {kind: pendulum}
initial: {theta: 1}
sweep: {model.L: [1, 2], model.g: [1, 2]}
checks: [{value: period, over: cases, at: {model.g: 1}, take: largest, below: 20}]""",
        """model: {kind: pendulum}
initial: {theta: 1}
sweep: {model.L: [1, 2], model.g: [1, 2]}
checks: [{value: period, over: model.L, at: {model.g: 1}, take: largest, below: 20}]""",
    ),
    "a claim on members that vary together": (
        """model: {kind: pendulum}
initial: {theta: 1}
sweep: {zip: {model.L: [1, 2], model.g: [9.81, 1.62]}}
checks: [{claim: c, that: {value: period, over: cases, take: largest, below: 20}}]""",
        """model: {kind: pendulum}
initial: {theta: 1}
sweep: {zip: {model.L: [1, 2], model.g: [9.81, 1.62]}}
checks: [{claim: c, that: {value: period, over: model.L, take: largest, below: 20}}]""",
    ),
}  # fmt: skip


@pytest.fixture
def read(tmp_path: Path) -> Callable[[str], Experiment]:
    def made(text: str) -> Experiment:
        path = tmp_path / "one.yaml"
        scheme = "newmark" if "structure" in text else "rk4"
        path.write_text(text + REST.replace("SCHEME", scheme))
        return Experiment.from_yaml(path)

    return made


@pytest.mark.parametrize(("other", "usual"), PAIRS.values(), ids=PAIRS)
def test_it_is_the_experiment_of_the_usual_form(
    other: str, usual: str, read: Callable[[str], Experiment]
) -> None:
    assert read(other) == read(usual)


@pytest.mark.parametrize(
    ("equation", "name", "acceleration"),
    [
        ("u'' = 3", "u", 3.0),
        ("0 = u'' + 4*u", "u", -2.0),
        ("-x'' = x", "x", -0.5),
        ("m*u'' + b*u' + k*u = F", "u", (7.0 - 2.0 * 0.25 - 3.0 * 0.5) / 5.0),
        ("2*(u'' + 3*u) = u'", "u", -3.0 * 0.5 + 0.125),
        ("(1 + u**2)*u'' + u*u'**2 = 0", "u", -0.5 * 0.25**2 / 1.25),
        ("u''/2 - (u - u') = 1", "u", 2.0 * (1.0 + 0.25)),
        ("u'' + e*u = pi", "u", math.pi - 0.3 * 0.5),
    ],
)
def test_equations_are_solved(equation: str, name: str, acceleration: float) -> None:
    found, formula = solved(equation, ["m", "b", "k", "F", "e"])
    assert found == name
    numbers = {
        "m": 5.0,
        "b": 2.0,
        "k": 3.0,
        "F": 7.0,
        "e": 0.3,
        name: 0.5,
        "v": 0.25,
        f"v{name}": 0.25,
    }
    assert evaluate(parse(formula, numbers), numbers) == pytest.approx(acceleration, rel=1e-14)


@pytest.mark.parametrize(
    ("equation", "rule"),
    [
        ("u'' + u", "must have one ="),
        ("u'' = u = 0", "must have one ="),
        ("u' = u", "second derivative of one coordinate"),
        ("x'' + y'' = 0", "second derivative of one coordinate"),
        ("u'' + x' = 0", "not a derivative of u"),
        ("u''*u'' = u", "linear in u''"),
        ("sin(u'') = u", "linear in u''"),
        ("0*u'' = u", "vanishes"),
        ("u'' = ", "is empty"),
        ("u'' + 1e5*c*u' = 0", "unknown name 'c'"),
        ("u''' + u'' = 1", "a derivative above the second is not allowed"),
    ],
)
def test_what_is_no_equation_of_one_coordinate_is_refused(equation: str, rule: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        solved(equation, ["t"])
    assert rule in caught.value.rule


def test_an_unknown_name_of_an_equation_is_told_the_nearest_or_where_its_value_belongs() -> None:
    for name, hint in (("gama", "did you mean 'gamma'?"), ("c", "give its value in `parameters`")):
        with pytest.raises(ExpressionError) as caught:
            solved(f"u'' + {name}*u' = 0", ["t", "gamma"])
        assert caught.value.hint == hint


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "model:\n  kind: system\n  coordinates:\n    x: {acceleration: -x}\n    y: {force: -z}",
            "one.yaml:5: model.coordinates.y.force: -z: unknown name 'z'",
        ),
        (
            "model:\n  kind: system\n  coordinates:\n    x:\n      acceleration: -x\n      drag: 1",
            "one.yaml:6: model.coordinates.x.drag: 1: is not a formula of a coordinate: acceleration, mass, force",
        ),
        (
            "model: {kind: system, coordinates: {x: {drag: 1}}}",
            "each coordinate must have an acceleration, or a force with its mass",
        ),
        (
            "model: {kind: system, equation: \"u'' + x' = 0\"}",
            "one.yaml:1: model.equation: u'' + x' = 0: 'x'' is not a derivative of u",
        ),
        (
            "model: {kind: system, equation: \"u'' + u = 0\", acceleration: -u}",
            "one.yaml:1: model.equation: u'' + u = 0: is also given under `model: acceleration`",
        ),
        (
            "model: {kind: oscillator, spring: u, stop: u < 0}\ninitial: {u: 1}\nstop: u < 0.5",
            "one.yaml:3: stop: u < 0.5: is also given under `model: stop`",
        ),
        (
            "model: {kind: bouncing_ball}\nstop: h < 1",
            "one.yaml:2: stop: h < 1: the model bouncing_ball takes none: `kind: system` does",
        ),
        (
            "model: {kind: oscillator, spring: u}\ninitial: {u: 1}\nevents:\n  - {when: q}",
            "one.yaml:4: events[0].when: q: unknown name 'q'",
        ),
        (
            "model: {kind: system, acceleration: -u, events: [{when: u, then: v = -v}]}",
            "model.events[0].then: v = -v: must be a mapping: e.g. {v: -0.8*v}",
        ),
        (
            "model: {kind: system, acceleration: -u, events: [{when: u = 1}]}",
            "events[0].when: u = 1: a formula has no = at character 3: write the difference, or ==",
        ),
        (
            "model: {kind: system, acceleration: -k*u, parameters: {k: 1}, k: 2}",
            "one.yaml:1: model.k: 2: unknown key: the parameter of this name is `model.parameters.k`",
        ),
        (
            "model: {kind: structure, M: [2, 1], mass: [2, 1], K: [1, 1]}",
            "one.yaml:1: model.M: is also given under `model: mass`",
        ),
        (
            "model: {kind: pendulum}\ninitial: {theta: 1}\nsweep: {model.L: [1, 2], model.g: [1, 2]}\n"
            "checks: [{value: period, over: cases, take: monotone, equals: 1}]",
            "checks[0].over: cases: needs a swept key with this `take`: choose from model.L, model.g",
        ),
    ],
)  # fmt: skip
def test_faults_are_told_where_they_stand(text: str, told: str, read: Callable[[str], Any]) -> None:
    with pytest.raises(InputError) as caught:
        read(text)
    assert told in str(caught.value)
