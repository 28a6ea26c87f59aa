r"""The formulas of a system that a user writes, and what follows from them.

Energy: kinetic ``sum M_ij v_i v_j/2`` and a potential V, unless a user writes them. V is minus the work, from the
origin, of the terms of the forces that depend on positions alone,
``-sum_i int_0^(x_i) F_i(x_1, ..., x_(i-1), s, 0, ..., 0) ds``, if rules can integrate it and its gradient gives these
terms; otherwise V is 0. The power of everything else follows from the equations, ``P = dE/dt``, and a system is
conservative if P vanishes. Terms of forces that contain the time drive; the rest of P is dissipated. Both conditions
are tested numerically at random states and parameters, because equal functions may have different formulas. A formula
with corners or jumps is tested on every side of them.

Frequencies are those of small oscillations about the origin, ``w^2`` the positive eigenvalues of ``-da/dx`` at t = 0.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.formula import (
    ZERO,
    Expression,
    Name,
    derivative,
    has_rule,
    integral,
    parse,
    put,
    values_of,
)
from vibsim.formula.algebra import terms_of
from vibsim.formula.tree import paired
from vibsim.models.base import Numbers, Parameter, by_name, declared_parameters, speeds
from vibsim.models.events import Crossings
from vibsim.models.shared.coordinates import velocities_of
from vibsim.models.shared.crossings import crossings
from vibsim.models.shared.identities import NEAR_ONE, zeros
from vibsim.models.shared.inertia import Inertia, inertia
from vibsim.models.shared.manufactured import Manufactured
from vibsim.models.table import HEIGHT, Lookup

INPUT = "input"
"""Name of the table's current value in formulas."""


@dataclass(frozen=True)
class WrittenSystem:
    """The parsed formulas of a user."""

    coordinates: tuple[str, ...]
    formulas: Mapping[str, str]
    declared: tuple[str, ...]
    lookup: Lookup | None = None

    @cached_property
    def velocities(self) -> tuple[str, ...]:
        """Names of the velocities."""
        return velocities_of(self.coordinates)

    @cached_property
    def states(self) -> tuple[str, ...]:
        """All positions, then all velocities."""
        return (*self.coordinates, *self.velocities)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """The declared parameters."""
        return declared_parameters(self.declared)

    def read(self, key: str, default: str = "") -> Expression:
        """Return a formula by its key, or `default` if the user wrote none."""
        known = (*self.states, "t", *self.declared)
        if self.lookup is None:
            return parse(self.formulas.get(key, default), known)
        return put(parse(self.formulas.get(key, default), (*known, INPUT)), INPUT, Name(HEIGHT))

    def terms(self, name: str) -> list[Expression]:
        """Return the terms of a sum in their order; empty if the user wrote none."""
        keys = [key for key in self.formulas if key.partition(".")[0] == name]
        return [self.read(key) for key in sorted(keys, key=lambda key: int(key.partition(".")[2]))]

    @cached_property
    def inertia(self) -> Inertia:
        """The mass matrix; the mass is 1 if accelerations are written."""
        return inertia(self.formulas, self.coordinates, self.velocities, self.declared)

    @cached_property
    def forces(self) -> tuple[Expression, ...]:
        """The forces, or the accelerations if these are written."""
        field = "force" if f"force.{self.coordinates[0]}" in self.formulas else "acceleration"
        return tuple(self.read(f"{field}.{name}", f"-{name}") for name in self.coordinates)

    @cached_property
    def own_accelerations(self) -> tuple[Expression, ...]:
        """The accelerations without the additional forces of a manufactured solution."""
        return self.inertia.accelerations(self.forces)

    @cached_property
    def crossings(self) -> Crossings | None:
        """The events, if any are written."""
        return crossings(self.formulas, (*self.states, "t", *self.declared))

    @cached_property
    def manufactured(self) -> Manufactured | None:
        """The manufactured solution, if it is written."""
        keys = [f"exact.{name}" for name in self.coordinates]
        if keys[0] not in self.formulas:
            return None
        texts = tuple(self.formulas[key] for key in keys)
        return Manufactured(tuple(map(self.read, keys)), texts, self.states, self.parameters)

    @cached_property
    def accelerations(self) -> tuple[Expression, ...]:
        """The accelerations."""
        own, motion = self.own_accelerations, self.manufactured
        if motion is None:
            return own
        return tuple(a + push for a, push in zip(own, motion.forces(own), strict=True))

    @cached_property
    def kinetic(self) -> Expression:
        """The kinetic energy."""
        if terms := self.terms("kinetic"):
            return paired(terms, operator.add)
        return self.inertia.kinetic

    @cached_property
    def position_forces(self) -> list[Expression]:
        """The sum of the terms of every force that depend on neither velocities nor time."""
        moving = {*self.velocities, "t", HEIGHT}
        return [
            sum((term for term in terms_of(whole) if moving.isdisjoint(term.names)), ZERO)
            for whole in self.forces
        ]

    @property
    def misses_potential(self) -> bool:
        """Tell whether there are forces that depend on positions alone, but no potential energy is known."""
        acts = any(not force.names.isdisjoint(self.coordinates) for force in self.position_forces)
        return acts and self.potential == ZERO and not self.terms("potential")

    @cached_property
    def potential(self) -> Expression:
        """The potential energy; 0 if none is known."""
        if terms := self.terms("potential"):
            return paired(terms, operator.add)
        total, forces = [], self.position_forces
        for i, (name, force) in enumerate(zip(self.coordinates, forces, strict=True)):
            for later in self.coordinates[i + 1 :]:
                if later in force.names:
                    force = put(force, later, ZERO)
            if not has_rule(force, name):
                return ZERO
            work = integral(force, name)
            total.append(-work)
        found: Expression = paired(total, operator.add)
        slopes = (derivative(found, name) for name in self.coordinates)
        sums = ([slope, force] for slope, force in zip(slopes, forces, strict=True))
        return found if all(map(self.vanishes, sums)) else ZERO

    @cached_property
    def powers(self) -> tuple[Expression, ...]:
        """The terms of the power ``dE/dt``."""
        return self._powers(self.accelerations)

    def _powers(self, accelerations: tuple[Expression, ...]) -> tuple[Expression, ...]:
        found = (
            derivative(energy, name) * speed
            for name, speed in speeds(self.coordinates, self.velocities, accelerations)
            for energy in (self.kinetic, self.potential)
        )
        return tuple(term for term in found if term != ZERO)

    @cached_property
    def damped_and_driven(self) -> dict[str, Expression]:
        """The power that is lost, and that of the terms of the forces that name the time or the table.

        Beside an exact solution, and for a kinetic energy that is written, all is one power.
        """
        power, moving = paired(self.powers, operator.add), {"t", HEIGHT}
        if moving.isdisjoint(power.names):
            return {"dissipation": -power}
        if self.manufactured is not None or self.terms("kinetic"):
            return {"driving": power}
        driving, rest = ZERO, []
        for force, velocity in zip(self.forces, self.velocities, strict=True):
            terms = list(terms_of(force))
            pushes = [term for term in terms if not moving.isdisjoint(term.names)]
            driving += sum(pushes, ZERO) * Name(velocity)
            rest.append(sum((term for term in terms if moving.isdisjoint(term.names)), ZERO))
        left = self._powers(self.inertia.accelerations(rest))
        lost = {} if self.vanishes(left) else {"dissipation": -paired(left, operator.add)}
        return {"driving": driving, **lost}

    def is_constant(self, node: Expression) -> bool:
        """Tell whether a formula depends on parameters alone."""
        return {*self.states, "t", HEIGHT}.isdisjoint(node.names)

    def vanishes(self, terms: Any) -> bool:
        """Tell whether a sum is 0 at all test points where it is finite, and finite at one at least."""
        others = dict.fromkeys(("t", HEIGHT, *self.declared), NEAR_ONE)
        are_zeros = zeros(terms, self.states, others)
        return bool(are_zeros.any() and are_zeros.all())

    @cached_property
    def stiffness(self) -> dict[tuple[int, int], Expression]:
        """Entries of ``-da/dx`` that are not 0, by row and column."""
        return self.minus_jacobian(self.coordinates)

    @cached_property
    def couplings(self) -> dict[tuple[int, int], Expression]:
        """Entries of ``-da/dv`` that are not 0, by row and column."""
        return self.minus_jacobian(self.velocities)

    def minus_jacobian(self, states: Sequence[str]) -> dict[tuple[int, int], Expression]:
        """Return the nonzero entries of minus the Jacobian of the accelerations with respect to `states`."""
        found = {
            (i, j): -derivative(a, name)
            for i, a in enumerate(self.own_accelerations)
            for j, name in enumerate(states)
        }
        return {place: entry for place, entry in found.items() if entry != ZERO}

    def frequencies(self, parameters: Numbers) -> Floats:
        """Return the angular frequencies of small oscillations, increasing, padded with NaN, shape (..., n).

        Gyroscopic coupling of velocities (with opposite signs, as in a magnetic field or a rotating frame) is included;
        damping is not.
        """
        numbers = by_name(self.parameters, parameters)
        shape = np.broadcast_shapes(*map(np.shape, numbers.values()))
        at_origin = dict.fromkeys((*self.states, "t", HEIGHT), np.zeros(()))
        count = len(self.coordinates)
        stiffness, coupling = np.zeros((2, *shape, count, count))
        for matrix, formulas in ((stiffness, self.stiffness), (coupling, self.couplings)):
            entries = values_of(list(formulas.values()), numbers | at_origin)
            for (i, j), entry in zip(formulas, entries, strict=True):
                matrix[..., i, j] = entry
        # NaN for matrices that are not finite
        is_known = np.isfinite(stiffness).all(axis=(-2, -1), keepdims=True)
        squares = np.linalg.eigvals(np.where(is_known, stiffness, 0.0))
        largest = np.max(np.abs(squares), axis=-1, keepdims=True)
        is_one = (squares.real > 1e-12 * largest) & (np.abs(squares.imag) <= 1e-9 * largest)
        found = np.sort(np.sqrt(np.where(is_one, squares.real, np.nan)), axis=-1)
        # gyroscopic terms have opposite signs; damping, also on the diagonal, has equal signs
        turning = np.where(coupling * np.swapaxes(coupling, -1, -2) < 0.0, coupling, 0.0)
        is_known = is_known[..., 0, 0] & np.isfinite(turning).all(axis=(-2, -1))
        turns = (is_known & np.any(turning, axis=(-2, -1)))[..., None]
        if not turns.any():
            return found
        return np.where(turns, _of_first_order(stiffness, turning, turns), found)

    def natural_frequency(self, parameters: Numbers) -> Any:
        """Return the lowest frequency; NaN if there is none."""
        return self.frequencies(parameters)[..., 0]

    def highest_frequency(self, parameters: Numbers) -> Any:
        """Return the highest frequency; NaN if there is none."""
        return np.fmax.reduce(self.frequencies(parameters), axis=-1)


def _of_first_order(stiffness: Floats, turning: Floats, known: Flags) -> Floats:
    """Return the frequencies of ``x'' + G x' + K x = 0``, increasing, padded with NaN, shape (..., n)."""
    still = np.zeros_like(stiffness)
    rows = [[still, still + np.eye(stiffness.shape[-1])], [-stiffness, -turning]]
    matrix = np.where(known[..., None], np.block(rows), 0.0)
    rates = np.linalg.eigvals(matrix)
    largest = np.max(np.abs(rates), axis=-1, keepdims=True)
    is_one = (rates.imag > 1e-6 * largest) & (np.abs(rates.real) <= 1e-9 * largest)
    found = np.sort(np.where(is_one, rates.imag, np.nan), axis=-1)
    return np.asarray(found[..., : stiffness.shape[-1]])
