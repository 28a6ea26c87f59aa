"""The registry of models; a model is one file of this package and one line here, or comes with an installed package."""

from __future__ import annotations

from vibsim.core.registry import Registry
from vibsim.models.acceptance import fault_of
from vibsim.models.base import (
    BUDGET,
    ENERGIES,
    Damping,
    FormulaField,
    Model,
    Output,
    Parameter,
    State,
    centred,
    has_budget,
    has_solution,
    natural_end,
    quantities,
    table_end,
    tree,
)
from vibsim.models.bouncing_ball import BOUNCING_BALL
from vibsim.models.circuit import CIRCUIT
from vibsim.models.duffing import DUFFING
from vibsim.models.elastic_pendulum import ELASTIC_PENDULUM
from vibsim.models.linear_pendulum import LINEAR_PENDULUM
from vibsim.models.oscillator import OSCILLATOR
from vibsim.models.pendulum import PENDULUM
from vibsim.models.physical_pendulum import PHYSICAL_PENDULUM
from vibsim.models.sliding_box import SLIDING_BOX
from vibsim.models.spring import SPRING
from vibsim.models.structure import STRUCTURE
from vibsim.models.system import SYSTEM
from vibsim.models.vehicle import VEHICLE
from vibsim.models.washing_machine import WASHING_MACHINE

_ALL = (
    SPRING,
    PENDULUM,
    LINEAR_PENDULUM,
    PHYSICAL_PENDULUM,
    OSCILLATOR,
    SLIDING_BOX,
    WASHING_MACHINE,
    VEHICLE,
    BOUNCING_BALL,
    CIRCUIT,
    DUFFING,
    ELASTIC_PENDULUM,
    SYSTEM,
    STRUCTURE,
)
MODELS = Registry("vibsim.models", Model, _ALL, fault_of)

__all__ = [
    "BUDGET",
    "ENERGIES",
    "MODELS",
    "Damping",
    "FormulaField",
    "Model",
    "Output",
    "Parameter",
    "State",
    "centred",
    "has_budget",
    "has_solution",
    "natural_end",
    "quantities",
    "table_end",
    "tree",
]
