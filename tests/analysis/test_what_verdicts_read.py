"""The commands judge what is left of each part of a sweep, Python the whole: both read and say the same."""

from __future__ import annotations

from typing import Any

import pytest
from thinned import thinned

from vibsim import Experiment
from vibsim.analysis import analyse_records, keep_for_verdicts, summarise, verdicts
from vibsim.core.record import Record
from vibsim.simulation import simulate_record

SPRING = {"model": {"kind": "spring"}, "initial": {"u": 1.0}}
PULSE = "heaviside(t - 1.3) - heaviside(t - 1.3001)"
EXPERIMENTS: dict[str, dict[str, Any]] = {
    "a pulse that no level sees": {
        "model": {"kind": "oscillator", "spring": "u", "force": PULSE},
        "initial": {"u": 1.0},
    },
    "a decay that no level sees": {
        "model": {"kind": "oscillator", "spring": "u", "damping": {"linear": 1e4}},
        "initial": {"u": 1.0, "v": 1.0},
        "schemes": ["crank_nicolson"],
    },
    "a corner": {
        "model": {"kind": "oscillator", "spring": "u", "force": "abs(t - 3.3)"},
        "initial": {"u": 1.0},
    },
    "orders that rise": {**SPRING, "levels": [3, 4, 5], "schemes": ["central", "rk4"]},
    "a claim about an order": {
        **SPRING,
        "levels": [3, 4, 5],
        "checks": [{"claim": "It is of order 4.", "that": {"converges": "u", "order": 4}}],
    },
    "round-off": {**SPRING, "levels": [12, 13, 14, 15], "schemes": ["pefrl"]},
    "an order too low": {
        **SPRING,
        "schemes": [{"kind": "central", "start": "first_order"}, "rk4"],
        "checks": [{"converges": "u", "order": 2}, {"converges": "u", "order": 3}],
    },
    "a vector of low order": {
        "model": {
            "kind": "system",
            "coordinates": ["x", "y"],
            "acceleration": {"x": "-x", "y": "-4*y"},
        },
        "initial": {"x": 1.0, "y": 1.0},
        "schemes": ["central"],
        "checks": [{"converges": "position_vector", "order": 4}],
    },
    "a fall into an infinite force": {
        "model": {"kind": "oscillator", "spring": "1/u**2", "potential": "-1/u"},
        "initial": {"u": 1.0},
        "time": {"end": 1.2},
        "levels": [5, 6, 7, 8, 9],
        "checks": [{"converges": "u", "order": 4}],
    },
    "levels that differ in their events": {
        "model": {"kind": "oscillator", "spring": "u", "force": "cos(t)"},
        "events": [{"when": "u - 3.9568636857938907", "rising": True, "then": {"v": "-0.8*v"}}],
        "initial": {"u": 0.0},
        "time": {"end": 13.14, "base_steps": 32},
        "levels": [0, 1, 2, 3],
        "checks": [{"value": "event_count", "equals": 1}],
    },
    "stability": {
        **SPRING,
        "time": {"end": 200.0},
        "levels": [5, 6, 7],
        "schemes": ["central", "forward_euler"],
        "checks": [{"stable": True}, {"stable": False}, {"converges": "u", "order": 2}],
    },
    "a motion that escapes": {
        "model": {"kind": "duffing", "alpha": -1.0, "beta": -1.0},
        "initial": {"u": 1.0},
    },
    "phase and amplitude": {
        **SPRING,
        "checks": [{"converges": "u_phase_error"}, {"converges": "u_amplitude_error"}],
    },
    "energy and equality": {
        **SPRING,
        "schemes": ["central", "euler_cromer"],
        "checks": [
            {"conserves": "energy", "drift": "none"},
            {"equal": ["central", "euler_cromer"], "quantity": "u"},
            {"value": "period", "equals": 6.3, "atol": 0.1},
        ],
    },
}


@pytest.mark.parametrize("name", thinned(EXPERIMENTS, 3))
def test_what_is_kept_of_parts_is_all_that_verdicts_read(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = {"time": {"end": 10.0}, "levels": [5, 6, 7, 8], "schemes": ["rk4"]}
    experiment = Experiment.from_dict({"title": name, **content, **EXPERIMENTS[name]})
    records = {level: simulate_record(experiment, level) for level in experiment.levels}
    whole = analyse_records(experiment, records)
    thin: list[Record] = []
    list(keep_for_verdicts(experiment, [whole], thin))

    asked: set[str] = set()
    variable, contains = Record.variable, Record.__contains__
    monkeypatch.setattr(Record, "variable", lambda r, n: asked.add(n) or variable(r, n))
    monkeypatch.setattr(Record, "__contains__", lambda r, n: asked.add(n) or contains(r, n))
    found = verdicts(experiment, whole)
    summary = summarise(experiment, found, whole)
    monkeypatch.undo()

    assert asked
    assert {one for one in asked if one in whole} <= {one for one in asked if one in thin[0]}
    again = verdicts(experiment, thin[0])
    assert [(v.text, v.advice) for v in again] == [(v.text, v.advice) for v in found]
    assert summarise(experiment, again, thin[0]) == summary
