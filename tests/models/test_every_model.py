"""What holds for every model of the registry: its formulas, exact solution, period and frequency agree."""

import numpy as np
import pytest

from vibsim.expression import evaluate
from vibsim.models import MODELS, quantities, tree

RNG = np.random.default_rng(11)
EVERY = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)


def formula(model, formula):
    """Return the formula as a function of (u, v, t, parameters)."""
    read = tree(model, formula)

    def value(u, v, t, parameters):
        return evaluate(read, {model.position: u, model.velocity: v, "t": t, **parameters})

    return value


def random_parameters(model):
    return {p.name: (p.minimum or 0.0) + float(RNG.uniform(0.2, 5.0)) for p in model.parameters}


def random_members(model, count=20):
    for _ in range(count):
        initial = dict(
            zip((model.position, model.velocity), RNG.uniform(-2.5, 2.5, 2), strict=True)
        )
        yield {name: float(value) for name, value in initial.items()}, random_parameters(model)


@EVERY
def test_energy_is_conserved_by_the_acceleration(model):
    """``dE/dt = E_u v + E_v a``, by central differences of the energy formulas."""
    if not model.conservative:
        return
    acceleration = formula(model, model.acceleration)
    parts = [formula(model, text) for text in (model.kinetic_energy, model.potential_energy)]
    step = 1e-5
    for initial, parameters in random_members(model):
        u, v = initial.values()

        def energy(u, v, parameters=parameters):
            return sum(part(u, v, 0.0, parameters) for part in parts)

        rate = (energy(u + step, v) - energy(u - step, v)) / (2 * step) * v
        rate += (
            (energy(u, v + step) - energy(u, v - step))
            / (2 * step)
            * acceleration(u, v, 0.0, parameters)
        )
        assert rate == pytest.approx(0.0, abs=1e-7 * (1 + abs(energy(u, v)) * (1 + abs(v))))


@EVERY
def test_exact_solution_obeys_the_equation(model):
    if model.exact is None or model.events is not None:
        return  # see tests/models/test_events_exact.py
    acceleration = formula(model, model.acceleration)
    step = 1e-4
    for initial, parameters in random_members(model):
        start = model.exact(np.zeros(1), initial, parameters)
        for name, value in initial.items():
            assert start[name][0] == pytest.approx(value, abs=1e-12 * (1 + abs(value)))
        middle = float(RNG.uniform(0, 5))
        motion = model.exact(middle + step * np.array([-1.0, 0.0, 1.0]), initial, parameters)
        u, v = motion[model.position], motion[model.velocity]
        scale = 1 + np.max(np.abs(v)) + abs(acceleration(u[1], v[1], middle, parameters))
        w = 1 + float(model.natural_frequency(parameters))
        assert (u[2] - u[0]) / (2 * step) == pytest.approx(v[1], abs=1e-7 * scale * w**2)
        assert (v[2] - v[0]) / (2 * step) == pytest.approx(
            acceleration(u[1], v[1], middle, parameters), abs=1e-6 * scale * w**3
        )


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
        if np.isnan(model.natural_frequency(parameters)):
            assert acceleration(1.0, 0.0, 0.0, parameters) == acceleration(
                0.0, 0.0, 0.0, parameters
            )
            continue
        stiffness = (
            -(acceleration(1e-6, 0.0, 0.0, parameters) - acceleration(-1e-6, 0.0, 0.0, parameters))
            / 2e-6
        )
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
