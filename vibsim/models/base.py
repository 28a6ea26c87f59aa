"""What a model is: data about an equation of motion, its formulas as text.

A formula is text so that one statement of it serves every reader: the engine compiles it for each lane, sympy
differentiates it, a report prints it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Numbers = Mapping[str, Any]
"""Values by name: floats, or arrays that broadcast against each other."""


@dataclass(frozen=True)
class State:
    """One component of the state."""

    name: str
    unit: str
    long_name: str


@dataclass(frozen=True)
class Parameter:
    """One parameter, with its unit and its bound."""

    name: str
    default: float
    unit: str
    description: str
    minimum: float | None = None
    exclusive: bool = False
    """Whether `minimum` itself is refused."""


@dataclass(frozen=True)
class Model:
    """An equation of motion ``position'' = acceleration(position, velocity, t)``."""

    kind: str
    title: str
    source: str
    equation: str
    states: tuple[State, State]
    """Position and velocity."""
    parameters: tuple[Parameter, ...]
    acceleration: str
    """Formula in the state names, ``t`` and the parameters."""
    kinetic_energy: str
    potential_energy: str
    energy_unit: str
    linear: bool
    conservative: bool
    natural_frequency: Callable[[Numbers], Any]
    """Angular frequency of small oscillations [rad per unit of time], from the parameters."""
    turn: float | None = None
    """The angle after which the position repeats; None where it does not."""
    exact: Callable[[Floats, Numbers, Numbers], dict[str, Floats]] | None = None
    """Exact states at times t, shape (..., n_t), from initial values and parameters of shape (..., 1) or ()."""
    exact_period: Callable[[Numbers, Numbers], Any] | None = None
    """Exact period from initial values and parameters: of an oscillation, or of one turn."""

    @property
    def position(self) -> str:
        """Name of the position."""
        return self.states[0].name

    @property
    def velocity(self) -> str:
        """Name of the velocity."""
        return self.states[1].name


def natural_end(model: Model, periods: float, parameters: Numbers) -> Any:
    """Return the time that a number of natural periods (small oscillations) takes, as a number or an array."""
    return periods * (2.0 * math.pi / model.natural_frequency(parameters))


ENERGIES = ("kinetic_energy", "potential_energy", "energy", "energy_deviation")


def quantities(model: Model, own_velocity: bool = False) -> tuple[str, ...]:
    """Name every quantity of `model` that is stored as a series.

    Parameters
    ----------
    own_velocity
        Whether some scheme has another velocity than the centred difference: then `centred` is stored as well.
    """
    more = centred(model) if own_velocity else ()
    return (*(state.name for state in model.states), *ENERGIES, *more)


def centred(model: Model) -> tuple[str, str, str]:
    """Name the centred difference of the position, ``[D_2t u]``, the energy with it as velocity, and its deviation."""
    return (f"{model.velocity}_d2t", "energy_d2t", "energy_deviation_d2t")
