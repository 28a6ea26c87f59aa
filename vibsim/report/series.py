"""Series over time of one member: stored, computed from its states by a formula, or exact."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.formula import values
from vibsim.models.base import Formula, Model, by_name, tree
from vibsim.report.data import Ladder, Results, pretty_unit
from vibsim.simulation.members import members

ENERGIES = ("energy", "kinetic_energy", "potential_energy")
SMOOTH = 700  # points of an exact solution: few enough, with its gaps, that thinning removes none


def numbers_of(record: Results, case: int) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Return the parameters, by their keys in the file, and the initial values of the member at position `case`."""
    index = int(record["case"][case])
    one = members(record.experiment, index, index + 1)
    parameters = {name: column[0] for name, column in one.parameters.items()}
    return parameters, {name: column[0] for name, column in one.initial.items()}


def parameters_of(record: Results, case: int) -> dict[str, Floats]:
    """Return the parameters of a member by their names in formulas."""
    by_key, _ = numbers_of(record, case)
    return by_name(record.model.parameters, by_key)


def on_level(ladder: Ladder, level: int) -> Floats | None:
    """Return a quantity on a level at the common times, shape (t,); None if it is neither stored nor computable.

    `level` is a position. A quantity that the record lacks is computed from the states by its formula.
    """
    if "finest" in ladder:
        return ladder.on_level(level)
    states = [ladder.of(state.name) for state in ladder.record.model.states]
    if any("finest" not in state for state in states):
        return None
    return _derived(ladder, {one.quantity: one.on_level(level) for one in states}, ladder.t)


def exact(ladder: Ladder, t: Floats) -> Floats | None:
    """Return the exact solution at any times; None if the model has none in closed form."""
    model = ladder.record.model
    if model.exact is None:
        return None
    parameters, initial = numbers_of(ladder.record, ladder.case)
    states = model.exact(t, initial, parameters)
    if ladder.quantity in states:
        return np.asarray(states[ladder.quantity])
    return _derived(ladder, states, t)


def exact_curve(ladder: Ladder, end: float = np.inf, start: float = 0.0) -> tuple[Floats, Floats]:
    """Return times and values of the exact solution between two times, on a finer grid if the common times are few.

    So the curve is smooth even if a level has few points in a period. It has a gap where an impact makes a velocity
    jump. If only a reference is known, its times are the common ones.
    """
    t = ladder.t
    there = (t >= start) & (t <= end * (1.0 + 1e-12))
    is_fine = int(there.sum()) > SMOOTH
    fine = t[there] if is_fine else np.linspace(max(start, t[0]), min(end, t[-1]), SMOOTH)
    best = exact(ladder, fine)
    if best is None or not np.isfinite(best).any():
        return t[there], ladder.exact[there]
    model = ladder.record.model
    if model.events is not None and ladder.quantity in model.events.changed(model.velocities):
        rises = np.flatnonzero((best[:-1] < 0.0) & (best[1:] >= 0.0))
        fine, best = np.insert(fine, rises + 1, fine[rises]), np.insert(best, rises + 1, np.nan)
    return fine, best


def _derived(ladder: Ladder, states: Mapping[str, Floats], t: Floats) -> Floats | None:
    """Compute an energy or an output of the model from its states."""
    model = ladder.record.model
    numbers = {**parameters_of(ladder.record, ladder.case), **states, "t": t}
    terms = [
        np.broadcast_to(values(tree(model, formula), numbers), t.shape)
        for formula in _formulas(model, ladder.quantity)
    ]
    return np.sum(terms, axis=0) if terms else None


def _formulas(model: Model, quantity: str) -> list[Formula]:
    """Return the formulas whose sum is a quantity; empty if it has no formula in the states."""
    energies = {"kinetic_energy": model.kinetic_energy, "potential_energy": model.potential_energy}
    if model.loaded is not None:
        # the energies of a structure need all its degrees of freedom, which no record stores
        energies = {}
    if quantity == "energy":
        return list(energies.values())
    outputs = {row.name: row.formula for row in model.outputs}
    formula = {**energies, **outputs}.get(quantity)
    return [] if formula is None else [formula]


def unit_of(ladder: Ladder) -> str:
    """Return the unit of a quantity; empty if it has none."""
    model, quantity = ladder.record.model, ladder.quantity
    if "finest" in ladder:
        return ladder.unit()
    rows = {state.name: state.unit for state in model.states}
    rows |= {output.name: output.unit for output in model.outputs}
    return pretty_unit(rows.get(quantity, model.energy_unit if quantity in ENERGIES else "1"))
