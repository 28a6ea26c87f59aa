"""Every model against its equation written out by hand: forces, exact solution, energies, every scheme for it."""

import itertools
import math
from collections import Counter
from functools import cache

import numpy as np
import pytest
from model_cases import CASES
from thinned import thinned

from vibsim.formula import evaluate, values
from vibsim.models import MODELS, has_budget, tree
from vibsim.models.base import rate
from vibsim.schemes import FIXED_STEP

EVERY = pytest.mark.parametrize("case", CASES.values(), ids=CASES)


def pairs():
    """Pair every case with a scheme of every family that can treat it: with the one that has had the fewest so far."""
    had = Counter()
    for name, case in CASES.items():
        families = {}
        for scheme in FIXED_STEP.values():
            if scheme.treats(case.model):
                families.setdefault(scheme.family, []).append(scheme)
        for schemes in families.values():
            scheme = min(schemes, key=lambda scheme: had[scheme.kind])
            had[scheme.kind] += 1
            yield pytest.param(case, scheme, id=f"{name}-{scheme.kind}")


PAIRS = list(pairs())
"""What a scheme does with forces of every kind does not depend on the model (`tests/schemes`)."""
T = np.linspace(0.0, 6.0, 61)


def test_every_model_of_the_registry_has_a_case():
    # a structure has no formulas: tests/models/test_structure.py
    by_formulas = {kind: model for kind, model in MODELS.items() if model.loaded is None}
    smooth = {kind for kind, model in by_formulas.items() if model.events is None}
    assert {case.kind for case in CASES.values()} == smooth
    for kind, model in by_formulas.items():
        seen = set()
        for case in CASES.values():
            seen |= {n for n in model.optional if case.kind == kind and case.numbers.get(n)}
        assert seen == set(model.optional)


def named(case):
    model = case.model
    return {p.name: case.parameters[p.key] for p in model.parameters}


def named_states(model, state):
    return {s.name: value for s, value in zip(model.states, state, strict=True)}


@EVERY
def test_the_acceleration_is_the_equation(case):
    model = case.model
    formulas = [tree(model, formula) for formula in model.accelerations]
    rest = np.zeros(len(case.initial))
    for state, t in itertools.product((rest, *case.states()), (0.0, 0.4, 2.1)):
        at = {**named(case), **named_states(model, state), "t": t}
        found = [evaluate(formula, at) for formula in formulas]
        assert found == pytest.approx(case.accelerations(state, t), rel=1e-13, abs=1e-14)


@EVERY
def test_the_exact_solution_is_that_of_the_equation(case):
    model = case.model
    if model.exact is None:
        return
    found = model.exact(T, case.start, case.parameters)
    for state, expected in zip(model.states, case.reference(T), strict=True):
        np.testing.assert_allclose(found[state.name], expected, rtol=0.0, atol=2e-12)


def test_linear_and_free_models_have_an_exact_solution():
    known = {name for name, case in CASES.items() if case.model.exact is not None}
    assert known == {
        "spring", "pendulum", "linear_pendulum", "physical_pendulum", "oscillator-linear",
        "washing_machine", "washing_machine-damped", "vehicle", "circuit", "circuit-driven",
        "duffing", "duffing-wells", "duffing-softening",
        "elastic_pendulum-vertical", "elastic_pendulum-followed", "system-followed",
    }  # fmt: skip


@EVERY
def test_the_exact_period_is_a_period(case):
    model = case.model
    if model.exact_period is None:
        return
    period = float(model.exact_period(case.start, case.parameters))
    now, later = (model.exact(T + shift, case.start, case.parameters) for shift in (0.0, period))
    for name in (model.position, model.velocity):
        np.testing.assert_allclose(later[name], now[name], rtol=0.0, atol=1e-11)
    half = model.exact(np.array([0.0, 0.5 * period]), case.start, case.parameters)
    assert not np.allclose(half[model.position][0], half[model.position][1])


@EVERY
def test_the_energy_changes_by_what_damping_takes_and_forces_give(case):
    """``dE/dt`` along the motion by the derivatives of the formulas, at places and times of all kinds."""
    model = case.model
    states, t = case.states(36).T, np.tile((0.0, 0.4, 2.1), 12)
    at = {**named(case), **named_states(model, states), "t": t}
    change = sum(
        values(rate(model, tree(model, formula)), at)
        for formula in (model.kinetic_energy, model.potential_energy)
    )
    taken, given = (
        0.0 if formula is None else values(tree(model, formula), at)
        for formula in (model.dissipation, model.driving)
    )
    # of the equations of a user, damping is what the power is where no force depends on time
    assert case.kind == "system" or np.all(np.asarray(taken) >= 0.0)
    np.testing.assert_allclose(change, given - taken + np.zeros(t.shape), rtol=0.0, atol=1e-12)
    assert model.conservative == (not has_budget(model))


@EVERY
def test_the_natural_frequency_is_that_of_small_oscillations(case):
    """Twice the stiffness is felt at the bottom of a well."""
    model = case.model
    bottom, step = np.zeros(len(case.initial)), 1e-6
    if case.numbers.get("alpha") == -1.0:
        bottom[0] = math.sqrt(1.0 / case.numbers["beta"])
    slopes = []
    for k in range(case.coordinates):
        aside = step * np.eye(len(bottom))[k]
        there, back = (case.accelerations(bottom + x, 0.0)[k] for x in (aside, -aside))
        slopes.append((there - back) / (2.0 * step))
    found = float(model.natural_frequency(case.parameters))
    if case.coordinates > 1 and case.kind == "system":
        # those of a chain are no diagonal entries (test_system.py)
        assert found**2 <= -slopes[0] <= float(model.highest_frequency(case.parameters)) ** 2
        return
    assert found**2 == pytest.approx(-slopes[0], rel=1e-7)
    if model.highest_frequency is not None:
        highest = float(model.highest_frequency(case.parameters))
        assert highest**2 == pytest.approx(-min(slopes), rel=1e-7)


@EVERY
def test_outputs_are_what_their_names_say(case):
    model, t = case.model, 0.4
    u, v = 0.3, -0.6
    p = named(case)
    state = np.resize((0.3, 1.8, v, 0.8), len(case.initial)) if case.coordinates > 1 else (u, v)
    at = {**p, **named_states(model, state), "t": t}
    found = {row.name: evaluate(tree(model, row.formula), at) for row in model.outputs}
    expected = {}
    if case.kind == "pendulum":
        # the acceleration towards the pivot is L omega^2
        expected["wire_force"] = p["m"] * (p["g"] * math.cos(u) + p["L"] * v * v)
        if p["drag"]:
            expected["drag_force"] = p["m"] * p["L"] * p["drag"] * v * v
    elif case.kind == "physical_pendulum":
        expected["pivot_force"] = p["m"] * (p["g"] * math.cos(u) + p["L"] * v * v)
        if p["drag"]:
            expected["drag_moment"] = p["drag"] * v * v
    elif case.kind == "washing_machine":
        expected["floor_force"] = p["k"] * u + p["b"] * v
    elif case.kind == "vehicle":
        x = p["speed"] * t
        height = 0.2 * math.exp(-x * x) if p["b"] else 0.1 * math.sin(2.0 * x)
        expected |= {"road_height": height, "absolute_position": u + height}
    elif case.kind == "elastic_pendulum":
        # from the pivot at (0, 1) upwards: an angle beyond 90 degrees
        length = math.hypot(0.3, 0.8)
        expected["angle"] = 180.0 - math.degrees(math.atan(0.3 / 0.8))
        expected |= {"wire_length": length}
        expected |= {"wire_force": (length - p["beta"]) / (1.0 - p["beta"])}
        if p["gamma"]:
            expected["drag_force"] = p["gamma"] / p["beta"] ** 2
    elif "outputs.height" in case.formulas:
        expected["height"] = -p["l1"] * math.cos(0.3) - p["l2"] * math.cos(1.8)
    elif "outputs.samples" in case.formulas:
        expected["samples"] = 2.0 * u - v
    elif case.kind == "circuit":
        source = p.get("V0", 0.0) * math.sin(1.7 * t)
        expected |= {"source_voltage": source}
        expected |= {"capacitor_voltage": source - p["L"] * v - p["R"] * u}
    assert found == pytest.approx(expected, rel=1e-13)


def test_every_scheme_solves_models_of_several_kinds():
    seen = Counter(pair.values[1].kind for pair in PAIRS)
    assert {kind for kind, count in seen.items() if count >= 2} == set(FIXED_STEP)


def levels_for(order):
    """Return the steps of two levels whose errors are far from round-off, and the coarser one asymptotic."""
    return {1.0: (1024, 2048), 2.0: (256, 512), 3.0: (96, 192)}.get(order, (48, 96))


@pytest.mark.parametrize(("case", "scheme"), thinned(PAIRS, 5))
def test_every_scheme_converges_to_the_solution_of_the_equation(case, scheme):
    model = case.model

    @cache
    def errors_of(steps):
        run = case.run(scheme, steps, with_gathered=False)
        expected = case.reference(np.linspace(0.0, case.end, steps + 1))
        return np.max(np.abs(run.states[:, 0] - expected), axis=-1)

    for index, state in enumerate(model.states):
        order = scheme.formal_order(state.name, model, scheme.defaults())
        errors = [errors_of(steps)[index] for steps in levels_for(order)]
        if max(errors) == 0.0:
            assert case.initial[index] == 0.0  # straight up and down
            continue
        assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.12)


@pytest.mark.parametrize(
    "model", [model for model in MODELS.values() if model.events], ids=lambda m: m.kind
)
def test_models_with_events_have_no_other_damping(model):
    # what they lose is summed from event to event, and nothing beside it
    assert model.dissipation is None
