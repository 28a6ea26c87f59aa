"""Characteristic scales: in them every model is the same equation with dimensionless numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vibsim.models import MODELS
from vibsim.models.oscillator import written
from vibsim.models.shared.scales import dimensionless, scaled_parameters, scales

FORMULAS = {
    "oscillator": {"spring": "k*u"},
    "vehicle": {"spring": "k*u", "road": "A*sin(phi*x)"},
    "circuit": {"voltage": "A*sin(phi*t)"},
}


def ready(model):
    """Return a model with formulas that can be scaled, where it takes any."""
    return model.written(FORMULAS[model.kind], ("k", "A", "phi")) if model.written else model


READY = [
    ready(model) for model in MODELS.values() if model.written is None or model.kind in FORMULAS
]
SCALED = [model for model in READY if model.scales and model.scales.parameters]
RNG = np.random.default_rng(3)


def sizes(model, parameters, initial):
    return {row.name: float(row.value) for row in scales(model, parameters, initial)}


def numbers(model, parameters, initial):
    return {row.name: float(row.value) for row in dimensionless(model, parameters, initial)}


def test_some_models_can_be_scaled():
    dimensionless_already = {model.kind for model in MODELS.values() if model.dimensionless}
    assert {model.kind for model in SCALED} == set(MODELS) - dimensionless_already


@pytest.mark.parametrize("model", SCALED, ids=lambda model: model.kind)
def test_the_scaled_solution_is_the_solution(model):
    """x(t) = x_c X(t/t_c), and so for the velocity, where X is the exact solution of the scaled equation."""
    for _ in range(20):
        parameters = {row.key: RNG.uniform(0.1, row.maximum or 5.0) for row in model.parameters}
        parameters |= dict.fromkeys(set(model.optional) - {"m"}, 0.0)
        if model.kind == "sliding_box":
            # its solution is known on the linear spring
            parameters["alpha"] = 0.0
        x, v = (state.name for state in model.states)
        initial = {x: RNG.uniform(0.1, 2.0), v: RNG.uniform(-1.0, 1.0)}
        scale = sizes(model, parameters, initial)
        plain = {
            key: float(value)
            for key, value in scaled_parameters(model, parameters, initial).items()
        }
        start = {name: value / scale[name] for name, value in initial.items()}
        t = np.linspace(0.0, 3.0 * scale["t"], 7)
        found = model.exact(t, initial, parameters)
        scaled = model.exact(t / scale["t"], start, plain)
        for name in (x, v):
            assert found[name] == pytest.approx(scale[name] * scaled[name], rel=1e-9, abs=1e-9)
        assert np.all(np.isfinite(found[x]))


@pytest.mark.parametrize("model", SCALED, ids=lambda model: model.kind)
def test_scaled_parameters_are_all_parameters(model):
    parameters = {row.key: 2.0 for row in model.parameters}
    initial = {state.name: 1.0 for state in model.states}
    assert set(scaled_parameters(model, parameters, initial)) == set(parameters)


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_the_velocity_has_the_scale_of_position_over_time(model):
    if model.scales is None:
        return
    found = sizes(
        model,
        {row.key: 2.0 for row in model.parameters},
        dict.fromkeys((s.name for s in model.states), 0.5),
    )
    assert found[model.velocity] == pytest.approx(found[model.position] / found["t"])
    assert set(found) >= {"t", "energy", *(state.name for state in model.states)}


def test_pendulum():
    parameters = {"g": 9.8, "L": 4.9, "m": 2.0, "drag": 0.0}
    found = sizes(MODELS["pendulum"], parameters, {"theta": 1.0, "omega": 0.0})
    wanted = {"t": math.sqrt(0.5), "theta": 1.0, "omega": math.sqrt(2.0), "energy": 2.0 * 9.8 * 4.9}
    assert found == pytest.approx(wanted | {"wire_force": 2.0 * 9.8})


def test_spring():
    """B, section 10.1: u_c = I, or V/w where I = 0; beta = V/(I w)."""
    spring = MODELS["spring"]
    assert sizes(spring, {"w": 2.0}, {"u": -0.5, "v": 0.2})["u"] == 0.5
    assert sizes(spring, {"w": 2.0}, {"u": 0.0, "v": 0.2})["u"] == 0.1
    assert sizes(spring, {"w": 2.0}, {"u": 0.0, "v": 0.0})["u"] == 1.0
    assert numbers(spring, {"w": 2.0}, {"u": 0.5, "v": 0.2})["beta"] == pytest.approx(0.2)


def oscillator(**formulas):
    declared = ("k", "A", "b", "phi")
    return written(formulas, declared)


VALUES = {
    "m": 2.0,
    "parameters.k": 3.0,
    "parameters.A": 0.5,
    "parameters.b": 0.7,
    "parameters.phi": 1.1,
}
INITIAL = {"u": 0.2, "v": 0.1}


@pytest.mark.parametrize(
    "force", ["A*sin(phi*t)", "-A*sin(phi*t)", "cos(phi*t)*A", "sin(t*phi + 1)*A"]
)
def test_driven_oscillator(force):
    """B, section 10.2: beta = A b/(2 m k), gamma = phi sqrt(m/k), and the scaled initial values."""
    model = oscillator(spring="k*u", damping="b*abs(v)*v", force=force)
    found = sizes(model, VALUES, INITIAL) | numbers(model, VALUES, INITIAL)
    assert found["t"] == pytest.approx(math.sqrt(2 / 3))
    assert found["u"] == pytest.approx(0.5 / 3)
    assert found["beta"] == pytest.approx(0.5 * 0.7 / (2 * 2 * 3))
    assert found["gamma"] == pytest.approx(1.1 * math.sqrt(2 / 3))
    assert found["u(0)"] == pytest.approx(0.2 * 3 / 0.5)
    assert found["v(0)"] == pytest.approx(0.1 / 0.5 * math.sqrt(2 * 3))


def test_linear_damping():
    model = oscillator(spring="k*u", damping="b*v")
    assert numbers(model, VALUES, INITIAL)["beta"] == pytest.approx(0.7 / (2 * math.sqrt(6)))
    # without an initial position u_c = V t_c
    assert sizes(model, VALUES, {"u": 0.0, "v": 0.1})["u"] == pytest.approx(0.1 * math.sqrt(2 / 3))


@pytest.mark.parametrize(
    "force", ["A", "A*t", "A*sin(phi*t)*sin(t)", "A*sin(phi*t**2)", "A*sin(phi*t) + 1"]
)
def test_another_force_gives_no_scale(force):
    model = oscillator(spring="k*u", force=force)
    assert sizes(model, VALUES, INITIAL)["u"] == 0.2
    assert "gamma" not in numbers(model, VALUES, INITIAL)


def test_another_damping_gives_no_number():
    assert "beta" not in numbers(oscillator(spring="k*u", damping="b*v**3"), VALUES, INITIAL)
    assert "beta" not in numbers(oscillator(spring="k*u"), VALUES, INITIAL)


@pytest.mark.parametrize(
    "spring", ["k*sin(u)", "k*u + b*u**3", "k*u*(1 + b*u**2)", "k/b*tanh(b*u)"]
)
def test_a_nonlinear_spring_is_measured_by_its_stiffness_at_rest(spring):
    found = sizes(oscillator(spring=spring), VALUES, INITIAL)
    wanted = sizes(oscillator(spring="k*u"), VALUES, INITIAL)
    assert found == pytest.approx(wanted, rel=1e-15)


@pytest.mark.parametrize("spring", ["k*u**3", "k*abs(u)*u", "k*sqrt(u)"])
def test_a_spring_without_stiffness_at_rest_has_no_scales(spring):
    model = oscillator(spring=spring)
    assert scales(model, VALUES, INITIAL) == ()
    assert dimensionless(model, VALUES, INITIAL) == ()
    with pytest.raises(ValueError, match="no scaled equation"):
        scaled_parameters(model, VALUES, INITIAL)


def test_a_spring_that_does_not_pull_back_has_no_time_scale():
    found = sizes(oscillator(spring="k*u"), VALUES | {"parameters.k": -1.0}, INITIAL)
    assert math.isnan(found["t"])


def test_arrays_of_members():
    parameters = {"w": np.array([1.0, 2.0])}
    rows = scales(MODELS["spring"], parameters, {"u": np.array([[0.5], [0.0]]), "v": 1.0})
    assert {np.shape(row.value) for row in rows} <= {(2,), (2, 2)}


def test_formulas_as_they_are_read():
    rows = scales(oscillator(spring="k*u", force="A*sin(phi*t)"), VALUES, INITIAL)
    assert [row.formula for row in rows] == ["sqrt(m/k)", "abs(A)/k", "u_c/t_c", "k*u_c**2"]
    free = scales(MODELS["spring"], {"w": 1.0}, INITIAL)
    assert free[1].formula == "where(u(0) != 0, abs(u(0)), abs(v(0))/w)"


def test_a_parameter_may_have_the_name_of_a_scale():
    model = written({"spring": "t_c*u", "damping": "u_c*v"}, ("t_c", "u_c"))
    values = {"m": 2.0, "parameters.t_c": 8.0, "parameters.u_c": 0.4}
    assert sizes(model, values, INITIAL)["t"] == 0.5
    assert numbers(model, values, INITIAL)["beta"] == pytest.approx(0.4 * 0.5 / 4)


def test_physical_pendulum():
    """That of a point mass is the simple pendulum (B, section 10.5)."""
    model = MODELS["physical_pendulum"].variant(frozenset({"drag"}))
    point = {"inertia": 2.0 * 4.9**2, "m": 2.0, "g": 9.8, "L": 4.9, "drag": 4.8}
    found = sizes(model, point, {"theta": 1.0, "omega": 0.0})
    assert found["t"] == pytest.approx(math.sqrt(0.5))
    assert found["energy"] == pytest.approx(2.0 * 9.8 * 4.9)
    assert numbers(model, point, {"theta": 1.0, "omega": 0.0})["alpha"] == pytest.approx(
        4.8 / 48.02
    )


def test_circuit():
    """t_c = sqrt(L C), and the energy of the coil."""
    found = sizes(MODELS["circuit"], {"L": 2.0, "R": 0.0, "C": 0.5}, {"i": 3.0, "di_dt": 0.0})
    volts = {"capacitor_voltage": 6.0, "source_voltage": 6.0}
    assert found == {"t": 1.0, "i": 3.0, "di_dt": 3.0, "energy": 18.0} | volts


def test_washing_machine():
    """The unbalance drives it: u_c = unbalance speed^2/k, gamma = speed sqrt(m/k)."""
    parameters = {"m": 2.0, "k": 8.0, "b": 0.0, "unbalance": 0.3, "speed": 4.0}
    initial = {"u": 0.0, "v": 0.0}
    assert sizes(MODELS["washing_machine"], parameters, initial)["u"] == pytest.approx(0.3 * 16 / 8)
    assert numbers(MODELS["washing_machine"], parameters, initial)["gamma"] == pytest.approx(2.0)


def test_scaled_parameters_of_the_driven_oscillator():
    """B, equation (85): of m, b, k, A, phi, two are left, beta and gamma."""
    model = oscillator(spring="k*u", damping="b*abs(v)*v", force="A*sin(phi*t)")
    found = scaled_parameters(model, VALUES, INITIAL)
    plain = {key: float(value) for key, value in found.items()}
    assert (plain["m"], plain["parameters.k"], plain["parameters.A"]) == (1.0, 1.0, 1.0)
    assert plain["parameters.b"] / 2 == pytest.approx(0.5 * 0.7 / (2 * 2 * 3))
    assert plain["parameters.phi"] == pytest.approx(1.1 * math.sqrt(2 / 3))


def test_a_number_in_the_place_of_a_parameter_is_named():
    model = oscillator(spring="k*u", force="A*sin(phi*t) + 2*t")
    assert "A*sin(phi*t) + 2*t has a number" in model.scales.refusal
    with pytest.raises(ValueError, match="no scaled equation"):
        scaled_parameters(model, VALUES, INITIAL)
