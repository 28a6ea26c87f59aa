"""The registry of models; a model is one file of this package and one line here."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from vibsim.models.base import (
    ENERGIES,
    Model,
    Parameter,
    State,
    centred,
    natural_end,
    quantities,
)
from vibsim.models.linear_pendulum import LINEAR_PENDULUM
from vibsim.models.pendulum import PENDULUM
from vibsim.models.spring import SPRING

MODELS: Mapping[str, Model] = MappingProxyType(
    {model.kind: model for model in (PENDULUM, LINEAR_PENDULUM, SPRING)}
)

__all__ = [
    "ENERGIES",
    "MODELS",
    "Model",
    "Parameter",
    "State",
    "centred",
    "natural_end",
    "quantities",
]
