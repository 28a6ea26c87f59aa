"""A problem in other units of time, length and mass is the same problem: verdicts, reasons and orders stay."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
from thinned import thinned
from whole import analysed

from vibsim import Experiment, verdicts

pytestmark = pytest.mark.usefixtures("without_series")

NUMBER = re.compile(r"[-+]?[0-9][-+.0-9e]*")
Make = Callable[[float, float, float], dict[str, Any]]
"""Makes a problem whose units of time, length and mass are as small."""

SCALES = [
    (2.0**-27, 1.0, 1.0),
    (2.0**40, 2.0**40, 2.0**-40),
    (1e-10, 1e10, 1e-10),
    (1e8, 1e-8, 1e8),
]


def spring(t: float, x: float, m: float) -> dict[str, Any]:
    return {
        "model": {"kind": "spring", "w": 2.0 / t},
        "initial": {"u": x},
        "time": {"end": 10.0 * t},
        "schemes": [
            "rk4",
            "central",
            "forward_euler",
            {"kind": "central", "frequency_correction": True, "label": "corrected"},
        ],
        "checks": [
            {"converges": "u", "order": "scheme"},
            {"converges": "v", "order": 2},
            {"converges": "energy_deviation", "order": "scheme"},
            {"converges": "u_phase_error", "order": "scheme"},
            {"conserves": "energy", "drift": "bounded"},
            {"equal": ["corrected", "exact"], "quantity": "u"},
            {"equal": ["central", "discrete"], "quantity": "u"},
            {"value": "error_linf", "quantity": "u", "at": {"scheme": "rk4"}, "below": 1e-4 * x},
            {"value": "period", "at": {"level": "best", "scheme": "rk4"}, "below": 3.15 * t},
            # right to five digits only, which is too little
            {"value": "exact_period", "equals": 3.1416 * t},
        ],
    }


def pendulum(t: float, x: float, m: float) -> dict[str, Any]:
    return {
        "model": {"kind": "pendulum", "g": x / t**2, "L": x, "m": m},
        "initial": {"theta": 1.0},
        "time": {"end": 10.0 * t},
        "schemes": ["rk4", "central", "euler_cromer"],
        "checks": [
            {"converges": "theta", "order": "scheme"},
            {"converges": "omega", "order": "scheme"},
            {"converges": "energy_deviation", "order": "scheme"},
            {"stable": True},
            {"conserves": "energy", "drift": "bounded"},
        ],
    }


def oscillator(t: float, x: float, m: float) -> dict[str, Any]:
    return {
        "model": {
            "kind": "oscillator",
            "m": m,
            "spring": "k*u + c*u**3",
            "damping": {"quadratic": 0.3 * m / x},
            "force": "A*sin(w*t)",
            "parameters": {
                "k": m / t**2,
                "c": 0.3 * m / (t * x) ** 2,
                "A": 0.5 * m * x / t**2,
                "w": 1.7 / t,
            },
        },
        "initial": {"u": x},
        "time": {"end": 10.0 * t},
        "schemes": ["rk4", "central"],
        "checks": [{"converges": "u", "order": "scheme"}, {"converges": "v", "order": "scheme"}],
    }


def pulse(t: float, x: float, m: float) -> dict[str, Any]:
    """A force whose jumps have a place and a height."""
    return {
        "model": {
            "kind": "oscillator",
            "m": m,
            "spring": f"{m / t**2!r}*u",
            "force": "A*(heaviside(t - a) - heaviside(t - b))",
            "parameters": {"A": m * x / t**2, "a": 1.3 * t, "b": 1.3001 * t},
        },
        "initial": {"u": x},
        "time": {"end": 10.0 * t},
        "schemes": ["rk4", "central"],
        "checks": [{"converges": "u", "order": "scheme"}],
    }


def ball(t: float, x: float, m: float) -> dict[str, Any]:
    return {
        "model": {
            "kind": "bouncing_ball",
            "g": 9.81 * x / t**2,
            "restitution": 0.8,
            "eps_h": 1e-6 * x,
            "eps_v": 1e-3 * x / t,
        },
        "initial": {"h": x},
        "time": {"end": 1.5 * t},
        "schemes": ["rk4", {"kind": "euler_cromer", "events": "mesh"}],
        "checks": [{"converges": "h", "order": "scheme"}],
    }


def box(t: float, x: float, m: float) -> dict[str, Any]:
    return {
        "model": {
            "kind": "sliding_box",
            "m": m,
            "k": m / t**2,
            "alpha": 1.0 / x,
            "mu": 0.1,
            "g": 9.81 * x / t**2,
        },
        "initial": {"u": 3.0 * x},
        "levels": {"from": 5, "to": 8},
        "time": {"end": 10.0 * t},
        "schemes": ["rk4", "central"],
        "checks": [{"converges": "u", "order": "scheme"}],
    }


def circuit(t: float, x: float, m: float) -> dict[str, Any]:
    return {
        "model": {
            "kind": "circuit",
            "L": m,
            "R": 0.2 * m / t,
            "C": t**2 / m,
            "voltage": f"{m * x / t!r}*sin({1.7 / t!r}*t)",
        },
        "initial": {"i": 0.5 * x},
        "time": {"end": 10.0 * t},
        "schemes": ["rk4", "bdf2"],
        "checks": [{"converges": "i", "order": "scheme"}],
    }


def found(make: Make, scale: tuple[float, float, float]) -> dict[tuple[str, str], Any]:
    """Return what is decided of every check and scheme, what is said of it without its numbers, and the orders."""
    content = {"title": "scales", "levels": {"from": 7, "to": 10}, **make(*scale)}
    experiment = Experiment.from_dict(content)
    record = analysed(experiment)
    return {
        (verdict.id, one.scheme): (one.status, one.reason, NUMBER.sub("#", verdict.text), one.order)
        for verdict in verdicts(experiment, record)
        for one in verdict.results
    }


MODELS = [spring, pendulum, oscillator, pulse, ball, box, circuit]


@pytest.mark.parametrize("number", thinned(range(len(MODELS)), 9))
def test_other_units_change_no_verdict(number: int) -> None:
    """Each model with one scale by powers of two and one by powers of ten, smaller ones and larger ones in turn."""
    make = MODELS[number]
    usual = found(make, (1.0, 1.0, 1.0))
    for scale in SCALES[number % 2 :: 2]:
        now = found(make, scale)
        assert {k: row[:3] for k, row in now.items()} == {k: row[:3] for k, row in usual.items()}
        for key, (_, reason, _, order) in usual.items():
            # orders of round-off are none
            if reason not in {"exact", "round_off"} and order is not None:
                assert now[key][3] == pytest.approx(order, abs=0.1), (scale, key)
