"""The forces of a model on one side of each of their corners, and pulses of a force between the times of a solution.

Formulas are evaluated by numpy with the modes of their switches held (`vibsim.formula.jumps`). The points of a
table are one more switch, whose mode is the number of the point before the present place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.formula import (
    Binary,
    Expression,
    Number,
    Pulses,
    Switch,
    held,
    hidden_pulses,
    values,
    values_of,
)
from vibsim.models import Model, tree
from vibsim.models.base import looked_up
from vibsim.models.table import BEND, HEIGHT
from vibsim.simulation.reference.collocation import Force

TABLE = "_mode_of_table"
"""Name of the mode of a table."""


@dataclass(frozen=True)
class Sides:
    """A model with the modes of its switches held, and the parameters of some members, each of shape (case,)."""

    model: Model
    formulas: tuple[Expression, ...]
    """Those of `Model.forces`."""
    switches: tuple[Switch, ...]
    parameters: Mapping[str, Floats]

    @cached_property
    def whole(self) -> Flags:
        """Which switches change at every whole number, shape (switch,)."""
        return np.array([switch.whole for switch in self.switches], dtype=bool)

    @cached_property
    def timed(self) -> tuple[int, ...]:
        """Which switches look at the time alone; a change of a mode is no motion."""
        moving = {state.name for state in self.model.states} | {BEND}
        return tuple(
            k for k, switch in enumerate(self.switches) if moving.isdisjoint(switch.quantity.names)
        )

    def borders(self, modes: Floats) -> tuple[Floats, Floats]:
        """Return the least and the largest value that each switch looks at in its mode, shape (switch, case)."""
        whole = self.whole[:, None]
        low = np.where(whole, modes, np.where(modes < 0.0, -np.inf, 0.0))
        return low, np.where(whole, modes + 1.0, np.where(modes < 0.0, 0.0, np.inf))

    def of(self, members: Any) -> Sides:
        """Return the same of some members."""
        return replace(self, parameters={n: x[members] for n, x in self.parameters.items()})

    def force(self, modes: Floats) -> Force:
        """Return the values of the formulas in modes of shape (switch, case)."""

        def found(u: Floats, v: Floats, t: Floats) -> Floats:
            numbers = self.numbers(modes, u, v, t)
            shape = np.broadcast_shapes(u.shape[1:], t.shape)
            rows = values_of(self.formulas, numbers)
            return np.stack([np.broadcast_to(row, shape) for row in rows])

        return found

    def quantity(self, index: int, modes: Floats, u: Floats, v: Floats, t: Floats) -> Floats:
        """Return what one switch looks at, of the shape of the times."""
        numbers = self.numbers(modes, u, v, t)
        return np.broadcast_to(values(self.switches[index].quantity, numbers), t.shape)

    def quantities(self, modes: Floats, u: Floats, v: Floats, t: Floats) -> Floats:
        """Return what all switches look at, shape (switch, time, case)."""
        return np.stack([self.quantity(k, modes, u, v, t) for k in range(len(self.switches))])

    def modes(self, u: Floats, v: Floats, t: Floats) -> tuple[Floats, Floats]:
        """Return what all switches look at, and their modes there, each of shape (switch, *t)."""
        q, modes = np.zeros((2, len(self.switches), *t.shape))
        for k, is_whole in enumerate(self.whole):
            # a switch may look at the modes of those before it
            q[k] = self.quantity(k, modes, u, v, t)
            modes[k] = np.floor(q[k]) if is_whole else np.where(q[k] > 0.0, 0.0, -1.0)
        return q, modes

    def numbers(self, modes: Floats, u: Floats, v: Floats, t: Floats) -> dict[str, Any]:
        """Return what the names in the formulas stand for."""
        numbers = {
            **self.parameters,
            **{switch.mode: mode for switch, mode in zip(self.switches, modes, strict=True)},
            **dict(zip(self.model.positions, u, strict=True)),
            **dict(zip(self.model.velocities, v, strict=True)),
            "t": t,
        }
        return numbers | looked_up(self.model, numbers, numbers.get(TABLE))


@cache
def _held(model: Model) -> tuple[tuple[Expression, ...], tuple[Switch, ...]]:
    """Return the forces with modes held, and their switches, that of the table of the model first."""
    moving = (*(state.name for state in model.states), "t", HEIGHT, BEND)
    formulas, found = held((tree(model, formula) for formula in model.forces), moving)
    if model.lookup is None:
        return formulas, found
    place, table = tree(model, model.lookup.place), model.lookup.table
    way = Binary("-" if table.first >= 0.0 else "+", place, Number(abs(table.first)))
    number = Binary("/", way, Number(table.spacing))
    return formulas, (Switch(number, whole=True, mode=TABLE), *found)


def sides(model: Model, parameters: Mapping[str, Floats]) -> Sides:
    """Return a model with the modes of its switches held; it has none where its forces are smooth."""
    return Sides(model, *_held(model), parameters)


def varies_in_time(model: Model) -> bool:
    """Tell whether the force of a model depends on time otherwise than by a table."""
    return any("t" in tree(model, row).names for row in model.forces)


def pulses_of_force(
    model: Model, parameters: Mapping[str, Floats], states: Floats, t: Floats, *, smooth: bool
) -> Pulses:
    """Find a pulse of the force of every member in time, between the times at which it is looked at.

    Parameters
    ----------
    parameters
        Of the members, each of shape (case,).
    states
        All positions and then all velocities at these times but the last, shape (state, case, gap).
    t
        The times, shape (case, gap + 1), ascending; NaN behind the last one of a member.
    smooth
        Whether the force has what it has on one side of its jumps and corners, those of each time in the middle.
    """
    held = sides(model, {name: x[:, None] for name, x in parameters.items()})
    u, v = np.split(states, 2)
    _, modes = held.modes(u, v, 0.5 * (t[:, :-1] + t[:, 1:]))
    numbers = held.numbers(modes, u, v, t[:, :-1])
    del numbers["t"]
    formulas = held.formulas if smooth else tuple(tree(model, row) for row in model.forces)
    nothing = np.full(len(t), np.nan)
    found = Pulses(nothing, nothing)
    for formula in formulas:
        found = found.and_others(hidden_pulses(formula, numbers, t))
    return found
