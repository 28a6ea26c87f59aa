"""The models and schemes that an experiment may name: registered ones, and objects passed by a program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from vibsim.models import MODELS, Model
from vibsim.models.shared.coordinates import MOST, coordinate_faults
from vibsim.schemes import SCHEMES, Scheme

COORDINATES = "coordinates"  # key under which a file names the coordinates of its equations


@dataclass(frozen=True)
class Kinds:
    """The valid values of ``kind``."""

    own_models: Mapping[str, Model] = field(default_factory=dict)
    """Models passed as objects, by kind; they take precedence over registered ones."""
    own_schemes: Mapping[str, Scheme] = field(default_factory=dict)

    def model(self, kind: Any) -> Model | None:
        """Return the model of a kind; None if there is none."""
        return self.own_models.get(kind) or MODELS.get(kind) if isinstance(kind, str) else None

    def model_of(self, section: Any) -> Model | None:
        """Return the model of a section ``model``, with the coordinates of the section but without its formulas.

        The result is None if there is no such model, or if the names of the coordinates are invalid.
        """
        content = section if isinstance(section, Mapping) else {}
        model = self.model(content.get("kind"))
        if model is None or model.named is None or content.get(COORDINATES) is None:
            return model
        names = content[COORDINATES]
        if not isinstance(names, list | tuple) or not all(isinstance(x, str) for x in names):
            return None
        are_valid = 0 < len(names) <= MOST and not any(coordinate_faults(names))
        return model.named(tuple(names)) if are_valid else None

    def scheme(self, kind: Any) -> Scheme | None:
        """Return the scheme of a kind; None if there is none."""
        return self.own_schemes.get(kind) or SCHEMES.get(kind) if isinstance(kind, str) else None

    def names(self, section: str | int) -> tuple[str, ...]:
        """Return all kinds of the section ``model`` or ``schemes``, without importing their modules."""
        if section == "model":
            return (*MODELS, *self.own_models)
        return (*SCHEMES, *self.own_schemes)
