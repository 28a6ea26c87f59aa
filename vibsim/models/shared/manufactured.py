r"""Manufactured solutions: a prescribed motion, and the forces with which it solves the equations.

Source: vibration text (B), section 2.2, and exercises 1, 9 and 23.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.formula import Expression, derivative, replacing, values
from vibsim.models.base import Numbers, Parameter, by_name


@dataclass(frozen=True)
class Manufactured:
    """A motion prescribed by formulas in ``t`` and the parameters."""

    positions: tuple[Expression, ...]
    """Position of every coordinate."""
    texts: tuple[str, ...]
    """The positions as the user wrote them, for display."""
    names: tuple[str, ...]
    """The states: all positions, then all velocities."""
    parameters: tuple[Parameter, ...]

    @cached_property
    def velocities(self) -> tuple[Expression, ...]:
        """Derivatives of the positions."""
        return tuple(derivative(u, "t") for u in self.positions)

    @cached_property
    def accelerations(self) -> tuple[Expression, ...]:
        """Derivatives of the velocities."""
        return tuple(derivative(v, "t") for v in self.velocities)

    def along(self, formula: Expression) -> Expression:
        """Return a formula in the states, evaluated along the motion: it depends on ``t`` and the parameters."""
        motion = zip(self.names, (*self.positions, *self.velocities), strict=True)
        return replacing(dict(motion))(formula)

    def forces(self, accelerations: Sequence[Expression]) -> tuple[Expression, ...]:
        """Return what must be added to the accelerations so that the motion solves the equations."""
        pairs = zip(self.accelerations, accelerations, strict=True)
        return tuple(exact - self.along(formula) for exact, formula in pairs)

    def exact(self, t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
        """Return the states at times `t`, independent of the initial values: see `Model.exact`."""
        numbers = {**by_name(self.parameters, parameters), "t": t}
        shape = np.broadcast_shapes(*(np.shape(value) for value in numbers.values()))
        motion = zip(self.names, (*self.positions, *self.velocities), strict=True)
        return {name: np.broadcast_to(values(row, numbers), shape) for name, row in motion}

    def start(self, parameters: Numbers) -> dict[str, Any]:
        """Return the initial values: see `Model.start`."""
        return self.exact(np.asarray(0.0), {}, parameters)
