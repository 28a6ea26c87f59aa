"""The models and schemes that an experiment may name: registered ones, and those that a program hands over."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from vibsim.models import MODELS, Model
from vibsim.models.system import MOST, coordinate_faults
from vibsim.schemes import SCHEMES, Scheme

COORDINATES = "coordinates"
"""The key under which a file names the coordinates of its equations."""


@dataclass(frozen=True)
class Kinds:
    """What ``kind`` may name."""

    own_models: Mapping[str, Model] = field(default_factory=dict)
    """Given in memory, by kind; they come before those that are registered."""
    own_schemes: Mapping[str, Scheme] = field(default_factory=dict)

    def model(self, kind: Any) -> Model | None:
        """Return the model of a kind; None where there is none."""
        return self.own_models.get(kind) or MODELS.get(kind) if isinstance(kind, str) else None

    def model_of(self, section: Any) -> Model | None:
        """Return the model that a section ``model`` describes, with the coordinates that it names, but no formulas.

        None where there is no such model, or its coordinates cannot have these names.
        """
        given = section if isinstance(section, Mapping) else {}
        found = self.model(given.get("kind"))
        if found is None or found.named is None or given.get(COORDINATES) is None:
            return found
        names = given[COORDINATES]
        if not isinstance(names, list | tuple) or not all(isinstance(x, str) for x in names):
            return None
        is_sound = 0 < len(names) <= MOST and not any(coordinate_faults(names))
        return found.named(tuple(names)) if is_sound else None

    def scheme(self, kind: Any) -> Scheme | None:
        """Return the scheme of a kind; None where there is none."""
        return self.own_schemes.get(kind) or SCHEMES.get(kind) if isinstance(kind, str) else None

    def names(self, section: str | int) -> tuple[str, ...]:
        """Name every kind of the section ``model`` or ``schemes``; nothing is imported for that."""
        if section == "model":
            return (*MODELS, *self.own_models)
        return (*SCHEMES, *self.own_schemes)
