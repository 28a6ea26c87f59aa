"""The frequency and the decay that a step has to resolve: those of the place where the motion is.

Small oscillations about 0 have the natural frequency. Of a nonlinear spring it counts where the motion is as stiff for
a while; elsewhere (a motion about another place, a formula that is singular at 0) the mean stiffness along the motion
takes its place: ``w^2 = mean of -da/du``, NaN where it does not pull back in the mean.

Damping takes velocities away at the rate ``-da/dv``. Where that is large for a moment only, an implicit scheme with
long steps keeps what should have gone within it: the largest rate along the motion counts.

The motion is that of the finest level at the common times; exact states, of shape (case, t), take its place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.formula import derivative, values
from vibsim.models.base import Formula, Model, tree
from vibsim.observe.common_grid import Grid, take
from vibsim.observe.thresholds import A_WHILE
from vibsim.simulation.members import Members


def applies(model: Model) -> bool:
    """Tell whether the motion of a model decides on the frequency: one coordinate, a nonlinear force, no events."""
    return not model.linear and model.is_alone and model.events is None


@dataclass(frozen=True)
class Motion:
    """The motion of some members, with what its formulas need."""

    model: Model
    grid: Grid
    finest: Record
    group: Members
    exact: Mapping[str, Floats]

    def fall(self, acceleration: Formula, state: str, states: Mapping[str, Floats]) -> Floats:
        """Return minus the derivative of an acceleration by a state along a motion, of the shape of its states."""
        slope = derivative(tree(self.model, acceleration), state)
        times = self.grid.times(self.group.end)
        numbers = {**self.group.by_name(self.model), **states, "t": times}
        return np.broadcast_to(-values(slope, numbers), np.shape(states[state]))


def stiffest(motion: Motion) -> Floats:
    """Return the angular frequency that a step has to resolve, shape (case,); by the first scheme that is sound."""
    model, finest = motion.model, motion.finest
    natural = np.asarray(finest["natural_frequency"], dtype=np.float64)
    if not applies(model):
        return natural
    sound = np.argmin(np.asarray(finest["status"]) != 0, axis=0)
    states = {}
    for state in model.states:
        own = take(motion.grid, finest, state.name)[sound, np.arange(len(sound))]
        known = np.asarray(motion.exact.get(state.name, own))
        states[state.name] = np.where(np.isfinite(known).all(axis=-1, keepdims=True), known, own)
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
    """Return the largest rate at which the force takes a velocity away, 0 for none, shape (scheme, case)."""
    model, fastest = motion.model, np.zeros(np.shape(motion.finest["status"]))
    if not is_damped(model):
        return fastest
    states = {}
    for state in model.states:
        own = take(motion.grid, motion.finest, state.name)
        known = np.asarray(motion.exact.get(state.name, own))
        states[state.name] = np.where(np.isfinite(known), known, own)
    with np.errstate(all="ignore"):
        for row, velocity in zip(model.accelerations, model.velocities, strict=True):
            rate = motion.fall(row, velocity, states)
            largest = np.max(np.where(np.isfinite(rate), rate, 0.0), axis=-1)
            fastest = np.maximum(fastest, largest)
    return fastest
