"""`scaled: true`: the run in characteristic units, and the factors that lead back."""

from __future__ import annotations

import math

import numpy as np
import pytest
from experiment_files import build, faults_of, only_fault

from vibsim.analysis import analyse_records
from vibsim.experiment import canonical, restore
from vibsim.simulation import simulate_record

PENDULUM = {"kind": "pendulum", "g": "9.8 m/s^2", "L": "4.9 m", "m": "2 kg"}
BODY = {"kind": "physical_pendulum", "inertia": 3, "m": 2, "g": 9.8, "L": 0.7}
DUFFING = {"kind": "duffing", "delta": 0.1, "gamma": 0.3, "omega": 1.2}
DRIVEN = {
    "kind": "oscillator",
    "m": 2,
    "spring": "k*u",
    "force": "A*sin(phi*t)",
    "parameters": {"k": 3, "A": 0.5, "phi": 1.1, "d": 0.3},
}
FREE = {"kind": "oscillator", "m": 2, "spring": "k*u", "parameters": {"k": 3}}
MADE = {**FREE, "parameters": {"k": 3, "A": 0.5, "phi": 2}}
ROAD = {
    "kind": "vehicle",
    "m": 2,
    "speed": 3,
    "spring": "k*u",
    "road": "h*sin(2*pi*x/wave)",
    "parameters": {"k": 4, "h": 0.1, "wave": 12},
}
VOLTS = {"V": 0.5, "w": 1.5}
STATES = {"theta": 1.0, "omega": 0.3}


def pair(**changes):
    """Return an experiment with units, and the same scaled."""
    given = {
        "model": PENDULUM,
        "initial": STATES,
        "time": {"end": 14.0},
        "levels": [5, 6],
    } | changes
    return build(**given), build(**given, scaled=True)


def test_dimensionless_numbers_and_what_leads_back():
    plain, scaled = pair()
    t, omega = math.sqrt(0.5), math.sqrt(2.0)
    assert scaled.model.parameters == {"g": 1.0, "L": 1.0, "m": 1.0, "drag": 0.0}
    assert scaled.initial["theta"] == 1.0
    assert scaled.initial["omega"] == pytest.approx(0.3 / omega, rel=1e-15)
    assert scaled.time.end == pytest.approx(14.0 / t, rel=1e-15)
    assert scaled.scaling is not None
    wanted = {"t": t, "theta": 1.0, "omega": omega, "energy": 96.04, "wire_force": 19.6}
    assert scaled.scaling.scales == pytest.approx(wanted)
    assert scaled.scaling.parameters == plain.model.parameters
    assert scaled.scaling.initial == plain.initial
    assert scaled.scaling.end == 14.0
    assert plain.scaling is None
    assert "scaling" not in canonical(plain)
    assert restore(canonical(scaled)) == scaled


@pytest.mark.parametrize(
    ("model", "initial"),
    [
        (PENDULUM, STATES),
        ({**PENDULUM, "drag": 0.2}, STATES),
        ({**PENDULUM, "kind": "linear_pendulum"}, STATES),
        ({"kind": "spring", "w": 2.5}, {"u": 0.3, "v": 0.1}),
        ({"kind": "spring", "w": 2.5}, {"u": 0.0, "v": 0.1}),
        ({**BODY, "drag": 0.0}, STATES),
        ({**BODY, "drag": 0.4}, STATES),
        ({"kind": "washing_machine", "m": 3, "k": 5, "b": 0.7, "unbalance": 0.2, "speed": 2}, {}),
        ({**DUFFING, "alpha": -2, "beta": 0.5}, {"u": 0.3, "v": 0.1}),
        ({**DUFFING, "alpha": 3, "beta": -0.2}, {"u": 0.3, "v": 0.1}),
        ({**DRIVEN, "damping": {"quadratic": 0.4}}, {"u": 0.3, "v": 0.1}),
        ({**DRIVEN, "damping": {"linear": 0.4}, "m": 1}, {"u": 0.3, "v": 0.1}),
        ({**FREE, "damping": {"coulomb": 0.1}}, {"u": 0.3, "v": 0.1}),
        ({**FREE, "spring": "k*u + c*u**3", "parameters": {"k": 3, "c": 40}}, {"u": 0.3, "v": 0.1}),
        ({**FREE, "spring": "k/c*sinh(c*u)", "parameters": {"k": 3, "c": 4}}, {"u": 0.3, "v": 0.1}),
        ({**DRIVEN, "damping": "d*v**3", "force": "A*exp(-phi*t)"}, {"u": 0.3, "v": 0.1}),
        ({**MADE, "exact": "A*cos(phi*t)"}, {}),
        ({**ROAD, "b": 0.3}, {"u": 0.0, "v": 0.0}),
        ({"kind": "circuit", "L": 2, "R": 0.3, "C": 0.1}, {"i": 0.3, "di_dt": 0.1}),
        (
            {"kind": "circuit", "L": 2, "C": 0.1, "voltage": "V*sin(w*t)", "parameters": VOLTS},
            {"i": 0.3, "di_dt": 0.1},
        ),
    ],
)
def test_the_scaled_run_leads_back_to_the_plain_one(monkeypatch, model, initial):
    # a reference solution is none of what is compared
    monkeypatch.setattr("vibsim.experiment.storage.MOST_REFERENCES", 0)
    plain, scaled = pair(model=model, initial=initial, schemes=["rk4"])
    records = [simulate_record(experiment, 6) for experiment in (plain, scaled)]
    outputs = [row.name for row in plain.model.definition.outputs]
    states = [state.name for state in plain.model.definition.states]
    for name in ("t", *states, "energy", *outputs):
        factor = records[1].attrs[f"scale_{name}"]
        assert records[0][name] == pytest.approx(factor * records[1][name], rel=1e-12, abs=1e-12)
        assert records[1].variable(name).attrs["units"] == "1"
        assert records[1].attrs[f"scale_{name}_units"] == records[0].variable(name).attrs["units"]


def test_every_number_of_a_scaled_run_is_without_unit():
    _, scaled = pair(schemes=["central", "rk4"], output="best")
    levels = {level: simulate_record(scaled, level) for level in scaled.levels}
    for record in (*levels.values(), analyse_records(scaled, levels)):
        rows = [*record.variables.values(), *record.coords.values()]
        assert {row.attrs["units"] for row in rows if "units" in row.attrs} == {"1"}
        assert record.attrs["scale_t_units"] == "s"


def test_periods():
    time = {"periods": 3, "steps_per_period": 8}
    plain, scaled = pair(time=time)
    assert scaled.time.end == pytest.approx(6 * math.pi)
    assert scaled.time.base_steps == plain.time.base_steps


def test_options_of_schemes_may_be_swept():
    _, scaled = pair(sweep={"schemes.central.start": ["centred", "first_order"]})
    assert scaled.members == 2
    assert scaled.alone(1).scaling == scaled.scaling


def test_options_of_schemes_may_vary_together():
    options = {"schemes.central.start": ["centred", "taylor"]}
    assert pair(sweep={"zip": options})[1].members == 2


@pytest.mark.parametrize("key", ["model.g", "initial.theta", "time.end"])
@pytest.mark.parametrize("values", [[1.0, 2.0], {"linspace": [1.0, 2.0, 3]}])
def test_sweeps_that_change_the_scales_are_refused(key, values):
    fault = only_fault(scaled=True, sweep={key: values})
    assert (fault.key, fault.value) == ("scaled", "")
    assert f"must not be given where {key} is swept" in fault.rule


def test_models_without_a_scaled_equation_are_refused():
    named = "the model oscillator has no scaled equation: "
    fault = only_fault(scaled=True, model={"kind": "oscillator"}, initial={"u": 1.0})
    assert fault.rule.startswith(f"{named}u has a number in the place of a parameter")
    assert fault.hint == "write k*u, say, with k under parameters"
    cubic = {"kind": "oscillator", "spring": "k*u**3", "parameters": {"k": 2}}
    fault = only_fault(scaled=True, model=cubic, initial={"u": 1.0})
    assert fault.rule.startswith(f"{named}its spring has no stiffness at u = 0")
    wire = {"kind": "elastic_pendulum", "beta": 0.9, "Theta": 10}
    fault = only_fault(scaled=True, model=wire, initial={})
    assert fault.rule.endswith("it is dimensionless already")


def test_scales_must_be_finite():
    model = {"kind": "pendulum", "g": 1e-300, "L": 1e300}
    assert "no finite values" in only_fault(scaled=True, model=model).rule


def test_scaled_is_true_or_false():
    assert build(scaled=False) == build()
    assert only_fault(scaled="yes").rule == "must be true or false"
    assert len(faults_of(scaled=True, model={"kind": "pendulum", "L": "3 kg"})) == 1


def test_rods_and_ticks():
    """A run in rods and ticks is the run in SI units to round-off (A, section 1.2)."""
    units = {"rod": "4.9 m", "tick": "1/sqrt(2) s"}
    rods = {"kind": "pendulum", "L": "1 rod", "g": "1 rod/tick^2"}
    si = {"kind": "pendulum", "L": 4.9, "g": 9.8}
    bare = {"kind": "pendulum", "L": 1, "g": 1}
    runs = [
        build(
            units=units,
            model=rods,
            time={"end": "20 tick"},
            initial={"theta": 1, "omega": "0.2 rad/tick"},
        ),
        build(
            model=si,
            time={"end": 20 / math.sqrt(2)},
            initial={"theta": 1, "omega": 0.2 * math.sqrt(2)},
        ),
        build(model=bare, time={"end": 20}, initial={"theta": 1, "omega": 0.2}),
    ]
    found = [simulate_record(run, 9) for run in runs]
    theta = [np.squeeze(record["theta"]) for record in found]
    assert theta[0] == pytest.approx(theta[1], rel=0, abs=1e-13)
    assert theta[0] == pytest.approx(theta[2], rel=0, abs=1e-13)
    omega = [np.squeeze(record["omega"]) for record in found]
    assert omega[0] == pytest.approx(math.sqrt(2) * omega[2], rel=0, abs=1e-13)
