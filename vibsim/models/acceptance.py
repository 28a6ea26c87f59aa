"""What a model from outside must satisfy before it is added."""

from __future__ import annotations

import keyword
import re

import numpy as np

from vibsim.core.vocabulary import VECTORS
from vibsim.formula import CONSTANTS, FUNCTIONS, ExpressionError, Negate, is_linear
from vibsim.models.base import (
    Model,
    Output,
    Parameter,
    State,
    parameter_names,
    quantities,
    rate,
    tree,
)
from vibsim.models.shared.identities import NEAR_ONE, zeros

_TAKEN = ("t", "scheme", "case", "level", "status", "end", *VECTORS)
"""Names that have another meaning in files or formulas."""


def fault_of(model: Model) -> str:
    """Return why a model from an installed package cannot be added; empty if it can."""
    if not model.states or len(model.states) != 2 * len(model.accelerations):
        return "it must have a position, a velocity and an acceleration for each coordinate"
    rows: list[State | Parameter | Output] = [*model.states, *model.parameters, *model.outputs]
    names = [row.name for row in rows]
    stored = [*quantities(model, own_velocity=True), *parameter_names(model), *_TAKEN]
    for name in names:
        is_word = keyword.iskeyword(name) or name in FUNCTIONS or name in CONSTANTS
        if is_word or not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name) or stored.count(name) > 1:
            return f"'{name}' cannot be the name of a state, a parameter or an output of it, or is one twice"
    outputs = {output.name: output.formula for output in model.outputs}
    formulas = {
        "kinetic_energy": model.kinetic_energy,
        "potential_energy": model.potential_energy,
        "dissipation": model.dissipation or "0",
        "driving": model.driving or "0",
    }
    pairs = zip(model.positions, model.accelerations, strict=True)
    formulas |= {f"the acceleration of {name}": formula for name, formula in pairs}
    for name, formula in (formulas | outputs).items():
        try:
            tree(model, formula)
        except ExpressionError as error:
            return f"its formula of {name}, {error.text}: {error.rule}"
    defaults = {parameter.key: parameter.default for parameter in model.parameters}
    try:
        np.asarray(model.natural_frequency(defaults), dtype=float)
    except Exception as error:
        return f"its natural_frequency gives no number at its defaults: {type(error).__name__}: {error}"
    # one that is written from a file is not complete yet
    if model.written is None:
        for fault_of_claim in (_fault_of_exact, _fault_of_force, _fault_of_energy):
            if fault := fault_of_claim(model):
                return fault
    # models that may take its place in an experiment
    made = {
        "named": model.named and model.named(model.positions),
        "variant": model.variant and model.variant(frozenset()),
        "written": model.written and model.written({}, ()),
    }
    for name, other in made.items():
        if other is not None and other.kind != model.kind:
            return f"its {name} makes a model of another kind, {other.kind}: leave it out, or write one"
    return ""


def _fault_of_force(model: Model) -> str:
    """Return why a model cannot be linear, as it claims; empty if it can, or claims nothing."""
    if not model.linear:
        return ""
    if not model.is_alone:
        return f"it says linear=True, but has {model.coordinates} coordinates: write linear=False"
    states = [state.name for state in model.states]
    if is_linear(tree(model, model.acceleration), model.position, (*states, "t")):
        return ""
    return (
        f"it says linear=True, but its acceleration is not linear in {model.position} with a constant coefficient: "
        "write linear=False"
    )


def _fault_of_energy(model: Model) -> str:
    """Return how the energies of a model contradict its acceleration; empty if not, or where formulas cannot tell.

    Along a motion the energy changes by the power of driving forces less that of damping.
    """
    claims_powers = model.dissipation is not None or model.driving is not None
    if not (model.conservative or claims_powers) or model.lookup or model.loaded:
        return ""
    energies = (rate(model, tree(model, x)) for x in (model.kinetic_energy, model.potential_energy))
    lost, given = (tree(model, x or "0") for x in (model.dissipation, model.driving))
    ends = {row.name: _range(row) for row in model.parameters}
    states = [state.name for state in model.states]
    if zeros([*energies, lost, Negate(given)], states, {"t": NEAR_ONE, **ends}).all():
        return ""
    if claims_powers:
        return "along its motion the energy does not change by driving minus dissipation: one of them is wrong"
    return (
        "it says conservative=True, but with its acceleration kinetic_energy + potential_energy changes: correct one "
        "of them, or write conservative=False"
    )


def _range(parameter: Parameter) -> tuple[float, float]:
    """Return bounds of numbers near the default of a parameter at which formulas are compared."""
    ends = sorted(x * (parameter.default or 1.0) for x in NEAR_ONE)
    least, most = np.clip(ends, parameter.minimum, parameter.maximum)
    return float(least), float(most)


def _fault_of_exact(model: Model) -> str:
    """Return why the exact motion or period of a model cannot be calculated at its defaults; empty if it can."""
    parameters = {parameter.key: parameter.default for parameter in model.parameters}
    initial = {state.name: 1.0 for state in model.states}
    try:
        if model.exact is not None:
            known = model.exact(np.array([0.0, 0.1]), initial, parameters)
            missing = [name for name in initial if name not in known]
            if missing:
                return f"its exact(t, initial, parameters) returns no {missing[0]}"
        if model.exact_period is not None:
            np.asarray(model.exact_period(initial, parameters), dtype=float)
    except Exception as error:
        # any other error may mean that it is known for other initial values alone
        if isinstance(error, (KeyError, TypeError)):
            rule = "its exact(t, initial, parameters) or exact_period(initial, parameters) fails"
            return f"{rule} where every initial value is 1: {type(error).__name__}: {error}"
    return ""
