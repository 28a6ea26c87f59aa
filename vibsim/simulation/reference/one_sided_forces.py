"""The forces of a model on one side of each of their corners, for the reference
(`vibsim.simulation.reference.piecewise_collocation`).

Formulas are evaluated by numpy with the modes of their switches held (`vibsim.formula.jumps`). The points of a
table are one more switch, whose mode is the number of the point before the present place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.formula import Binary, Expression, Number, Switch, held, names_in, values
from vibsim.models import Model, tree
from vibsim.models.table import BEND, Lookup
from vibsim.simulation.reference.collocation import Floats, Force

TABLE = "_mode_of_table"
"""Name of the mode of a table."""


@dataclass(frozen=True)
class Sides:
    """A model with the modes of its switches held, and the parameters of some members, each of shape (case,)."""

    model: Model
    formulas: tuple[Expression, ...]
    """The accelerations."""
    switches: tuple[Switch, ...]
    parameters: Mapping[str, Floats]

    @property
    def whole(self) -> NDArray[np.bool_]:
        """Which switches change at every whole number, shape (switch,)."""
        return np.array([switch.whole for switch in self.switches], dtype=bool)

    @property
    def timed(self) -> tuple[int, ...]:
        """Which switches look at the time alone; a change of a mode is no motion."""
        moving = {state.name for state in self.model.states} | {BEND}
        return tuple(
            k
            for k, switch in enumerate(self.switches)
            if moving.isdisjoint(names_in(switch.quantity))
        )

    def of(self, members: NDArray[Any]) -> Sides:
        """Return the same of some members."""
        return replace(self, parameters={n: x[members] for n, x in self.parameters.items()})

    def force(self, modes: Floats) -> Force:
        """Return the accelerations in modes of shape (switch, case)."""

        def found(u: Floats, v: Floats, t: Floats) -> Floats:
            numbers = self.numbers(modes, u, v, t)
            shape = np.broadcast_shapes(u.shape[1:], t.shape)
            return np.stack([np.broadcast_to(values(row, numbers), shape) for row in self.formulas])

        return found

    def quantity(self, index: int, modes: Floats, u: Floats, v: Floats, t: Floats) -> Floats:
        """Return what one switch looks at, of the shape of the times."""
        numbers = self.numbers(modes, u, v, t)
        return np.broadcast_to(values(self.switches[index].quantity, numbers), t.shape)

    def quantities(self, modes: Floats, u: Floats, v: Floats, t: Floats) -> Floats:
        """Return what all switches look at, shape (switch, time, case)."""
        rows = [self.quantity(k, modes, u, v, t) for k in range(len(self.switches))]
        return np.stack(rows)

    def numbers(self, modes: Floats, u: Floats, v: Floats, t: Floats) -> dict[str, Any]:
        """Return what the names in the formulas stand for."""
        numbers = {
            **self.parameters,
            **{switch.mode: mode for switch, mode in zip(self.switches, modes, strict=True)},
            **dict(zip(self.model.positions, u, strict=True)),
            **dict(zip(self.model.velocities, v, strict=True)),
            "t": t,
        }
        lookup = self.model.lookup
        if lookup is None:
            return numbers
        place = values(tree(self.model, lookup.place), numbers)
        return {**numbers, BEND: lookup.table.read(place, numbers[TABLE])[1]}


@cache
def _held(model: Model) -> tuple[tuple[Expression, ...], tuple[Switch, ...]]:
    moving = (*(state.name for state in model.states), "t", BEND)
    return held((tree(model, formula) for formula in model.accelerations), moving)


@cache
def switches(model: Model) -> tuple[Switch, ...]:
    """Return the switches of a model's accelerations, that of its table first; none where they are smooth."""
    found = _held(model)[1]
    if model.lookup is None:
        return found
    return (_of_table(model, model.lookup), *found)


def _of_table(model: Model, lookup: Lookup) -> Switch:
    """Return the switch at the points of a table."""
    place, first = tree(model, lookup.place), lookup.table.first
    sign = "-" if first >= 0.0 else "+"
    way = Binary(sign, place, Number(abs(first)))
    return Switch(Binary("/", way, Number(lookup.table.spacing)), whole=True, mode=TABLE)


def sides(model: Model, parameters: Mapping[str, Floats]) -> Sides:
    """Return a model with the modes of its switches held."""
    return Sides(model, _held(model)[0], switches(model), parameters)
