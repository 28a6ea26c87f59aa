"""Pulses of the force in time that lie between the points of every level, so that no level knows of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record, Variable, attributes
from vibsim.formula import Pulses
from vibsim.models import Model
from vibsim.observe.thresholds import MOST_GAPS
from vibsim.simulation import Members
from vibsim.simulation.reference.one_sided_forces import pulses_of_force, varies_in_time

AROUND = np.arange(-2, 4)
"""Points around a pulse."""


@dataclass(frozen=True)
class Missed:
    """One pulse of every member whose force has any that no level sees, shape (case,)."""

    time: Floats
    """NaN where there is none, here and below."""
    width: Floats
    jumps: Flags
    """Whether the force jumps there, or has corners."""


def missed_pulses(model: Model, finest: Record, group: Members) -> Missed:
    """Find a pulse of the force between the points of the finest level, whose points hold those of all others.

    Parameters
    ----------
    finest
        Record of the finest level.
    group
        Its members.
    """
    cases = len(group.end)
    if not varies_in_time(model):
        nothing = np.full(cases, np.nan)
        return Missed(nothing, nothing, np.zeros(cases, dtype=bool))
    steps = int(np.asarray(finest.attrs["steps"]).item())
    gaps = steps
    while cases * gaps > MOST_GAPS and gaps % 2 == 0:
        gaps //= 2
    t = np.arange(gaps + 1) * (group.end / gaps)[:, None]
    every = _Forces(model, finest, group)
    found = every.pulses(t, smooth=False)
    if gaps < steps:
        found = _confirmed(every, found, group.end / steps)
    smooth = every.pulses(t, smooth=True) if np.isfinite(found.time).any() else found
    return Missed(found.time, found.width, np.isfinite(found.time) & np.isnan(smooth.time))


@dataclass(frozen=True)
class _Forces:
    """The forces on the motions of the finest level."""

    model: Model
    finest: Record
    group: Members

    def pulses(self, t: Floats, *, smooth: bool) -> Pulses:
        """Find a pulse of every member between times of shape (case, gap + 1)."""
        rows = [np.asarray(self.finest[state.name], dtype=float) for state in self.model.states]
        states = np.stack(rows)
        scheme = np.argmax(np.isfinite(states).all(axis=(0, -1)), axis=0)
        own = np.arange(len(scheme))
        samples = states.shape[-1] - 1
        place = (t[:, :-1] / self.group.end[:, None] * samples).astype(np.int64)
        at = states[:, scheme[:, None], own[:, None], np.clip(place, 0, samples)]
        parameters = {
            row.name: np.asarray(self.group.parameters[row.key], dtype=float)
            for row in self.model.parameters
        }
        return pulses_of_force(self.model, parameters, at, t, smooth=smooth)


def _confirmed(every: _Forces, found: Pulses, dt: Floats) -> Pulses:
    """Return pulses that lie between points of the finest level, too."""
    first = np.maximum(np.floor(np.nan_to_num(found.time) / dt) + AROUND[0], 0.0)
    number = first[:, None] + (AROUND - AROUND[0])
    near = every.pulses(number * dt[:, None], smooth=False)
    is_there = np.isfinite(found.time)
    return Pulses(np.where(is_there, near.time, np.nan), np.where(is_there, near.width, np.nan))


def missed_variables(missed: Missed) -> dict[str, Variable]:
    """Return the pulses as variables of the convergence Record."""
    dims = ("case",)
    words = "time of a pulse of the force between the points of every level"
    return {
        "pulse_time": Variable(dims, missed.time, attributes(words, "s")),
        "pulse_width": Variable(dims, missed.width, attributes("how long that pulse lasts", "s")),
    }
