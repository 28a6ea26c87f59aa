"""Series over time of one member: what the record holds, what follows from its states, and the exact solution."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.formula import values
from vibsim.models.base import Formula, Model, tree
from vibsim.models.events import Impact
from vibsim.report import data
from vibsim.report.data import Member, pretty_unit
from vibsim.report.types import Experiment
from vibsim.simulation.members import members

ENERGIES = ("energy", "kinetic_energy", "potential_energy")
SMOOTH = 700  # points of an exact solution: with its gaps so few that none is thinned away


def numbers_of(
    experiment: Experiment, record: Record, case: int
) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Return parameters, by their keys in a file, and initial values of a member by its position in the record."""
    index = int(record["case"][case])
    found = members(experiment, index, index + 1)
    parameters, initial = (
        {name: column[0] for name, column in part.items()}
        for part in (found.parameters, found.initial)
    )
    return parameters, initial


def parameters_of(experiment: Experiment, record: Record, case: int) -> dict[str, Floats]:
    """Return the parameters of a member by their names in formulas."""
    found, _ = numbers_of(experiment, record, case)
    return {row.name: found[row.key] for row in experiment.model.definition.parameters}


def on_level(
    experiment: Experiment, record: Record, quantity: str, member: Member, level: int
) -> Floats | None:
    """Return a quantity at the common times of a level, shape (t,); None where it is not known.

    `level` is a position. What the record does not hold is worked out from the states by its formula.
    """
    if f"{quantity}_finest" in record:
        return data.of_level(record, quantity, member, level)
    model = experiment.model.definition
    names = [state.name for state in model.states]
    if any(f"{name}_finest" not in record for name in names):
        return None
    states = {name: data.of_level(record, name, member, level) for name in names}
    return _of_states(experiment, record, quantity, member, states, data.times(record, member.case))


def exact(
    experiment: Experiment, record: Record, quantity: str, member: Member, t: Floats
) -> Floats | None:
    """Return the exact solution at any times; None where the model has none in closed form."""
    model = experiment.model.definition
    if model.exact is None:
        return None
    parameters, initial = numbers_of(experiment, record, member.case)
    states = model.exact(t, initial, parameters)
    if quantity in states:
        return np.asarray(states[quantity])
    return _of_states(experiment, record, quantity, member, states, t)


def exact_curve(
    experiment: Experiment, record: Record, quantity: str, member: Member, end: float = np.inf
) -> tuple[Floats, Floats]:
    """Return the exact solution up to a time, at times of its own where the common ones are few.

    So it is smooth where a level has few points in a period. Where impacts make a velocity jump, it has a gap. Where
    only a reference is known, its times are the common ones.
    """
    t = data.times(record, member.case)
    there = t <= end * (1.0 + 1e-12)
    fine = t[there] if t.size > SMOOTH else np.linspace(t[0], min(end, t[-1]), SMOOTH)
    best = exact(experiment, record, quantity, member, fine)
    if best is None or not np.isfinite(best).any():
        return t[there], data.exact_series(record, quantity, member)[there]
    model = experiment.model.definition
    if isinstance(model.events, Impact) and quantity in model.velocities:
        rises = np.flatnonzero((best[:-1] < 0.0) & (best[1:] >= 0.0))
        fine, best = np.insert(fine, rises + 1, fine[rises]), np.insert(best, rises + 1, np.nan)
    return fine, best


def _of_states(
    experiment: Experiment,
    record: Record,
    quantity: str,
    member: Member,
    states: Mapping[str, Floats],
    t: Floats,
) -> Floats | None:
    """Work out an energy or an output of the model."""
    model = experiment.model.definition
    numbers = {**parameters_of(experiment, record, member.case), **states, "t": t}
    found = [
        np.broadcast_to(values(tree(model, formula), numbers), t.shape)
        for formula in _formulas(model, quantity)
    ]
    return np.sum(found, axis=0) if found else None


def _formulas(model: Model, quantity: str) -> list[Formula]:
    """Return the formulas whose sum is a quantity; none where it has no formula in the states."""
    energies = {"kinetic_energy": model.kinetic_energy, "potential_energy": model.potential_energy}
    if model.loaded is not None:
        # those of a structure are of all its degrees of freedom, which no record holds
        energies = {}
    if quantity == "energy":
        return list(energies.values())
    of_outputs = {row.name: row.formula for row in model.outputs}
    formula = {**energies, **of_outputs}.get(quantity)
    return [] if formula is None else [formula]


def unit_of(experiment: Experiment, record: Record, quantity: str) -> str:
    """Return the unit of a quantity; empty where it has none."""
    if f"{quantity}_finest" in record:
        return data.unit(record, f"{quantity}_finest")
    model = experiment.model.definition
    rows = {state.name: state.unit for state in model.states}
    rows |= {output.name: output.unit for output in model.outputs}
    return pretty_unit(rows.get(quantity, model.energy_unit if quantity in ENERGIES else "1"))
