"""Experiments with models and schemes that a program hands over, without any file or registration."""

from __future__ import annotations

import copy
import math
import pickle
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vibsim import Experiment, analyse, best, simulate, theory, verdicts
from vibsim.core import registry
from vibsim.core.errors import Fault, InputError, SimulationError
from vibsim.engine import LANES, integrate
from vibsim.experiment import canonical
from vibsim.models import MODELS, Damping, Model, Parameter, State
from vibsim.schemes import SCHEMES, Flag, Scheme, Stepper
from vibsim.schemes.code_generation import self_starting
from vibsim.schemes.orders import same_orders
from vibsim.schemes.runge_kutta import Tableau, from_tableau

RAYLEIGH = Model(
    kind="rayleigh",
    title="Rayleigh's oscillator",
    source="Rayleigh, The Theory of Sound, section 68a",
    equation="u'' - mu (1 - u'^2) u' + u = 0",
    states=(State("u", "1", "position"), State("v", "1", "velocity")),
    parameters=(Parameter("mu", 1.0, "1", "strength", minimum=0.0),),
    acceleration="mu*(1 - v**2)*v - u",
    kinetic_energy="v**2/2",
    potential_energy="u**2/2",
    energy_unit="1",
    linear=False,
    conservative=False,
    natural_frequency=lambda parameters: np.ones_like(parameters["mu"]),
    dissipation="-mu*(1 - v**2)*v**2",
)
RALSTON = Scheme(
    kind="ralston",
    title="Ralston's method",
    source="Ralston 1962",
    family="Runge-Kutta",
    stepper=lambda options: from_tableau(Tableau((("2/3",),), ("1/4", "3/4"))),
    orders=lambda options: same_orders(2, energy_linear=3, energy_d2t_linear=3),
)


def build(**changes: Any) -> Experiment:
    sections: dict[str, Any] = {
        "model": RAYLEIGH,
        "schemes": [RALSTON],
        "initial": {"u": 0.1},
        "time": {"end": 10.0},
        "levels": [6, 7, 8, 9],
    }
    return Experiment(**{**sections, **changes})


def faults(**changes: Any) -> list[Fault]:
    with pytest.raises(InputError) as refused:
        build(**changes)
    return list(refused.value.faults)


@pytest.fixture(autouse=True)
def _without_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no test pass because of an installed package; messages alone name what those offer."""
    monkeypatch.setattr(registry, "offers", lambda group: {})


def test_a_model_and_a_scheme_in_memory_have_everything_that_registered_ones_have() -> None:
    experiment = build(
        parameters={"mu": 0.5},
        schemes=[RALSTON, {"kind": RALSTON, "label": "again"}, "rk4"],
        sweep={"model.mu": [0.2, 0.5]},
        checks=[{"converges": "u", "order": "scheme"}, {"stable": True}],
    )
    levels = [simulate(experiment, level) for level in experiment.levels]
    ralston, again, rk4 = levels[0].u.values
    assert np.array_equal(ralston, again)
    assert not np.array_equal(ralston, rk4)
    found = verdicts(experiment, analyse(experiment, levels))
    assert [verdict.status for verdict in found] == ["PASS", "PASS"]
    assert best(experiment).sizes["case"] == 2


@pytest.mark.slow
def test_a_natural_frequency_may_be_a_number() -> None:
    """Where it depends on no parameter, nobody thinks of arrays."""
    model = replace(RAYLEIGH, natural_frequency=lambda parameters: 1.0)
    time = {"periods": 2, "steps_per_period": 4}
    sweep = {"model.mu": [0.1, 0.2]}
    found, expected = (build(model=m, time=time, sweep=sweep) for m in (model, RAYLEIGH))
    levels = [simulate(found, level) for level in found.levels]
    (verdict,) = verdicts(found, analyse(found, levels))
    assert verdict.status == "PASS"
    assert np.array_equal(levels[0].u, simulate(expected, 6).u)


@pytest.mark.parametrize(
    "made",
    [
        lambda e: e.alone(1),
        lambda e: e.with_levels([5, 6]),
        lambda e: e.model_copy(),
        copy.deepcopy,
    ],
    ids=["alone", "with_levels", "model_copy", "deepcopy"],
)
def test_an_experiment_made_of_another_one_keeps_its_objects(
    made: Callable[[Experiment], Experiment],
) -> None:
    found = made(build(sweep={"model.mu": [0.2, 0.5]}))
    assert type(found) is Experiment
    assert found.model.definition.acceleration == RAYLEIGH.acceleration
    assert found.schemes[0].method.title == RALSTON.title
    assert simulate(found, 6).u.sizes["t"] == 65


def test_with_registered_names_it_is_the_experiment_of_a_file() -> None:
    sections: dict[str, Any] = {
        "title": "Pendulum",
        "initial": {"theta": "pi/3"},
        "time": {"end": 10.0},
        "levels": [4, 5],
        "schemes": ["rk4"],
    }
    ours = Experiment(model="pendulum", parameters={"L": 2.0}, **sections)
    written = Experiment(model={"kind": MODELS["pendulum"], "L": 2.0}, **sections)
    of_file = Experiment.from_dict({"model": {"kind": "pendulum", "L": 2.0}, **sections})
    assert ours == of_file
    assert canonical(ours) == canonical(of_file) == canonical(written)
    assert pickle.loads(pickle.dumps(ours)) == of_file


def test_two_experiments_may_have_different_models_of_one_name() -> None:
    stronger = replace(
        RAYLEIGH,
        acceleration="2*mu*(1 - v**2)*v - u",
        dissipation="-2*mu*(1 - v**2)*v**2",
    )
    first, second = build(), build(model=stronger)
    before = simulate(first, 6).u.values
    assert simulate(second, 6).u.values[0, 0, -1] != before[0, 0, -1]
    assert np.array_equal(simulate(first, 6).u.values, before)
    assert first != second


def test_options_of_a_scheme_in_memory_are_validated_and_swept() -> None:
    scheme = replace(RALSTON, options=(Flag("careful", "nothing"),))
    section = {"kind": scheme, "careful": True}
    assert build(schemes=[section]).schemes[0].options == {"careful": True}
    swept = build(schemes=[scheme], sweep={"schemes.ralston.careful": [True, False]})
    assert swept.members == 2
    (fault,) = faults(schemes=[{"kind": scheme, "carful": True}])
    assert (fault.key, fault.hint) == ("schemes[0].carful", "did you mean 'careful'?")


@pytest.mark.parametrize(
    ("changes", "key", "rule"),
    [
        ({"parameters": {"nu": 1.0}}, "model.nu", "unknown key"),
        ({"parameters": {"mu": -1.0}}, "model.mu", "must be at least 0"),
        ({"parameters": {"mu": "1 kg"}}, "model.mu", "must be a plain number, but kg is a mass"),
        ({"initial": {"x": 1.0}}, "initial.x", "unknown state"),
        ({"schemes": ["central"]}, "schemes[0]", "cannot treat rayleigh"),
        ({"schemes": RALSTON}, "schemes", "must be a list"),
        ({"schemes": [42]}, "schemes[0]", "must be a mapping with the key kind"),
        ({"model": 42}, "model.kind", "unknown model"),
        ({"checks": [{"converges": "w"}]}, "checks[0].converges", "unknown quantity"),
        ({"steps": 3}, "steps", "unknown key"),
    ],
)
def test_everything_is_checked_as_in_a_file(changes: dict[str, Any], key: str, rule: str) -> None:
    (fault,) = faults(**changes)
    assert fault.key == key
    assert rule in fault.rule


def test_coordinates_of_several_units_make_no_vector() -> None:
    names = ("x", "m"), ("a", "rad"), ("vx", "m s-1"), ("va", "rad s-1")
    model = replace(
        RAYLEIGH,
        states=tuple(State(name, unit, "state") for name, unit in names),
        acceleration="-mu*x",
        further_accelerations=("-a",),
        kinetic_energy="vx**2/2",
        potential_energy="mu*x**2/2",
        dissipation=None,
    )
    start: dict[str, Any] = {"model": model, "initial": {"x": 1.0}, "schemes": ["rk4"]}
    (fault,) = faults(**start, checks=[{"converges": "velocity_vector"}])
    assert fault.key == "checks[0].converges"
    assert fault.rule.endswith("these have several: vx [m s-1], va [rad s-1]")


def test_a_message_offers_what_is_in_memory() -> None:
    assert faults(schemes=[RALSTON, "ralstn"])[0].hint == "did you mean 'ralston'?"
    (fault,) = faults(schemes=[replace(RALSTON, velocity_forces=False)])
    assert "rk4" in fault.hint
    assert "ralston" not in fault.hint


@pytest.mark.parametrize(
    ("changes", "rule"),
    [
        ({"model": replace(RAYLEIGH, kind="pendulum")}, "the name is taken"),
        ({"schemes": [replace(SCHEMES["rk2"], kind="rk4")]}, "the name is taken"),
        ({"schemes": [RALSTON, replace(RALSTON, title="Another")]}, "the name is taken"),
        ({"model": replace(RAYLEIGH, kind="Lord Rayleigh")}, "must consist of a to z"),
        ({"model": replace(RAYLEIGH, acceleration="nu*v")}, "unknown name 'nu'"),
        *(
            (
                {"model": replace(RAYLEIGH, parameters=(Parameter(name, 1.0, "1", "x"),))},
                f"'{name}'",
            )
            for name in ("lambda", "sin", "pi", "t", "u", "energy", "2nd", "case")
        ),
        ({"model": replace(MODELS["pendulum"], kind="mine")}, "another kind, pendulum"),
        ({"model": replace(MODELS["oscillator"], kind="mine")}, "another kind, oscillator"),
        ({"model": replace(RAYLEIGH, dissipation="v*")}, "formula of dissipation"),
        ({"model": replace(RAYLEIGH, states=RAYLEIGH.states[:1])}, "a position, a velocity"),
        ({"model": replace(RAYLEIGH, parameters=[*RAYLEIGH.parameters])}, "write tuples"),
        ({"schemes": [replace(RALSTON, options=[])]}, "write tuples"),
        ({"schemes": [replace(RALSTON, adaptive=True)]}, "cannot be added"),
        ({"schemes": [replace(RALSTON, even_powers=True)]}, "a step back does not undo a step"),
        ({"schemes": [replace(RALSTON, stepper=lambda options: None)]}, "its stepper must"),
        ({"schemes": [replace(RALSTON, orders=lambda options: 2)]}, "its orders must"),
    ],
)
def test_an_object_that_is_no_sound_model_or_scheme_is_refused(
    changes: dict[str, Any], rule: str
) -> None:
    (fault,) = faults(**changes)
    assert rule in fault.rule
    assert fault.file in ("in memory, one of the models", "in memory, one of the schemes")


def test_a_scheme_whose_text_is_not_known_is_refused_by_name() -> None:
    names: dict[str, Any] = {}
    exec("def start(variant, u, v, dt, p, acceleration):\n    return u, v\n", names)
    exec("def step(state, t, dt, p, acceleration):\n    return state, state[1]\n", names)
    stepper = Stepper(names["start"], names["step"])
    with pytest.raises(SimulationError, match="is not known: write it in a file"):
        simulate(build(schemes=[replace(RALSTON, stepper=lambda options: stepper)]), 6)


def test_a_model_with_damping_is_told_how_to_declare_it() -> None:
    damped = replace(
        RAYLEIGH, kind="damped", acceleration="-mu*v - u", linear=True, dissipation="mu*v**2"
    )
    with pytest.raises(InputError) as refused:
        build(model=damped, schemes=["central"])
    (fault,) = refused.value.faults
    told = "cannot treat damped, whose acceleration depends on v and which declares no linear or quadratic damping"
    assert fault.rule == told
    assert "write damping=Damping(kind, rate) in the model" in fault.hint
    declared = replace(damped, damping=Damping("linear", "mu"))
    assert build(model=declared, schemes=["central"]).schemes[0].kind == "central"


def midpoint(state: Any, t: Any, dt: Any, p: Any, acceleration: Any) -> Any:
    u, v = state
    middle = v + 0.498 * dt * acceleration(u, v, t, p)
    a = acceleration(u + 0.498 * dt * v, middle, t + 0.498 * dt, p)
    return (u + dt * middle, v + dt * a), v


def test_a_promise_above_the_order_of_theory_is_not_believed_where_levels_show_it_by_accident() -> (
    None
):
    """The part of first order is half of that of second order, at right angles to it."""
    stepper = self_starting(midpoint)
    wrong = replace(RALSTON, kind="midpoint", stepper=lambda options: stepper)
    experiment = build(
        model="oscillator",
        parameters={
            "spring": "u",
            "force": "cos(2*t)",
            "events": [{"when": "u - 50", "then": {"v": "-v"}}],
        },
        initial={"u": 0.0, "v": 1.0},
        schemes=[wrong],
        checks=[{"converges": name, "order": 2} for name in "uv"],
    )
    found = verdicts(
        experiment, analyse(experiment, [simulate(experiment, n) for n in (6, 7, 8, 9)])
    )
    assert [verdict.status for verdict in found] == ["INCONCLUSIVE", "INCONCLUSIVE"]
    assert all(
        "promises order 2, but without rounding it has order 1 on u'' + w^2 u = 0." in verdict.text
        for verdict in found
    )


def nystrom_too_strong(state: Any, t: Any, dt: Any, p: Any, acceleration: Any) -> Any:
    """Nystroem's method of order 4 with a force that is 1e-6 too large."""
    u, v = state
    a = 1.000001 * acceleration(u, v, t, p)
    b = 1.000001 * acceleration(u + 0.5 * dt * v + dt * dt / 8.0 * a, v, t + 0.5 * dt, p)
    c = 1.000001 * acceleration(u + dt * v + dt * dt / 2.0 * b, v, t + dt, p)
    return (u + dt * v + dt * dt / 6.0 * (a + 2.0 * b), v + dt / 6.0 * (a + 4.0 * b + c)), v


def test_bounds_of_best_values_reach_an_exact_solution_that_the_levels_miss() -> None:
    stepper = self_starting(nystrom_too_strong)
    wrong = replace(RALSTON, kind="nystrom", stepper=lambda options: stepper, velocity_forces=False)
    experiment = build(
        model="pendulum",
        initial={"theta": 2.0, "omega": 0.2},
        schemes=[replace(wrong, orders=lambda options: same_orders(4))],
        checks=[
            {"value": "end", "quantity": "theta", "at": {"level": "best"}, "below": 1.145125},
            {"value": "period", "at": {"level": "best"}, "equals": 8.5, "atol": 1e-3},
        ],
    )
    found = analyse(experiment, [simulate(experiment, level) for level in experiment.levels])
    end, period = verdicts(experiment, found)
    assert "because the levels approach another solution than the exact one" in period.text
    for verdict in (end, period):
        assert verdict.status == "INCONCLUSIVE"
        assert "Finer levels will not help." in verdict.advice
        assert "Add level" not in verdict.advice
    for name in ("theta_end", "theta_min", "omega_max"):
        value, bound = (
            found[f"{name}_{kind}"].item() for kind in ("richardson", "richardson_error")
        )
        exact = found["theta_exact"].isel(t=-1).item() if name == "theta_end" else value
        assert abs(value - exact) < bound
        assert bound > 1e-6
    # an unknown part of a period is of the same origin
    assert np.isnan(found["period_richardson_error"].item())


def start_at_once(variant, u, v, dt, p, acceleration):
    return u, v


def with_step(step: Any) -> Any:
    stepper = Stepper(start_at_once, step)
    return replace(RALSTON, stepper=lambda options: stepper)


def with_cosine(state, t, dt, p, acceleration):
    u, v = state
    return (u + dt * v, v + dt * math.cos(dt) * acceleration(u, v, t, p)), v


def with_rounding(state, t, dt, p, acceleration):
    u, v = state
    return (u + round(dt, 6) * v, v + dt * acceleration(u, v, t, p)), v


def with_root(state, t, dt, p, acceleration):
    u, v = state
    return (u + dt * v, v + (dt * dt) ** 0.5 * acceleration(u, v, t, p)), v


def with_named_power(state, t, dt, p, acceleration):
    u, v = state
    n = 2
    return (u + dt * v + 0.5 * dt**n * acceleration(u, v, t, p), v), v


def without_velocity(state, t, dt, p, acceleration):
    u, v = state
    return u + dt * v, v + dt * acceleration(u, v, t, p)


def with_one_number(state, t, dt, p, acceleration):
    u, v = state
    return (u + dt * v,), v


def without_end(state, t, dt, p, acceleration):
    u, v = state
    while dt < 1.0:
        v = v + 0.0
    return (u + dt * v, v + dt * acceleration(u, v, t, p)), v


@pytest.mark.parametrize(
    ("step", "rule"),
    [
        (with_cosine, "whole powers up to **8, abs and comparisons"),
        (with_rounding, "cannot be run (TypeError"),
        (with_root, "cannot be run (TypeError"),
        (with_named_power, "its with_named_power has dt ** n"),
        (without_velocity, "its step must return the next state"),
        (with_one_number, "its step must return the next state"),
        (without_end, "a loop of the step does not end"),
        (lambda state, t, dt, p, acceleration: (state, state[1]), "not lambda"),
    ],
)
def test_a_step_that_theory_cannot_follow_is_refused_by_name(step: Any, rule: str) -> None:
    """What only floats can do, such as math.cos, passed the experiment and the simulation."""
    (fault,) = faults(schemes=[with_step(step)])
    assert rule in fault.rule
    assert fault.value == RALSTON.kind


def with_power(state, t, dt, p, acceleration):
    u, v = state
    a = acceleration(u, v, t, p)
    return (u + dt * v + 0.5 * dt**2 * a + (u + dt * v) ** 3 * dt**5, v + dt * a), v


def with_products(state, t, dt, p, acceleration):
    u, v = state
    a = acceleration(u, v, t, p)
    w = u + dt * v
    return (
        u + dt * v + 0.5 * (dt * dt) * a + (w * w * w) * (dt * dt * dt * dt * dt),
        v + dt * a,
    ), v


def test_a_power_is_a_product_in_every_lane_and_in_theory() -> None:
    ends = set()
    starts, steps = np.array([[0.3, 0.1], [1.0, 0.7], [0.9, -0.3]]), np.array([0.1, 0.3, 0.7])
    parameters = np.tile([p.default for p in MODELS["spring"].parameters], (3, 1))
    for step in (with_power, with_products):
        scheme = with_step(step)
        for lane in LANES:
            run = integrate(
                MODELS["spring"], scheme, {}, parameters, starts, steps, 9, 1, lane=lane, with_gathered=False
            )  # fmt: skip
            ends.add(run.states.tobytes())
    assert len(ends) == 1
    a, b = (theory.roots(with_step(f).stepper({}), 0.5) for f in (with_power, with_products))
    assert a == b
    build(schemes=[with_step(with_power)])
