"""Formal orders of a scheme: the powers of dt with which the errors of quantities vanish."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

from vibsim.formula import held
from vibsim.models.base import BUDGET, Model, tree

ORDER_OF_WORK = 4.0
"""Order of the quadrature for the work of forces (`vibsim.simulation.derived`)."""
Beginning = Literal["any", "rest", "balance"]
"""Start of a smooth motion under forces that do not depend on the velocity: ``rest``, from rest under forces that do
not depend on time either; ``balance``, with zero acceleration; ``any`` otherwise."""


@cache
def depends_on_velocity(model: Model) -> bool:
    """Tell whether the acceleration of a model depends on the velocity (between events if it has any)."""
    if model.loaded is not None:
        return model.loaded.is_damped
    return not _names_in_acceleration(model).isdisjoint(model.velocities)


@cache
def is_autonomous(model: Model) -> bool:
    """Tell whether the acceleration of a model does not depend on time."""
    if model.loaded is not None:
        return not model.loaded.is_driven
    return "t" not in _names_in_acceleration(model)


@cache
def is_smooth(model: Model) -> bool:
    """Tell whether the formulas of the acceleration have neither a corner nor a jump, such as that of ``abs(v)*v``."""
    if model.loaded is not None:
        return True
    moving = {*(state.name for state in model.states), "t"}
    _, switches = held((tree(model, formula) for formula in model.accelerations), moving)
    return not switches


def _names_in_acceleration(model: Model) -> frozenset[str]:
    """Return the names in the formulas of the acceleration (between events if the model has any)."""
    events = model.events
    smooth = model.accelerations if events is None else events.smooth(model.accelerations)
    return frozenset(name for formula in smooth for name in tree(model, formula).names)


@dataclass(frozen=True)
class Orders:
    """Powers of dt with which the errors of a scheme vanish; infinite if a quantity is exact.

    The suffix ``_linear`` marks the order on linear, conservative models and on superpositions of such motions.
    """

    position: float
    velocity: float
    energy: float
    energy_linear: float
    velocity_d2t: float | None = None
    """Order of the centred difference ``[D_2t u]``; None: that of the position, at most 2."""
    energy_d2t: float | None = None
    """Order of the energy with that velocity; None: that of the energy, at most 2."""
    energy_d2t_linear: float | None = None
    position_linear: float | None = None
    """Order of the position on a linear, conservative model; None: `position`."""
    velocity_dependent: Orders | None = None
    """Orders if the acceleration depends on the velocity; None: the same."""
    from_rest: Orders | None = None
    """Orders of a motion that begins at rest (`Beginning`); None: the same."""
    from_balance: Orders | None = None
    """Orders of a motion that begins with zero acceleration (`Beginning`); None: the same."""

    def between_events(self, model: Model) -> float:
        """Return the order of every quantity if events are located: the lower of position and velocity.

        After an event the scheme restarts from these two.
        """
        if self.velocity_dependent is not None and depends_on_velocity(model):
            return self.velocity_dependent.between_events(model)
        return min(self.position, self.velocity)

    @property
    def highest(self) -> float:
        """The highest order of position, velocity or energy over all cases above."""
        base = (self.position, self.velocity, self.energy, self.energy_linear)
        others = (self.velocity_dependent, self.from_rest, self.from_balance)
        cases = (case.highest for case in others if case is not None)
        return max(*base, self.position_linear or 0.0, *cases)

    def of(self, quantity: str, model: Model, beginning: Beginning = "any") -> float:
        """Return the order of a state or an energy (`vibsim.models.ENERGIES`), with or without the suffix ``_d2t``."""
        special = {"rest": self.from_rest, "balance": self.from_balance}.get(beginning)
        if special is not None:
            return special.of(quantity, model)
        if self.velocity_dependent is not None and depends_on_velocity(model):
            return self.velocity_dependent.of(quantity, model)
        of_quantity, of_others = _of_quantities(self, model)
        return of_quantity.get(quantity, of_others)


@cache
def _of_quantities(orders: Orders, model: Model) -> tuple[Mapping[str, float], float]:
    """Return orders of a model's quantities by name, and the order of the energy and every quantity not named."""
    is_simple = model.linear and model.conservative
    is_sum = is_simple or model.superposed
    linear = orders.position if orders.position_linear is None else orders.position_linear
    position = linear if is_simple else orders.position
    energy = orders.energy_linear if is_sum else orders.energy
    stated = orders.energy_d2t_linear if is_sum else orders.energy_d2t
    energy_d2t = min(energy, 2.0) if stated is None else stated
    velocity_d2t = min(position, 2.0) if orders.velocity_d2t is None else orders.velocity_d2t
    of_both = min(position, orders.velocity)
    moving = set(model.velocities)
    outputs = {
        row.name: position if moving.isdisjoint(tree(model, row.formula).names) else of_both
        for row in model.outputs
    }
    return {
        **outputs,
        **dict.fromkeys(BUDGET, min(of_both, ORDER_OF_WORK)),
        **dict.fromkeys(model.positions, position),
        **dict.fromkeys(model.velocities, orders.velocity),
        "kinetic_energy": orders.velocity,
        "potential_energy": position,
        **dict.fromkeys((f"{name}_d2t" for name in model.velocities), velocity_d2t),
        "energy_d2t": energy_d2t,
        "energy_deviation_d2t": energy_d2t,
    }, energy


def same_orders(order: float, **others: Any) -> Orders:
    """Return `Orders` with one order for position, velocity and energy, except for fields in `others`."""
    names = ("position", "velocity", "energy", "energy_linear")
    return Orders(**{**dict.fromkeys(names, order), **others})
