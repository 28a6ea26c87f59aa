"""A mass of 1 that is not swept is no part of an oscillator's equation, and changes no bit."""

from dataclasses import fields

import numpy as np
import pytest

from vibsim.engine import LANES, integrate
from vibsim.experiment import Experiment
from vibsim.models import tree
from vibsim.models.oscillator import written
from vibsim.schemes import FIXED_STEP

FORMULAS = [
    {"spring": "k*u + u**3", "force": "k*cos(2*t)"},
    {"spring": "k*u", "damping": "k*v"},
    {"spring": "sin(k*u)", "damping": "k*abs(v)*v"},
    {"spring": "k*u", "damping": "v**3/5", "exact": "k + 2*t + t**2"},
]
EVERY = [
    "acceleration",
    "kinetic_energy",
    "potential_energy",
    "dissipation",
    "driving",
]


def runs(model, scheme, lane):
    members = 3
    return integrate(
        model,
        scheme,
        scheme.defaults(),
        np.tile([1.0, 1.3], (members, 1)),
        np.column_stack([np.linspace(0.3, 1.1, members), np.full(members, 0.2)]),
        np.full(members, 0.07),
        20,
        1,
        lane=lane,
    )


@pytest.mark.parametrize(
    "kind",
    [
        "central",
        pytest.param("rk4", marks=pytest.mark.slow),
        "euler_cromer",
        "crank_nicolson",
    ],
)
@pytest.mark.parametrize("formulas", FORMULAS, ids=lambda f: " ".join(f))
def test_both_equations_give_the_same_bits(formulas, kind):
    scheme = FIXED_STEP[kind]
    full = written(formulas, ("k",))
    short = full.variant(frozenset())
    if not scheme.treats(full):
        # the damping is of a kind that only schemes for forces of any velocity take
        assert not scheme.treats(short)
        return
    for lane in LANES if (kind, formulas) == ("rk4", FORMULAS[0]) else ("plain",):
        one, other = (runs(model, scheme, lane) for model in (full, short))
        np.testing.assert_array_equal(one.states, other.states)
        for row in fields(one.gathered):
            pair = (getattr(x.gathered, row.name) for x in (one, other))
            np.testing.assert_array_equal(*pair, err_msg=row.name)


@pytest.mark.parametrize("formulas", FORMULAS, ids=lambda f: " ".join(f))
def test_no_formula_has_the_mass_in_it(formulas):
    short = written(formulas, ("k",)).variant(frozenset())
    found = [getattr(short, name) for name in EVERY if getattr(short, name) is not None]
    assert all("m" not in tree(short, formula).names for formula in found)
    assert short.equation.startswith("u'' + ")
    assert written(formulas, ("k",)).variant(frozenset({"m"})) == written(formulas, ("k",))


TEXT = """
title: t
model: {kind: oscillator, spring: k*u, parameters: {k: 2.0}%s}
initial: {u: 1}
time: {end: 1}
levels: [3]
schemes: [rk4]
"""


@pytest.mark.parametrize(
    ("model", "more", "has_mass"),
    [
        ("", "", False),
        (", m: 1", "", False),
        (", m: 1.5", "", True),
        ("", "sweep: {model.m: [1, 2]}\n", True),
        ("", "sweep: {model.parameters.k: [1, 2]}\n", False),
    ],
)
def test_a_file_decides_by_the_value_and_the_sweep(tmp_path, model, more, has_mass):
    path = tmp_path / "mass.yaml"
    path.write_text(TEXT % model + more)
    definition = Experiment.from_yaml(path).model.definition
    assert ("m" in tree(definition, definition.acceleration).names) is has_mass
