"""The text of a model's formulas: acceleration, energies, powers and others as functions of ``(u, v, t, p)``."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import partial
from inspect import signature
from typing import Any

from vibsim import formula as expression
from vibsim.core.errors import SimulationError
from vibsim.elementary import ELEMENTARY
from vibsim.engine import crossings, friction, impact
from vibsim.engine.crossings import FREE, coordinates_with_stops, put_free
from vibsim.engine.text import Module, collect
from vibsim.formula import Binary, Call, Compare, Expression, Name, Number
from vibsim.formula.algebra import filled
from vibsim.models import Model
from vibsim.models.base import Formula, parameter_names, tree
from vibsim.models.events import Crossings, Friction, Impact
from vibsim.models.table import BEND, BENDS, HEADER, HEIGHT, HEIGHTS
from vibsim.schemes.base import Stepper

MOST_INLINE = 64
"""Largest number of calls of elementary functions that are inlined: each takes 0.1 s and 3 MB to compile."""
KINDS: Mapping[type, Any] = {Friction: friction, Impact: impact, Crossings: crossings}
"""Module of each kind of events, with its formulas and with the functions that a kernel binds."""
_OF_CONTACTS = ("acceleration", "slopes", "guard_curvatures")
"""Functions whose formulas depend on contacts with stops."""
_TUPLES = ("guards", "guard_rates", "guard_curvatures")
"""Functions that return a tuple even of a single result."""
_MARK = "_"
"""Suffix of the names of states and parameters in a kernel."""


def n_parameters(stepper: Stepper, model: Model) -> int:
    """Return the number of parameters of a member, including the factors of `Stepper.scaling`."""
    return len(model.parameters) + (2 if stepper.scaling else 0)


def n_between(model: Model) -> int:
    """Return the number of entries between the parameters of the model and the factors of `Stepper.scaling`.

    These are mode and start of a model with events, or the table of a model that has one.
    """
    return 2 if model.events is not None else 1 if model.lookup is not None else 0


def put_formulas(
    module: Module,
    model: Model,
    suffix: str,
    stepper: Stepper,
    *,
    is_rare: bool = False,
    with_kinetic: bool = False,
    with_work: bool = False,
) -> None:
    """Write the model's acceleration and energies as functions of ``(u, v, t, p)``, with the functions that they call.

    Parameters
    ----------
    suffix
        ``_fast`` for formulas without branches.
    stepper
        If it is implicit, derivatives are written too; if it has `Stepper.scaling`, forces have a factor.
    is_rare
        Whether elementary functions are called rather than inlined.
    with_kinetic
        Whether the kinetic energy is needed separately.
    with_work
        Whether the powers of damping and of driving forces are needed.
    """
    put = marked(model)
    kind = KINDS.get(type(model.events))
    pushes = kind.accelerations(model, model.events) if kind else model.accelerations
    accelerations = [put(formula) for formula in pushes]
    of_events = kind.formulas(model, model.events) if kind else {}
    formulas = {
        "acceleration": {f"_result_{i}": formula for i, formula in enumerate(accelerations)},
        **{
            function: {result: put(formula) for result, formula in results.items()}
            for function, results in of_events.items()
        },
        "energies": {
            "_kinetic": put(model.kinetic_energy),
            "_potential": put(model.potential_energy),
        },
    }
    if stepper.implicit:
        formulas["slopes"] = {
            f"_slope_{i}_{name}": expression.derivative(formula, name + _MARK)
            for names in (model.positions, model.velocities)
            for i, formula in enumerate(accelerations)
            for name in names
        }
    if "damping_rate" in signature(stepper.step).parameters:
        rate = put(model.damping.rate) if model.damping else Number(0.0)
        formulas["damping_rate"] = {"_rate": rate}
    if with_kinetic:
        formulas["kinetic_energy"] = {"_kinetic": formulas["energies"]["_kinetic"]}
    if with_work:
        formulas["powers"] = {
            "_dissipation": put(model.dissipation or "0.0"),
            "_driving": put(model.driving or "0.0"),
        }
    parts = (part for rows in formulas.values() for part in expression.parts_of(*rows.values()))
    is_rare = is_rare or sum(isinstance(part, Call) for part in parts) > MOST_INLINE
    is_scaled = stepper.scaling is not None
    scaled = ("acceleration", "slopes") if is_scaled else ()
    if model.events and model.events.rows:
        put_free(module, model, model.events.rows)
    put_functions(module, model, suffix, formulas, is_rare=is_rare, scaled=scaled)
    put_parameters(module, model, 2 if is_scaled else 0, tabulated=stepper.tabulated)


def put_energy_with(module: Module, model: Model) -> None:
    """Write the energy at another velocity, which reuses the potential energy unless that depends on the velocity.

    A compiler would find this by itself; the plain lane has none.
    """
    potential = tree(model, model.potential_energy)
    line = "kinetic = kinetic_energy(u, v, t, p)"
    if set(model.velocities) & set(potential.names):
        line = "kinetic, potential = energies(u, v, t, p)"
    module.define("energy_with(u, v, t, p, potential)", line, "return kinetic + potential")


def marked(model: Model) -> Callable[[Formula], Expression]:
    """Return a function that parses a formula and marks its names, so that they cannot clash with names of a kernel."""
    states = (state.name for state in model.states)
    mark = expression.replacing(
        {name: Name(name + _MARK) for name in (*states, *parameter_names(model))}
    )
    return lambda formula: mark(tree(model, formula))


def put_functions(
    module: Module,
    model: Model,
    suffix: str,
    formulas: Mapping[str, Mapping[str, Expression]],
    *,
    is_rare: bool = False,
    scaled: Collection[str] = (),
    always_tuple: bool = False,
) -> None:
    """Write functions of ``(u, v, t, p)``, given by name with the formulas of their results.

    Parameters
    ----------
    scaled
        Functions whose results are multiplied by the first factor of `Stepper.scaling`.
    always_tuple
        Whether functions return a tuple even of a single result.
    """
    names = parameter_names(model)
    unpack = [f"{name}{_MARK} = p[{i}]" for i, name in enumerate(names)]
    arguments = f"{model.position}{_MARK}, {model.velocity}{_MARK}, t, p"
    if model.coordinates > 1:
        arguments = "_u, _v, t, p"
        values = ", ".join(f"_{name}[{k}]" for name in "uv" for k in range(model.coordinates))
        states = ", ".join(f"{state.name}{_MARK}" for state in model.states)
        unpack.insert(0, f"{states} = {values}")
    for function, results in formulas.items():
        lines = list(unpack)
        if model.events is not None and function in ("acceleration", "slopes"):
            lines += [f"{friction.MODE} = p[{len(names)}]", f"t = t + p[{len(names) + 1}]"]
        if model.events is not None and function in _OF_CONTACTS:
            lines += [
                f"{FREE}{i} = free_{i}(p[{len(names)}])"
                for i in coordinates_with_stops(model, model.events.rows)
            ]
        lines += _looking_up(module, model, results.values())
        bind = expression.rebuilding(partial(_with_functions, module, suffix, is_rare))
        ready = {result: bind(formula) for result, formula in results.items()}
        lines += expression.to_statements(ready)
        if function in scaled:
            factor = f"p[{len(names) + n_between(model)}]"
            lines += [f"{result} = {result} * {factor}" for result in ready]
        returned = ", ".join(results)
        if always_tuple or function in _TUPLES:
            returned = f"({returned},)"
        elif model.coordinates > 1 and function == "acceleration":
            returned = f"vector({returned})"
        elif model.coordinates > 1 and function.startswith("crossed_"):
            half = len(results) // 2
            returned = ", ".join(
                f"vector({', '.join(part)})"
                for part in (list(results)[:half], list(results)[half:])
            )
        lines.append(f"return {returned}")
        module.define(f"{function}{suffix}({arguments})", *lines)


def _looking_up(module: Module, model: Model, formulas: Iterable[Expression]) -> list[str]:
    """Return the lines that look up the table of the model, if some formula uses it."""
    used = {name for formula in formulas for name in formula.names}
    if model.lookup is None or not used & {HEIGHT, BEND}:
        return []
    collect(module, looked_up, "looked_up", {})
    place = expression.to_statements({"_place": marked(model)(model.lookup.place)})
    return [*place, f"{HEIGHT}, {BEND} = looked_up(p[{len(model.parameters)}], _place)"]


def looked_up(rows: Any, x: float) -> tuple[float, float]:
    """Return height and second derivative of a table at the place x (`vibsim.models.table`).

    The table is an array that all members share. It is an entry of a member's parameters, so that the text of a kernel
    does not depend on its numbers. Each member reads it between different points, which vector instructions cannot do,
    so such models are not stepped in blocks.

    Parameters
    ----------
    rows
        `vibsim.models.table.Table.rows`; the end pieces are extrapolated.
    """
    spacing = float(rows[HEADER, 1])
    way = (x - float(rows[HEADER, 0])) / spacing
    i = min(max(math.floor(way), 0), rows.shape[1] - 2)
    w = way - i
    h_0, h_1 = float(rows[HEIGHTS, i]), float(rows[HEIGHTS, i + 1])
    q_0, q_1 = float(rows[BENDS, i]), float(rows[BENDS, i + 1])
    line = (1.0 - w) * h_0 + w * h_1
    bow = w * (1.0 - w) * ((2.0 - w) * q_0 + (1.0 + w) * q_1)
    return line - spacing * spacing / 6.0 * bow, (1.0 - w) * q_0 + w * q_1


def put_parameters(module: Module, model: Model, more: int = 0, *, tabulated: bool = False) -> None:
    """Write the function that returns the tuple of a member's parameters, with `more` factors and tabulated points."""
    first = len(model.parameters)
    count = first + more
    places = [f"float(parameters[case, {i}])" for i in range(count)]
    places[first:first] = ["0.0" if model.lookup is None else "table"] * n_between(model)
    values = ", ".join(places) or "0.0"
    if tabulated:
        values += f", parameters[case, {count}:]"
    module.define("parameters_of(parameters, table, case)", f"return ({values},)")


def _with_functions(module: Module, suffix: str, is_rare: bool, node: Expression) -> Expression:
    """Replace a call or power in a formula by a call of the kernel's function, and collect that function."""
    match node:
        case Binary("**", base, exponent):
            value = expression.literal(exponent)
            is_whole = value is not None and value.is_integer()
            power = Call("power", (base, exponent))
            return node if is_whole else _with_functions(module, suffix, is_rare, power)
        case Compare(_, x, y) if suffix:
            # add 0, or NaN if x or y is NaN: the comparison alone would hide the NaN of a fast function
            return filled("node + ((x - x + (y - y)) - (x - x + (y - y)))", node=node, x=x, y=y)
        case Compare():
            # as a number: a bool has no -0, which the fast text may give
            return filled("1*node", node=node)
        case Call(function, arguments):
            if function not in ELEMENTARY:
                raise SimulationError(
                    f"the engine has no function {function}; it has " + ", ".join(ELEMENTARY)
                )
            texts = ELEMENTARY[function]
            text = texts.fast if suffix else texts.full
            collect(module, text, function + suffix, {}, is_called=is_rare)
            return Call(function + suffix, arguments)
    return node
