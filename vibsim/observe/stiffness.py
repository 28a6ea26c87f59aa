"""The frequency and the decay rate that steps must resolve, measured along the motion.

Small oscillations about 0 have the natural frequency. With a nonlinear spring it is used if the motion is about as
stiff for part of the time. Otherwise (a motion about another place, a formula that is singular at 0) the mean stiffness
along the motion replaces it: ``w^2 = mean of -da/du``, NaN if that is not positive.

Damping reduces velocities at the rate ``-da/dv``. Even if that is large only for a moment, an implicit scheme with long
steps keeps velocities that should have decayed, so the largest rate along the motion counts.

The motion is the exact one if it is known, otherwise that of the finest level, at the common times.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.formula import derivative, values
from vibsim.models.base import Formula, Model, looked_up, tree
from vibsim.observe.common_grid import Grid, take
from vibsim.observe.thresholds import A_WHILE
from vibsim.simulation.members import Members


def applies(model: Model) -> bool:
    """Tell whether the frequency is measured along the motion: one coordinate, a nonlinear force, no events."""
    return not model.linear and model.is_alone and model.events is None


@dataclass(frozen=True)
class Motion:
    """The motion of members, with the data that formulas need."""

    model: Model
    grid: Grid
    finest: Record
    group: Members
    exact: Mapping[str, Floats]

    def fall(self, acceleration: Formula, state: str, states: Mapping[str, Floats]) -> Floats:
        """Return minus the derivative of an acceleration with respect to a state, in the shape of the states."""
        slope = derivative(tree(self.model, acceleration), state)
        times = self.grid.times(self.group.end)
        numbers = {**self.group.by_name(self.model), **states, "t": times}
        numbers |= looked_up(self.model, numbers)
        return np.broadcast_to(-values(slope, numbers), np.shape(states[state]))


def stiffest(motion: Motion) -> Floats:
    """Return the angular frequency that steps must resolve, shape (case,), from the first scheme that did not fail."""
    model, finest = motion.model, motion.finest
    natural = np.asarray(finest["natural_frequency"], dtype=np.float64)
    if not applies(model):
        return natural
    scheme = np.argmin(np.asarray(finest["status"]) != 0, axis=0)
    states = {}
    for state in model.states:
        computed = take(motion.grid, finest, state.name)[scheme, np.arange(len(scheme))]
        exact = np.asarray(motion.exact.get(state.name, computed))
        is_known = np.isfinite(exact).all(axis=-1, keepdims=True)
        states[state.name] = np.where(is_known, exact, computed)
    stiffness = motion.fall(model.acceleration, model.position, states)
    known = np.isfinite(stiffness)
    count = np.maximum(np.count_nonzero(known, axis=-1), 1)
    with np.errstate(all="ignore"):
        usual = np.count_nonzero(stiffness >= 0.25 * natural[:, None] ** 2, axis=-1)
        mean = np.sum(np.where(known, stiffness, 0.0), axis=-1) / count
        of_motion = np.sqrt(np.where(mean > 0.0, mean, np.nan))
    return np.where((natural > 0.0) & (usual >= A_WHILE * count), natural, of_motion)


def is_damped(model: Model) -> bool:
    """Tell whether the force depends on velocities."""
    velocities = set(model.velocities)
    return any(not velocities.isdisjoint(tree(model, row).names) for row in model.accelerations)


def decay_rate(motion: Motion) -> Floats:
    """Return the largest rate at which damping reduces a velocity, 0 without damping, shape (scheme, case)."""
    model, fastest = motion.model, np.zeros(np.shape(motion.finest["status"]))
    if not is_damped(model):
        return fastest
    states = {}
    for state in model.states:
        computed = take(motion.grid, motion.finest, state.name)
        exact = np.asarray(motion.exact.get(state.name, computed))
        states[state.name] = np.where(np.isfinite(exact), exact, computed)
    with np.errstate(all="ignore"):
        for row, velocity in zip(model.accelerations, model.velocities, strict=True):
            rate = motion.fall(row, velocity, states)
            largest = np.max(np.where(np.isfinite(rate), rate, 0.0), axis=-1)
            fastest = np.maximum(fastest, largest)
    return fastest
