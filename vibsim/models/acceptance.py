"""What a model from outside must satisfy before it is added."""

from __future__ import annotations

import keyword
import re

import numpy as np

from vibsim.core.vocabulary import VECTORS
from vibsim.formula import CONSTANTS, FUNCTIONS, ExpressionError
from vibsim.models.base import (
    Model,
    Numbers,
    Output,
    Parameter,
    State,
    parameter_names,
    quantities,
    tree,
)

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
    defaults = {parameter.name: parameter.default for parameter in model.parameters}
    try:
        np.asarray(model.natural_frequency(defaults), dtype=float)
    except Exception as error:
        return f"its natural_frequency gives no number at its defaults: {type(error).__name__}: {error}"
    # one that is written from a file is not complete yet
    if model.written is None and (fault := _fault_of_exact(model, defaults)):
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


def _fault_of_exact(model: Model, parameters: Numbers) -> str:
    """Return why the exact motion or period of a model cannot be calculated at these parameters; empty if it can."""
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
