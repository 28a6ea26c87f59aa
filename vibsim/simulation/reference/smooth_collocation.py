"""Smooth motions by equal steps of collocation (`vibsim.simulation.reference.collocation`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibsim.simulation.reference.collocation import (
    STAGES,
    Floats,
    Force,
    added,
    basis,
    integrals,
    stages,
    summed,
    tableau,
)


@dataclass(frozen=True)
class Solved:
    """A solution by steps: states at their starts, and accelerations at the stages."""

    end: Floats
    position: Floats
    """Shape (step, coordinate, case)."""
    velocity: Floats
    acceleration: Floats
    """Shape (step, coordinate, stage, case)."""

    def at(self, fraction: Floats) -> Floats:
        """Return all positions and then all velocities at fractions of the end time, shape (state, case, time)."""
        steps = len(self.position)
        place = fraction * steps
        step = np.minimum(place.astype(np.int64), steps - 1)
        first, second = integrals(place - step)
        h = self.end / steps
        u = self.position[step] + h * (place - step)[:, None, None] * self.velocity[step]
        v = self.velocity[step].copy()
        for j in range(STAGES):
            a = self.acceleration[step, :, j]
            v += h * (first[:, j, None, None] * a)
            u += h * h * (second[:, j, None, None] * a)
        return np.moveaxis(np.concatenate([u, v], axis=1), 0, -1)

    def steps(self) -> tuple[Floats, Floats, Floats]:
        """Return the states where steps begin, (state, case, step), and begins and lengths of steps, (case, step)."""
        count = len(self.position)
        length = np.repeat(self.end[:, None] / count, count, axis=1)
        states = np.concatenate([self.position, self.velocity], axis=1)
        return np.moveaxis(states, 0, -1), length * np.arange(count), length

    def of(self, members: NDArray[np.bool_]) -> Solved:
        """Return the solutions of some members."""
        return Solved(
            self.end[members],
            self.position[..., members],
            self.velocity[..., members],
            self.acceleration[..., members],
        )


def solve(force: Force, start: Floats, end: Floats, steps: int) -> Solved:
    """Take equal steps to the end time of each member; NaN from where the iteration does not end.

    Parameters
    ----------
    start
        All positions and then all velocities at t = 0, shape (state, case).
    end
        End times, shape (case,).
    """
    of = tableau()
    whole_first, whole_second = integrals(np.ones(1))
    ahead = basis(1.0 + of.c)
    h = end / steps
    u, v = np.array(np.split(start, 2))
    count = len(u)
    lost = np.zeros((2, count, len(end)))
    shape = (steps, count, len(end))
    inner = (count, STAGES, len(end))
    kept = Solved(end, np.empty(shape), np.empty(shape), np.empty((steps, *inner)))
    a = np.broadcast_to(force(u[:, None], v[:, None], 0.0 * end), inner)
    for n in range(steps):
        a = stages(force, u, v, (n + of.c[:, None]) * h, h, a)
        kept.position[n], kept.velocity[n], kept.acceleration[n] = u, v, a
        # the rounding of each sum is carried along
        changes = h * v + h * h * summed(whole_second, a)[:, 0], h * summed(whole_first, a)[:, 0]
        u, lost[0] = added(u, changes[0], lost[0])
        v, lost[1] = added(v, changes[1], lost[1])
        a = summed(ahead, a)
    return kept
