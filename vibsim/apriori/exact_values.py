"""Exact values of derived quantities: from the exact states, from conservation, or from the definition."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.formula import values
from vibsim.models import BUDGET, Model, tree
from vibsim.models.base import Formula, looked_up
from vibsim.simulation.members import Members


def known_values(
    model: Model, name: str, states: Mapping[str, Floats], t: Floats, group: Members
) -> Floats | None:
    """Return the exact values of a quantity other than a state, shape (case, t); None if unknown.

    `states` are the exact states at times `t`, shape (case, t), empty if unknown; `group` are the members.
    """
    if name == BUDGET[2] or (name == "energy_deviation" and model.conservative):
        return np.zeros(t.shape)
    if not states or model.loaded is not None:
        # the observed displacements of a structure do not determine its energy
        return None
    formulas = {
        "kinetic_energy": model.kinetic_energy,
        "potential_energy": model.potential_energy,
        **{row.name: row.formula for row in model.outputs},
    }
    numbers = {**group.by_name(model), **states, "t": t}

    def evaluate(formula: Formula) -> Floats:
        return np.broadcast_to(values(tree(model, formula), numbers), t.shape)

    numbers |= looked_up(model, numbers)
    if name in formulas:
        return evaluate(formulas[name])
    if name in ("energy", "energy_deviation"):
        energy = evaluate(model.kinetic_energy) + evaluate(model.potential_energy)
        return energy if name == "energy" else energy - energy[:, :1]
    return None
