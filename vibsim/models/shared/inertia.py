r"""Masses of several coordinates: the kinetic energy ``T = sum_ij M_ij(q) q_i' q_j'/2``, and Lagrange's equations.

``d/dt (dT/dq_i') - dT/dq_i = F_i`` is ``sum_j M_ij q_j'' + sum_jk c_ijk q_j' q_k' = F_i`` with
``c_ijk = (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i)/2``: terms that a mass which depends on the position has beside the
forces. They are solved for the accelerations as formulas, of which common parts are worked out once.

Source: L. D. Landau and E. M. Lifshitz, Mechanics, sections 5 and 10; H. Goldstein, Classical Mechanics, section 1.4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

from vibsim.formula import (
    ONE,
    ZERO,
    Binary,
    Expression,
    Name,
    Number,
    derivative,
    parse,
    tidied,
)
from vibsim.formula.tree import paired

MASS = "mass"


@dataclass(frozen=True)
class Inertia:
    """The masses of a system."""

    positions: tuple[str, ...]
    velocities: tuple[str, ...]
    entries: Mapping[tuple[int, int], Expression]
    """The matrix: its diagonal, and of what stands beside it (i, j) with i < j, where it is not 0."""

    def of(self, i: int, j: int) -> Expression:
        """Return an entry of the matrix."""
        return self.entries.get((min(i, j), max(i, j)), ZERO)

    @cached_property
    def is_plain(self) -> bool:
        """Whether every coordinate has a mass of its own, which depends on no position."""
        named = {name for entry in self.entries.values() for name in entry.names}
        return all(i == j for i, j in self.entries) and named.isdisjoint(self.positions)

    @cached_property
    def kinetic(self) -> Expression:
        """The kinetic energy."""
        v = self.velocities
        terms = [
            Number(0.5) * mass * Binary("**", Name(v[i]), Number(2.0))
            if i == j
            else mass * (Name(v[i]) * Name(v[j]))
            for (i, j), mass in self.entries.items()
        ]
        return paired(terms, partial(Binary, "+"))

    def rest(self, i: int) -> Expression:
        """Return ``sum_jk c_ijk q_j' q_k'``; what cancels by symmetry is left out."""
        found = ZERO
        count = len(self.positions) if self._slopes else 0
        for j in range(count):
            for k in range(j, count):
                if j == k:
                    half = Number(0.5) * self._slope(j, j, i)
                    factor = half if i == j else self._slope(i, j, j) - half
                elif i in (j, k):
                    factor = self._slope(i, i, k if i == j else j)
                else:
                    factor = self._slope(i, j, k) + self._slope(i, k, j) - self._slope(j, k, i)
                if factor != ZERO:
                    speeds = (Name(self.velocities[n]) for n in (j, k))
                    found += factor * Binary("*", *speeds)
        return found

    def accelerations(self, forces: Sequence[Expression]) -> tuple[Expression, ...]:
        """Return the accelerations by some forces."""
        found = [force - self.rest(i) for i, force in enumerate(forces)]
        count, rows = len(found), self._eliminated
        for k in range(count):
            for i in range(k + 1, count):
                if (k, i) in rows:
                    found[i] -= rows[k, i] / rows[k, k] * found[k]
        for k in reversed(range(count)):
            for i in range(k + 1, count):
                found[k] -= rows.get((k, i), ZERO) * found[i]
            found[k] = found[k] / rows[k, k]
        return tuple(found)

    @cached_property
    def pivots(self) -> tuple[Expression, ...]:
        """What must be positive: it is where every motion has a positive kinetic energy."""
        return tuple(self._eliminated[k, k] for k in range(len(self.positions)))

    @cached_property
    def _eliminated(self) -> dict[tuple[int, int], Expression]:
        """The upper triangle of the matrix after elimination, which needs no other order of its rows."""
        rows = {(k, k): ZERO for k in range(len(self.positions))} | dict(self.entries)
        for k in range(len(self.positions)):
            others = [i for i in range(k + 1, len(self.positions)) if (k, i) in rows]
            for i in others:
                factor = rows[k, i] / rows[k, k]
                for j in others[others.index(i) :]:
                    rows[i, j] = rows.get((i, j), ZERO) - factor * rows[k, j]
        return rows

    def _slope(self, i: int, j: int, k: int) -> Expression:
        """Return ``dM_ij/dq_k``."""
        return self._slopes.get((min(i, j), max(i, j), k), ZERO)

    @cached_property
    def _slopes(self) -> dict[tuple[int, int, int], Expression]:
        """Derivatives of the masses, those that are not 0."""
        found = {
            (i, j, k): tidied(derivative(mass, name))
            for (i, j), mass in self.entries.items()
            for k, name in enumerate(self.positions)
            if name in mass.names
        }
        return {place: slope for place, slope in found.items() if slope != ZERO}


def inertia(
    texts: Mapping[str, str],
    positions: tuple[str, ...],
    velocities: tuple[str, ...],
    parameters: Sequence[str],
) -> Inertia:
    """Return the masses of some formulas: ``mass.x`` or ``mass.x.x`` that of x, 1 where none is written, ``mass.x.y``.

    ExpressionError where a formula cannot be read.
    """
    entries: dict[tuple[int, int], Expression] = {(i, i): ONE for i in range(len(positions))}
    for key, text in texts.items():
        field, *names = key.split(".")
        if field == MASS:
            i, j = sorted((positions.index(names[0]), positions.index(names[-1])))
            entries[i, j] = parse(text, (*positions, *parameters))
    return Inertia(positions, velocities, {k: v for k, v in entries.items() if v != ZERO})
