"""Solutions in pieces between the corners of a force: their steps, and the plan of the pieces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.simulation.reference.collocation import STAGES, Floats, integrals

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Plan:
    """The pieces of a walk: their ends, what ends them, and their numbers of steps; shape (piece, case)."""

    end: Floats
    switch: Ints
    """Index of the switch, -1 for the end of the motion."""
    edge: Floats
    """Value of its quantity there."""
    steps: Ints


@dataclass(frozen=True)
class Pieces:
    """A solution by steps of different lengths; NaN behind the last one of a member, and for those without an end."""

    end: Floats
    begin: Floats
    """Start of every step, shape (step, case)."""
    length: Floats
    position: Floats
    """Shape (step, coordinate, case)."""
    velocity: Floats
    acceleration: Floats
    """Shape (step, coordinate, stage, case)."""

    def at(self, fraction: Floats) -> Floats:
        """Return all positions and then all velocities at fractions of the end time, shape (state, case, time)."""
        count = self.position.shape[1]
        found = np.full((2 * count, len(self.end), len(fraction)), np.nan)
        for case, end in enumerate(self.end):
            known = int(np.sum(np.isfinite(self.length[:, case])))
            if known:
                self._put(case, fraction * end, known, found[:, case])
        return found

    def _put(self, case: int, times: Floats, known: int, found: Floats) -> None:
        """Work the states of one member out, some times at a time."""
        begin, count = self.begin[:known, case], len(found) // 2
        for first in range(0, len(times), 4096):
            t = times[first : first + 4096]
            step = np.maximum(np.searchsorted(begin, t, side="right") - 1, 0)
            h = self.length[step, case]
            x = (t - begin[step]) / h
            once, twice = integrals(x)
            v = self.velocity[step, :, case].T
            u = self.position[step, :, case].T + h * x * v
            for j in range(STAGES):
                a = self.acceleration[step, :, j, case].T
                v = v + h * (once[:, j] * a)
                u = u + h * h * (twice[:, j] * a)
            found[:count, first : first + 4096] = u
            found[count:, first : first + 4096] = v

    def steps(self) -> tuple[Floats, Floats, Floats]:
        """Return the states where steps begin, (state, case, step), and begins and lengths of steps, (case, step)."""
        states = np.concatenate([self.position, self.velocity], axis=1)
        return np.moveaxis(states, 0, -1), self.begin.T, self.length.T

    def of(self, members: Flags) -> Pieces:
        """Return the solutions of some members."""
        return Pieces(
            self.end[members],
            self.begin[:, members],
            self.length[:, members],
            self.position[..., members],
            self.velocity[..., members],
            self.acceleration[..., members],
        )


def planned(plan: Plan, members: Flags) -> Plan:
    """Return the plan of some members."""
    return Plan(*(field[:, members] for field in _fields(plan)))


def _fields(plan: Plan) -> Iterator[Any]:
    yield from (plan.end, plan.switch, plan.edge, plan.steps)
