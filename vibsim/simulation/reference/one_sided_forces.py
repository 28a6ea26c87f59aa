"""The forces of a model on one side of each of their corners, and pulses of a force between the times of a solution.

Formulas are evaluated by numpy with fixed modes of their switches (`vibsim.formula.jumps`). The points of a table are
one more switch, whose mode is the index of the point before the current place.
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
    """A model with fixed modes of its switches, and the parameters of members, each of shape (case,)."""

    model: Model
    formulas: tuple[Expression, ...]
    """`Model.forces`, with modes in place of switches."""
    switches: tuple[Switch, ...]
    parameters: Mapping[str, Floats]

    @cached_property
    def whole(self) -> Flags:
        """Whether each switch changes at every integer, shape (switch,)."""
        return np.array([switch.whole for switch in self.switches], dtype=bool)

    @cached_property
    def timed(self) -> tuple[int, ...]:
        """Indices of the switches whose quantity depends on neither states nor a table; it may depend on modes."""
        moving = {state.name for state in self.model.states} | {BEND}
        return tuple(
            k for k, switch in enumerate(self.switches) if moving.isdisjoint(switch.quantity.names)
        )

    def borders(self, modes: Floats) -> tuple[Floats, Floats]:
        """Return the least and the largest value of each switch's quantity in its mode, shape (switch, case)."""
        whole = self.whole[:, None]
        low = np.where(whole, modes, np.where(modes < 0.0, -np.inf, 0.0))
        return low, np.where(whole, modes + 1.0, np.where(modes < 0.0, 0.0, np.inf))

    def of(self, members: Any) -> Sides:
        """Return the same for a subset of the members."""
        return replace(self, parameters={n: x[members] for n, x in self.parameters.items()})

    def force(self, modes: Floats) -> Force:
        """Return the function that evaluates the formulas with these modes, shape (switch, case)."""

        def force(u: Floats, v: Floats, t: Floats) -> Floats:
            numbers = self.numbers(modes, u, v, t)
            shape = np.broadcast_shapes(u.shape[1:], t.shape)
            rows = values_of(self.formulas, numbers)
            return np.stack([np.broadcast_to(row, shape) for row in rows])

        return force

    def quantity(self, index: int, modes: Floats, u: Floats, v: Floats, t: Floats) -> Floats:
        """Return the quantity whose sign or integer part is the mode of a switch, in the shape of the times."""
        numbers = self.numbers(modes, u, v, t)
        return np.broadcast_to(values(self.switches[index].quantity, numbers), t.shape)

    def quantities(self, modes: Floats, u: Floats, v: Floats, t: Floats) -> Floats:
        """Return the quantities of all switches, shape (switch, time, case)."""
        return np.stack([self.quantity(k, modes, u, v, t) for k in range(len(self.switches))])

    def modes(self, u: Floats, v: Floats, t: Floats) -> tuple[Floats, Floats]:
        """Return the quantities and the modes of all switches, each of shape (switch, *t)."""
        q, modes = np.zeros((2, len(self.switches), *t.shape))
        for k, is_whole in enumerate(self.whole):
            # a quantity may depend on the modes of previous switches
            q[k] = self.quantity(k, modes, u, v, t)
            modes[k] = np.floor(q[k]) if is_whole else np.where(q[k] > 0.0, 0.0, -1.0)
        return q, modes

    def numbers(self, modes: Floats, u: Floats, v: Floats, t: Floats) -> dict[str, Any]:
        """Return values by name for the formulas."""
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
    """Return the forces with fixed modes, and their switches; the switch of the model's table is the first."""
    moving = (*(state.name for state in model.states), "t", HEIGHT, BEND)
    formulas, switches = held((tree(model, formula) for formula in model.forces), moving)
    if model.lookup is None:
        return formulas, switches
    place, table = tree(model, model.lookup.place), model.lookup.table
    way = Binary("-" if table.first >= 0.0 else "+", place, Number(abs(table.first)))
    number = Binary("/", way, Number(table.spacing))
    return formulas, (Switch(number, whole=True, mode=TABLE), *switches)


def sides(model: Model, parameters: Mapping[str, Floats]) -> Sides:
    """Return a model with fixed modes of its switches; smooth forces have no switches."""
    return Sides(model, *_held(model), parameters)


def pulses_of_force(
    model: Model, parameters: Mapping[str, Floats], states: Floats, t: Floats, *, smooth: bool
) -> Pulses:
    """Return for every member a pulse of its force in time that lies between the given times, if there is one.

    Parameters
    ----------
    parameters
        Parameters of the members, each of shape (case,).
    states
        All positions and then all velocities at these times but the last, shape (state, case, gap).
    t
        Times, shape (case, gap + 1), ascending, padded with NaN.
    smooth
        Whether to use the smooth force with the modes in the middle of each gap, without its jumps and corners.
    """
    held = sides(model, {name: x[:, None] for name, x in parameters.items()})
    u, v = np.split(states, 2)
    _, modes = held.modes(u, v, 0.5 * (t[:, :-1] + t[:, 1:]))
    numbers = held.numbers(modes, u, v, t[:, :-1])
    del numbers["t"]
    formulas = held.formulas if smooth else tuple(tree(model, row) for row in model.forces)
    none = np.full(len(t), np.nan)
    pulses = Pulses(none, none)
    for formula in formulas:
        pulses = pulses.and_others(hidden_pulses(formula, numbers, t))
    return pulses
