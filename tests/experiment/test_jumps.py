"""Formulas that the equation differentiates: jumps, of which the derivative knows nothing, are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from experiment_files import build, only_fault

from vibsim import simulate

USUAL: dict[str, Any] = {
    "initial": None,
    "schemes": ["rk4"],
    "time": {"end": 4.0},
    "levels": [8, 9, 10],
}
VEHICLE = {"kind": "vehicle", "speed": 5.0, "spring": "4*u"}


@pytest.mark.parametrize(
    ("model", "place", "rule"),
    [
        (
            {"kind": "circuit", "voltage": "V0*heaviside(t - 1)", "parameters": {"V0": 12}},
            "model.voltage",
            "jumps near t = 1, and the equation has its derivative",
        ),
        ({"kind": "circuit", "voltage": "12*heaviside(t)"}, "model.voltage", "jumps near t = 0"),
        ({**VEHICLE, "road": "0.1*(x > 10)"}, "model.road", "jumps near x = 10"),
        (
            {**VEHICLE, "road": "abs(sin(x/2 + 1))"},
            "model.road",
            "its slope jumps near x = 4.28319, and the equation has its second derivative",
        ),
        ({"kind": "oscillator", "exact": "floor(t)"}, "model.exact", "jumps near t = 1"),
        (
            {"kind": "oscillator", "exact": "abs(t - 1)"},
            "model.exact",
            "its slope jumps near t = 1",
        ),
        (
            {"kind": "elastic_pendulum", "exact_x": "sin(t)", "exact_y": "max(t - 3, 0)"},
            "model.exact_y",
            "its slope jumps near t = 3",
        ),
    ],
)
def test_a_jump_of_what_is_differentiated_is_refused(
    model: dict[str, Any], place: str, rule: str
) -> None:
    fault = only_fault(**USUAL, model=model)
    assert fault.key == place
    assert rule in fault.rule
    assert fault.hint


def test_a_jump_in_some_members_alone_is_refused() -> None:
    model = {"kind": "circuit", "voltage": "heaviside(t - t1)", "parameters": {"t1": 9}}
    sweep = {"model.parameters.t1": {"linspace": [10, 3.5, 2]}}
    assert "jumps near t = 3.5" in only_fault(**USUAL, model=model, sweep=sweep).rule


def test_a_jump_behind_the_end_is_none() -> None:
    build(**USUAL, model={"kind": "circuit", "voltage": "heaviside(t - 5)"})


@pytest.mark.parametrize(
    "model",
    [
        {"kind": "circuit", "voltage": "abs(sin(5*t))"},
        {**VEHICLE, "road": "max(sin(x), 0)**2"},
        {"kind": "oscillator", "exact": "max(t - 1, 0)**3"},
        {"kind": "oscillator", "exact": "where(t < 1, t**2, 2*t - 1)"},
        {"kind": "oscillator", "force": "heaviside(t - 1)"},
    ],
)
def test_corners_of_it_are_allowed(model: dict[str, Any]) -> None:
    build(**USUAL, model=model)


@pytest.mark.slow
def test_a_steep_ramp_gives_the_current_of_a_switched_voltage() -> None:
    """Without resistance i(t) is V0 sqrt(C/L) sin(w (t - t1)) behind the switch: what the message advises is right."""
    model = {"kind": "circuit", "voltage": "12*(1 + tanh((t - 1)/0.001))/2"}
    experiment = build(**{**USUAL, "levels": [15, 16, 17]}, model=model)
    data = simulate(experiment, 17)
    behind = data.t > 1.1
    truth = 12.0 * np.sin(data.t - 1.0)
    assert float(abs(data.i.isel(scheme=0, case=0) - truth).where(behind).max()) < 1e-4
