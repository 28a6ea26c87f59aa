"""The registry of models; a model is one file of this package and one line here."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from vibsim.models.base import (
    ENERGIES,
    FormulaField,
    Model,
    Parameter,
    State,
    centred,
    natural_end,
    quantities,
    tree,
)
from vibsim.models.bouncing_ball import BOUNCING_BALL
from vibsim.models.linear_pendulum import LINEAR_PENDULUM
from vibsim.models.oscillator import OSCILLATOR
from vibsim.models.pendulum import PENDULUM
from vibsim.models.sliding_box import SLIDING_BOX
from vibsim.models.spring import SPRING

MODELS: Mapping[str, Model] = MappingProxyType(
    {
        model.kind: model
        for model in (PENDULUM, LINEAR_PENDULUM, SPRING, OSCILLATOR, SLIDING_BOX, BOUNCING_BALL)
    }
)

__all__ = [
    "ENERGIES",
    "MODELS",
    "FormulaField",
    "Model",
    "Parameter",
    "State",
    "centred",
    "natural_end",
    "quantities",
    "tree",
]
