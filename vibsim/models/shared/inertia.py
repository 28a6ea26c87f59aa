r"""Mass matrix of several coordinates: the kinetic energy ``T = sum_ij M_ij(q) q_i' q_j'/2``, and Lagrange's equations.

``d/dt (dT/dq_i') - dT/dq_i = F_i`` is ``sum_j M_ij q_j'' + sum_jk c_ijk q_j' q_k' = F_i`` with the Christoffel symbols
``c_ijk = (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i)/2``, which vanish if masses do not depend on positions. The equations
are solved for the accelerations symbolically; kernels evaluate common subexpressions once.

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
    """The mass matrix of a system."""

    positions: tuple[str, ...]
    velocities: tuple[str, ...]
    entries: Mapping[tuple[int, int], Expression]
    """Entries (i, j) of the matrix with i <= j that are not 0."""

    def of(self, i: int, j: int) -> Expression:
        """Return an entry of the matrix."""
        return self.entries.get((min(i, j), max(i, j)), ZERO)

    @cached_property
    def is_plain(self) -> bool:
        """Whether the matrix is diagonal and does not depend on positions."""
        names = {name for entry in self.entries.values() for name in entry.names}
        return all(i == j for i, j in self.entries) and names.isdisjoint(self.positions)

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
        """Return ``sum_jk c_ijk q_j' q_k'``, without terms that cancel by symmetry."""
        total = ZERO
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
                    total += factor * Binary("*", *speeds)
        return total

    def accelerations(self, forces: Sequence[Expression]) -> tuple[Expression, ...]:
        """Return the accelerations under given forces, by elimination."""
        x = [force - self.rest(i) for i, force in enumerate(forces)]
        count, rows = len(x), self._eliminated
        for k in range(count):
            for i in range(k + 1, count):
                if (k, i) in rows:
                    x[i] -= rows[k, i] / rows[k, k] * x[k]
        for k in reversed(range(count)):
            for i in range(k + 1, count):
                x[k] -= rows.get((k, i), ZERO) * x[i]
            x[k] = x[k] / rows[k, k]
        return tuple(x)

    @cached_property
    def pivots(self) -> tuple[Expression, ...]:
        """The pivots: all are positive if and only if the matrix is positive definite."""
        return tuple(self._eliminated[k, k] for k in range(len(self.positions)))

    @cached_property
    def _eliminated(self) -> dict[tuple[int, int], Expression]:
        """The upper triangle of the matrix after elimination; no pivoting is needed."""
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
        """Derivatives ``dM_ij/dq_k`` that are not 0, by (i, j, k)."""
        slopes = {
            (i, j, k): tidied(derivative(mass, name))
            for (i, j), mass in self.entries.items()
            for k, name in enumerate(self.positions)
            if name in mass.names
        }
        return {place: slope for place, slope in slopes.items() if slope != ZERO}


def inertia(
    texts: Mapping[str, str],
    positions: tuple[str, ...],
    velocities: tuple[str, ...],
    parameters: Sequence[str],
) -> Inertia:
    """Return the mass matrix from formulas: ``mass.x`` or ``mass.x.x`` (1 if missing) and ``mass.x.y`` (0 if missing).

    Raises ExpressionError if a formula cannot be parsed.
    """
    entries: dict[tuple[int, int], Expression] = {(i, i): ONE for i in range(len(positions))}
    for key, text in texts.items():
        field, *names = key.split(".")
        if field == MASS:
            i, j = sorted((positions.index(names[0]), positions.index(names[-1])))
            entries[i, j] = parse(text, (*positions, *parameters))
    return Inertia(positions, velocities, {k: v for k, v in entries.items() if v != ZERO})
