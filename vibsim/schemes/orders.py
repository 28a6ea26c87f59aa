"""The orders that a scheme promises: powers of dt with which the errors of quantities vanish."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

from vibsim.models.base import BUDGET, Model, tree
from vibsim.models.events import Friction

ORDER_OF_WORK = 4.0
"""Order of the sum by which the work of forces is found (`vibsim.simulation.derived`)."""
Beginning = Literal["any", "rest", "balance"]
"""How a smooth motion begins whose forces do not depend on the velocity: at rest, where they do not depend on time
either; with no acceleration; or in any other way."""


@cache
def depends_on_velocity(model: Model) -> bool:
    """Tell whether the acceleration of a model depends on the velocity; between events, where there are some."""
    if model.loaded is not None:
        return model.loaded.is_damped
    return not _named(model).isdisjoint(model.velocities)


@cache
def is_autonomous(model: Model) -> bool:
    """Tell whether the acceleration of a model does not depend on time."""
    if model.loaded is not None:
        return not model.loaded.is_driven
    return "t" not in _named(model)


def _named(model: Model) -> frozenset[str]:
    """Return what the acceleration names; between events, where there are some."""
    events = model.events
    smooth = (events.drive,) if isinstance(events, Friction) else model.accelerations
    return frozenset(name for formula in smooth for name in tree(model, formula).names)


@dataclass(frozen=True)
class Orders:
    """Powers of dt with which the errors of a scheme vanish, infinite where a quantity is exact.

    Those of the energy differ between a linear, conservative model, or a sum of such motions, and any other one.
    """

    position: float
    velocity: float
    energy: float
    energy_linear: float
    velocity_d2t: float | None = None
    """Of the centred difference ``[D_2t u]``; None: that of the position, 2 at most."""
    energy_d2t: float | None = None
    """Of the energy with that velocity; None: that of the energy, 2 at most."""
    energy_d2t_linear: float | None = None
    position_linear: float | None = None
    """Of the position of a linear, conservative model; None: that of any other one."""
    velocity_dependent: Orders | None = None
    """What is promised instead where the acceleration depends on the velocity; None: the same."""
    from_rest: Orders | None = None
    """What is promised instead of a motion that begins at rest (`Beginning`); None: the same."""
    from_balance: Orders | None = None
    """What is promised instead of a motion that begins with no acceleration (`Beginning`); None: the same."""

    def between_events(self, model: Model) -> float:
        """Return the order of every quantity where events are located: the lower one of position and velocity.

        Of these two the scheme starts anew.
        """
        if self.velocity_dependent is not None and depends_on_velocity(model):
            return self.velocity_dependent.between_events(model)
        return min(self.position, self.velocity)

    @property
    def highest(self) -> float:
        """The highest order of position, velocity or energy in any case: of models, damping and beginnings."""
        own = (self.position, self.velocity, self.energy, self.energy_linear)
        others = (self.velocity_dependent, self.from_rest, self.from_balance)
        cases = (case.highest for case in others if case is not None)
        return max(*own, self.position_linear or 0.0, *cases)

    def of(self, quantity: str, model: Model, beginning: Beginning = "any") -> float:
        """Return the order of a state or an energy (`vibsim.models.ENERGIES`), or of either with ``_d2t`` behind it."""
        special = {"rest": self.from_rest, "balance": self.from_balance}.get(beginning)
        if special is not None:
            return special.of(quantity, model)
        if self.velocity_dependent is not None and depends_on_velocity(model):
            return self.velocity_dependent.of(quantity, model)
        of_quantity, of_others = _of_quantities(self, model)
        return of_quantity.get(quantity, of_others)


@cache
def _of_quantities(orders: Orders, model: Model) -> tuple[Mapping[str, float], float]:
    """Return the orders of quantities of a model, and that of its energy and whatever is not named."""
    is_simple = model.linear and model.conservative
    is_sum = is_simple or model.superposed
    linear = orders.position if orders.position_linear is None else orders.position_linear
    position = linear if is_simple else orders.position
    energy = orders.energy_linear if is_sum else orders.energy
    given = orders.energy_d2t_linear if is_sum else orders.energy_d2t
    energy_d2t = min(energy, 2.0) if given is None else given
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
    """Return one order for position, velocity and energy, but for what is named."""
    names = ("position", "velocity", "energy", "energy_linear")
    return Orders(**{**dict.fromkeys(names, order), **others})
