"""Motions that do not oscillate: free fall is exact for schemes of order 2; what hardly moves shows nothing."""

from __future__ import annotations

from typing import Any

import pytest
from whole import simulated

from vibsim import Experiment, Verdict, verdicts
from vibsim.analysis import analyse_records

pytestmark = pytest.mark.usefixtures("without_series")

BALL = {"kind": "bouncing_ball", "g": 9.81, "restitution": 0.5}


def judged(model: dict[str, Any], scheme: Any = "rk4", **changes: Any) -> Verdict:
    content = {
        "title": "t",
        "model": model,
        "time": {"end": 2.0},
        "levels": [3, 4, 5, 6],
        "schemes": [scheme],
        **changes,
    }
    made = Experiment.from_dict(content)
    found = verdicts(made, analyse_records(made, simulated(made)))
    return next(iter(found))


@pytest.mark.parametrize("scheme", ["rk4", "central", "gauss4"])
def test_free_fall_is_exact(scheme: str) -> None:
    falling = {"kind": "oscillator", "spring": "0", "force": "-9.81"}
    found = judged(falling, scheme, initial={"u": 1.0})
    assert (found.status, found.reason) == ("PASS", "exact"), found.text
    found = judged(BALL, scheme, initial={"h": 1.0, "v": 2.0})
    assert (found.status, found.reason) == ("PASS", "exact"), found.text


def test_a_scheme_that_is_not_exact_there_is_not_called_exact() -> None:
    found = judged(BALL, "euler_cromer", initial={"h": 1.0})
    assert found.reason != "exact"
    on_mesh = {"kind": "rk4", "events": "mesh"}
    assert judged(BALL, on_mesh, initial={"h": 1.0}).reason == "non_smooth"


def test_what_hardly_moves_decides_nothing() -> None:
    assert judged(BALL).reason == "not_applicable"
    soft = {"kind": "oscillator", "spring": "u**3"}
    assert judged(soft, initial={"u": 1e-6}).reason == "round_off"


def test_the_drift_of_no_energy_is_told_without_a_quotient() -> None:
    found = judged({"kind": "spring"}, checks=[{"conserves": "energy"}])
    assert (found.status, found.reason) == ("INCONCLUSIVE", "not_applicable")
    assert "nan" not in found.text


def test_two_solutions_without_a_known_floor_ask_for_a_tolerance() -> None:
    equal = {"equal": ["rk4", "exact"], "quantity": "h"}
    found = judged(BALL, initial={"h": 1.0}, checks=[equal])
    assert (found.status, found.reason) == ("INCONCLUSIVE", "not_applicable")
    assert "apart" in found.text
    assert found.advice.startswith("Give `atol:`")
    assert judged(BALL, initial={"h": 1.0}, checks=[{**equal, "atol": 1e-13}]).status == "PASS"
