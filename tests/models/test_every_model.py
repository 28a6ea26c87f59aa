"""What holds for every model of the registry: its formulas, exact solution, period and frequency agree."""

import numpy as np
import pytest

from vibsim.formula import evaluate
from vibsim.models import MODELS, quantities, tree

RNG = np.random.default_rng(11)
# a structure has no formulas: tests/models/test_structure.py
BY_FORMULAS = {kind: model for kind, model in MODELS.items() if model.loaded is None}
EVERY = pytest.mark.parametrize("model", BY_FORMULAS.values(), ids=BY_FORMULAS)


def formula(model, formula):
    """Return the formula as a function of (states, t, parameters)."""
    read = tree(model, formula)
    names = [state.name for state in model.states]

    def value(states, t, parameters):
        return evaluate(read, {**dict(zip(names, states, strict=True)), "t": t, **parameters})

    return value


def random_parameters(model):
    return {p.name: random_parameter(p) for p in model.parameters}


def random_parameter(p):
    if p.maximum is not None and p.minimum is not None:
        return float(RNG.uniform(0.2, 0.8) * (p.maximum - p.minimum) + p.minimum)
    return (p.minimum or 0.0) + float(RNG.uniform(0.2, 5.0))


def random_members(model, count=20):
    for _ in range(count):
        values = RNG.uniform(-2.5, 2.5, len(model.states))
        initial = {state.name: float(x) for state, x in zip(model.states, values, strict=True)}
        yield initial, random_parameters(model)


@EVERY
def test_energy_is_conserved_by_the_acceleration(model):
    """``dE/dt = E_u v + E_v a``, by central differences of the energy formulas."""
    if not model.conservative:
        return
    accelerations = [formula(model, text) for text in model.accelerations]
    parts = [formula(model, text) for text in (model.kinetic_energy, model.potential_energy)]
    step = 1e-5
    for initial, parameters in random_members(model):
        states = np.array(list(initial.values()))

        def energy(states, parameters=parameters):
            return sum(part(states, 0.0, parameters) for part in parts)

        velocities = states[model.coordinates :]
        ways = [*velocities, *(a(states, 0.0, parameters) for a in accelerations)]
        asides = step * np.eye(len(states))
        rate = sum(
            (energy(states + aside) - energy(states - aside)) / (2 * step) * way
            for aside, way in zip(asides, ways, strict=True)
        )
        speed = 1 + max(abs(velocities))
        assert rate == pytest.approx(0.0, abs=1e-7 * (1 + abs(energy(states)) * speed))


@EVERY
def test_exact_solution_obeys_the_equation(model):
    if model.exact is None or model.events is not None:
        return  # see tests/models/test_events_exact.py
    accelerations = [formula(model, text) for text in model.accelerations]
    step = 1e-4
    for initial, parameters in random_members(model):
        if model.coordinates > 1:
            # what is known is one coordinate alone
            initial |= {"x": 0.0, "vx": 0.0}
            initial |= {name: 0.2 * initial[name] for name in ("y", "vy")}
        start = model.exact(np.zeros(1), initial, parameters)
        for name, value in initial.items():
            assert start[name][0] == pytest.approx(value, abs=1e-12 * (1 + abs(value)))
        middle = float(RNG.uniform(0, 5))
        motion = model.exact(middle + step * np.array([-1.0, 0.0, 1.0]), initial, parameters)
        at = [motion[state.name][1] for state in model.states]
        w = 1 + float((model.highest_frequency or model.natural_frequency)(parameters))
        for i, acceleration in enumerate(accelerations):
            u, v = motion[model.positions[i]], motion[model.velocities[i]]
            a = acceleration(at, middle, parameters)
            scale = 1 + np.max(np.abs(v)) + abs(a)
            assert (u[2] - u[0]) / (2 * step) == pytest.approx(v[1], abs=1e-7 * scale * w**2)
            assert (v[2] - v[0]) / (2 * step) == pytest.approx(a, abs=1e-6 * scale * w**3)


@EVERY
def test_exact_solution_repeats_after_the_exact_period(model):
    if model.exact is None or model.exact_period is None:
        return
    t = np.linspace(0, 3, 7)
    for initial, parameters in random_members(model):
        period = float(model.exact_period(initial, parameters))
        now = model.exact(t, initial, parameters)
        later = model.exact(t + period, initial, parameters)
        moved = later[model.position] - now[model.position]
        turns = 0.0 if model.turn is None else np.round(moved / model.turn) * model.turn
        assert np.max(np.abs(turns)) <= (model.turn or 0.0)
        np.testing.assert_allclose(moved, turns, atol=1e-9 * (1 + period))
        np.testing.assert_allclose(
            later[model.velocity], now[model.velocity], atol=1e-8 * (1 + period)
        )


@EVERY
def test_natural_frequency_is_that_of_small_oscillations(model):
    acceleration = formula(model, model.acceleration)
    for _, parameters in random_members(model):
        first = np.eye(len(model.states))[0]
        if np.isnan(model.natural_frequency(parameters)):
            assert acceleration(first, 0.0, parameters) == acceleration(0 * first, 0.0, parameters)
            continue
        ahead, back = (acceleration(x * first, 0.0, parameters) for x in (1e-6, -1e-6))
        stiffness = -(ahead - back) / 2e-6
        assert float(model.natural_frequency(parameters)) ** 2 == pytest.approx(stiffness, rel=1e-6)


@EVERY
def test_the_model_says_what_it_is(model):
    assert model.title
    assert model.source
    assert model.equation
    for item in (*model.states, *model.parameters):
        assert item.unit
    names = [item.name for item in (*model.states, *model.parameters)]
    assert len(set(names)) == len(names)
    assert set(quantities(model)) >= {model.position, model.velocity, "energy_deviation"}
