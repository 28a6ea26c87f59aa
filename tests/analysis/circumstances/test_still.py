"""A motion that lies still wherever levels are compared shows nothing of a scheme: it is not `exact`."""

from __future__ import annotations

from typing import Any

import pytest
from whole import simulated

from vibsim import Experiment, verdicts
from vibsim.analysis import analyse_records

pytestmark = pytest.mark.usefixtures("without_series")

FALLING = {"kind": "oscillator", "spring": "0", "force": "1"}
SPRING = {"kind": "spring", "w": 2.0}


def judged(
    model: dict[str, Any], initial: dict[str, Any], scheme: Any, *quantities: str
) -> list[Any]:
    """Return the verdicts on the orders of quantities."""
    content = {
        "title": "still",
        "model": model,
        "initial": initial,
        "time": {"end": 10.0},
        "levels": [6, 7, 8, 9],
        "schemes": [scheme],
        "checks": [{"converges": quantity} for quantity in quantities],
    }
    experiment = Experiment.from_dict(content)
    return list(verdicts(experiment, analyse_records(experiment, simulated(experiment))))


def damped(b: float) -> dict[str, Any]:
    return {"kind": "oscillator", "spring": "u", "damping": {"linear": b}}


@pytest.mark.parametrize(
    ("model", "initial", "scheme", "quantities"),
    [
        (SPRING, {"u": 0.0}, "rk4", ["u", "v", "energy_deviation"]),
        # its energy is promised to be exact
        (SPRING, {"u": 0.0}, "crank_nicolson", ["u", "energy_deviation"]),
        ({"kind": "pendulum"}, {"theta": "pi"}, "rk4", ["theta"]),
        # at rest away from zero, where force and spring balance
        (
            {"kind": "oscillator", "spring": "3*u", "force": "1.5"},
            {"u": 0.5},
            "central",
            ["u", "v", "energy_deviation"],
        ),
        ({"kind": "sliding_box", "mu": 0.5}, {"u": 0.01}, "rk4", ["u"]),
        # it creeps by 1e-7 and 1e-8 of its size, along a straight line
        (damped(1e8), {"u": 1.0}, "backward_euler", ["u", "energy_deviation"]),
        (damped(1e9), {"u": 2.0}, "backward_euler", ["u"]),
        (damped(1e8), {"u": 1.0}, "crank_nicolson", ["u", "energy_deviation"]),
        # over within the first step
        (damped(1e8), {"v": 1.0}, "backward_euler", ["energy_deviation"]),
        # without any force a velocity stays what it was
        ({"kind": "oscillator", "spring": "0"}, {"v": 1.0}, "rk4", ["v"]),
    ],
)
def test_what_lies_still_is_not_exact(
    model: dict[str, Any], initial: dict[str, Any], scheme: str, quantities: list[str]
) -> None:
    for quantity, found in zip(
        quantities, judged(model, initial, scheme, *quantities), strict=True
    ):
        assert (found.status, found.reason) == ("INCONCLUSIVE", "not_applicable")
        assert f"{quantity} does not change" in found.text
        assert "`initial:`" in found.advice


@pytest.mark.parametrize(
    ("model", "initial", "scheme", "quantities"),
    [
        (FALLING, {"u": 1.0}, "rk4", ["u", "v", "energy_deviation"]),
        (FALLING, {"u": 1.0}, "central", ["u", "v"]),
        (SPRING, {"u": 1.0}, "crank_nicolson", ["energy_deviation"]),
    ],
)
def test_an_exact_scheme_of_a_motion_is_exact(
    model: dict[str, Any], initial: dict[str, Any], scheme: str, quantities: list[str]
) -> None:
    found_of_all = judged(model, initial, scheme, *quantities)
    assert len(found_of_all) == len(quantities)
    for found in found_of_all:
        assert (found.status, found.reason) == ("PASS", "exact"), found.text


def test_a_scheme_that_is_exact_on_the_spring_stays_exact() -> None:
    scheme = {"kind": "central", "frequency_correction": True}
    short = {"kind": "spring", "w": 0.01}
    (found,) = judged(short, {"u": 1.0}, "crank_nicolson", "energy_deviation")
    assert found.reason == "exact"
    (found,) = judged(SPRING, {"u": 1.0}, scheme, "u")
    assert found.status == "PASS"


def test_levels_that_lie_still_beside_a_motion_are_too_coarse() -> None:
    """A push between all points of every level: the exact motion begins with it, that of the levels never does."""
    model = {
        "kind": "oscillator",
        "spring": "u",
        "force": "1e9*(heaviside(t - 1.3001) - heaviside(t - 1.3001 - 1e-9))",
    }
    (found,) = judged(model, {"u": 0.0}, "central", "u")
    assert found.status == "INCONCLUSIVE"
    assert found.reason in {"pre_asymptotic", "non_smooth"}
    assert "finer levels will not help" not in found.advice


def of_checks(initial: dict[str, Any], *checks: dict[str, Any]) -> list[Any]:
    content = {
        "title": "still",
        "model": SPRING,
        "initial": initial,
        "time": {"end": 40.0},
        "levels": [6, 7, 8],
        "schemes": ["central", "crank_nicolson", "rk2", "heun"],
        "checks": list(checks),
    }
    experiment = Experiment.from_dict(content)
    return list(verdicts(experiment, analyse_records(experiment, simulated(experiment))))


@pytest.mark.parametrize(
    "check",
    [
        {"conserves": "energy", "drift": "none", "schemes": ["crank_nicolson"]},
        {"conserves": "energy", "drift": "bounded", "schemes": ["central"]},
        {"conserves": "energy", "drift": "linear", "schemes": ["central"]},
        {"equal": ["rk2", "heun"], "quantity": "u"},
        {"equal": ["central", "exact"], "quantity": "u", "atol": 1e-3},
        {"equal": ["central", "discrete"], "quantity": "u"},
        {"equal": ["rk2", "heun"], "quantity": "v"},
    ],
)
def test_what_lies_still_conserves_and_equals_nothing(check: dict[str, Any]) -> None:
    (found,) = of_checks({"u": 0.0}, check)
    assert (found.status, found.reason) == ("INCONCLUSIVE", "not_applicable"), found.text
    assert "Nothing moves here" in found.text
    assert "`initial:`" in found.advice
    (moving,) = of_checks({"u": 1e-9}, check)
    assert moving.reason != "not_applicable"


def test_what_moves_conserves_and_equals() -> None:
    energy = {"conserves": "energy", "drift": "none", "schemes": ["crank_nicolson"]}
    told = of_checks({"u": 1e-9}, energy, {"equal": ["rk2", "heun"], "quantity": "u"})
    assert [found.status for found in told] == ["PASS", "PASS"]
