"""Pulses of the force of a model in time that lie between the times at which it is looked at."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vibsim.formula import Pulses, hidden_pulses, names_in
from vibsim.models import Model, tree
from vibsim.simulation.reference.one_sided_forces import Sides, sides

Floats = NDArray[np.float64]


def varies_in_time(model: Model) -> bool:
    """Tell whether the force of a model depends on time otherwise than by a table."""
    return any("t" in names_in(tree(model, row)) for row in model.accelerations)


def pulses_of_force(
    model: Model, parameters: Mapping[str, Floats], states: Floats, t: Floats, *, smooth: bool
) -> Pulses:
    """Find a pulse of the force of every member between the times at which it is looked at.

    Parameters
    ----------
    parameters
        Of the members, each of shape (case,).
    states
        All positions and then all velocities at these times but the last, shape (state, case, gap).
    t
        The times, shape (case, gap + 1), ascending; NaN behind the last one of a member.
    smooth
        Whether the force has what it has on one side of its jumps and corners, those of each time in the middle.
    """
    held = sides(model, {name: x[:, None] for name, x in parameters.items()})
    u, v = np.split(states, 2)
    numbers = held.numbers(_modes(held, u, v, 0.5 * (t[:, :-1] + t[:, 1:])), u, v, t[:, :-1])
    del numbers["t"]
    formulas = held.formulas if smooth else tuple(tree(model, row) for row in model.accelerations)
    nothing = np.full(len(t), np.nan)
    found = Pulses(nothing, nothing)
    for formula in formulas:
        found = found.and_others(hidden_pulses(formula, numbers, t))
    return found


def _modes(held: Sides, u: Floats, v: Floats, t: Floats) -> Floats:
    """Return the modes of all switches, shape (switch, case, gap)."""
    modes = np.zeros((len(held.switches), *t.shape))
    for k, is_whole in enumerate(held.whole):
        # a switch may look at the modes of those before it
        q = held.quantity(k, modes, u, v, t)
        modes[k] = np.floor(q) if is_whole else np.where(q > 0.0, 0.0, -1.0)
    return modes
