"""Characteristic scales of a model, and its dimensionless numbers.

Source: vibration text (B), sections 2.3, 10.1 and 10.2; pendulum lecture (A), section 1.2. A quantity over its scale
is dimensionless: ``t/t_c``, ``u/u_c``, ``v t_c/u_c``, ``E/E_c``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from vibsim.formula import Expression, Name, parse, replacing, to_formula, values
from vibsim.models.base import Formula, Model, Numbers, by_name, parameter_names

T_C, X_C = Name("@t"), Name("@x")
"""The scales of time and position in expressions; no name of a user contains @."""


@dataclass(frozen=True)
class Scales:
    """Formulas in the parameters and the initial values, which have the names of their states.

    All but `time` may use the scale of time, ``t_c``; those after `position` also the scale of the position, ``u_c``.
    """

    time: Formula
    position: Formula
    """If it is 0, nothing moves, and the scale is 1."""
    energy: Formula
    numbers: tuple[tuple[str, Formula], ...] = ()
    """Dimensionless numbers by name."""
    parameters: tuple[tuple[str, Formula], ...] | None = None
    """The parameters of the scaled equation, by key; None if a run cannot be made in these scales."""
    refusal: str = ""
    """Why not, if that is due to a user's formulas."""
    outputs: tuple[tuple[str, Formula], ...] = ()
    """Scales of the model's outputs."""


@dataclass(frozen=True)
class Characteristic:
    """One scale or one dimensionless number."""

    name: str
    """``t``, a state, ``energy`` or an output for a scale; ``u(0)`` for an initial value; or the number's own name."""
    words: str
    formula: str
    unit: str
    value: Any
    """A number or an array over members; NaN if undefined."""


def scales(model: Model, parameters: Numbers, initial: Numbers) -> tuple[Characteristic, ...]:
    """Return the scales of time, position, velocity, energy and outputs; empty if a model has none.

    Parameters
    ----------
    parameters, initial
        Numbers, or arrays that broadcast: by the keys of the parameters and the names of the states.
    """
    spec = model.scales
    if spec is None:
        return ()
    numbers = _numbers(model, spec, parameters, initial)
    x, v = model.states
    with np.errstate(all="ignore"):
        speed = numbers[X_C.name] / numbers[T_C.name]
    formulas = dict(spec.outputs)
    rows = [("energy", "energy", spec.energy, model.energy_unit)]
    rows += [
        (row.name, row.long_name, formulas[row.name], row.unit)
        for row in model.outputs
        if row.name in formulas
    ]
    return (
        Characteristic("t", "time", _text(model, spec.time), "s", numbers[T_C.name]),
        Characteristic(x.name, x.long_name, _text(model, spec.position), x.unit, numbers[X_C.name]),
        Characteristic(v.name, v.long_name, f"{x.name}_c/t_c", v.unit, speed),
        *(
            Characteristic(
                name, words, _text(model, formula), unit, _value(model, formula, numbers)
            )
            for name, words, formula, unit in rows
        ),
    )


def dimensionless(
    model: Model, parameters: Numbers, initial: Numbers
) -> tuple[Characteristic, ...]:
    """Return the scaled initial values and the model's dimensionless numbers; see `scales`."""
    if model.scales is None:
        return ()
    sizes = {row.name: row.value for row in scales(model, parameters, initial)}
    rows = []
    for state in model.states:
        words, text = f"scaled initial {state.long_name}", f"{state.name}(0)/{state.name}_c"
        with np.errstate(all="ignore"):
            ratio = np.asarray(initial[state.name], dtype=np.float64) / sizes[state.name]
        rows.append(Characteristic(f"{state.name}(0)", words, text, "1", ratio))
    numbers = _numbers(model, model.scales, parameters, initial)
    for name, formula in model.scales.numbers:
        value, words = _value(model, formula, numbers), "dimensionless number of the model"
        rows.append(Characteristic(name, words, _text(model, formula), "1", value))
    return tuple(rows)


def scaled_parameters(model: Model, parameters: Numbers, initial: Numbers) -> dict[str, Any]:
    """Return the parameters of the scaled equation by their keys.

    Raises ValueError if the model has no scaled equation.
    """
    spec = model.scales
    if spec is None or spec.parameters is None:
        raise ValueError(f"the model {model.kind} has no scaled equation")
    numbers = _numbers(model, spec, parameters, initial)
    return {key: _value(model, formula, numbers) for key, formula in spec.parameters}


def _numbers(model: Model, spec: Scales, parameters: Numbers, initial: Numbers) -> dict[str, Any]:
    """Return values by name for the formulas: parameters, initial values, scales of time and position."""
    numbers = by_name(model.parameters, parameters) | dict(initial)
    numbers[T_C.name] = _value(model, spec.time, numbers)
    size = _value(model, spec.position, numbers)
    numbers[X_C.name] = np.where(size == 0.0, 1.0, size)
    return numbers


def _tree(model: Model, formula: Formula) -> Expression:
    if not isinstance(formula, str):
        return formula
    named = {"t_c": T_C, f"{model.position}_c": X_C}
    states = [state.name for state in model.states]
    node = parse(formula, (*states, *parameter_names(model), *named))
    return replacing(named)(node)


def _value(model: Model, formula: Formula, numbers: Numbers) -> Any:
    node = _tree(model, formula)
    shape = np.broadcast_shapes(*(np.shape(numbers[name]) for name in node.names))
    return np.broadcast_to(values(node, numbers), shape)


def _text(model: Model, formula: Formula) -> str:
    """Return the text of a formula, with initial values written as ``u(0)``."""
    names = {state.name: Name(f"{state.name}(0)") for state in model.states}
    names |= {T_C.name: Name("t_c"), X_C.name: Name(f"{model.position}_c")}
    return to_formula(replacing(names)(_tree(model, formula)))
