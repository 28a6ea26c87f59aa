"""How much a problem magnifies small disturbances: rounding errors grow with it.

Near the separatrix a pendulum lingers at the top, and a disturbance of the last digit becomes a different motion. The
floor of round-off then lies higher, by the factor by which the exact solution responds to a disturbance. One on the
way counts as well as one at the start: at the bottom an energy that is wrong in its last digit decides how long the
next visit to the top takes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.grid import Grid
from vibsim.models import MODELS
from vibsim.record import Record
from vibsim.simulation import members

if TYPE_CHECKING:
    from vibsim.spec import Experiment

Floats = NDArray[np.float64]
States = dict[str, Floats]

DISTURBANCE = 1e-12
"""Relative disturbance of a state: above the rounding of an exact solution, below what bends most responses."""
PLACES = 8
"""At so many times along the run a disturbance is tried."""


def sensitivity(experiment: Experiment, grid: Grid, record: Record) -> Floats:
    """Return the factor by which disturbances of the state grow, at least 1, shape (case,).

    It is the largest later change of a state, relative to the size of that state over the run, for a relative change
    of one state. 1 where the model has no exact solution to tell. A model that is not conservative is disturbed at the
    start only, because its exact solution cannot be started on the way.
    """
    model = MODELS[experiment.model.kind]
    case = np.asarray(record["case"], dtype=np.int64)
    if model.exact is None:
        return np.ones(len(case))
    group = members(experiment, int(case[0]), int(case[-1]) + 1)
    t = np.broadcast_to(
        grid.t * (group.end[:, None] if "end" in record else 1.0), (len(case), len(grid.t))
    )
    parameters = {name: values[:, None] for name, values in group.parameters.items()}
    initial = {name: values[:, None] for name, values in group.initial.items()}
    exact = model.exact(t, initial, parameters)
    size = {name: np.max(np.abs(values), axis=-1, keepdims=True) for name, values in exact.items()}
    last = len(grid.t) - 1
    places = range(0, last, max(last // PLACES, 1)) if model.conservative else [0]
    largest = np.ones(len(case))
    for place in places:
        rest = t[:, place:] - t[:, place : place + 1]
        state = {name: values[:, place : place + 1] for name, values in exact.items()}
        largest = np.maximum(largest, _response(model.exact, rest, state, parameters, size))
    return largest


def _response(
    exact: Callable[[Floats, States, States], States],
    t: Floats,
    state: States,
    parameters: States,
    size: States,
) -> Floats:
    """Return the largest response to a disturbance of `state`, shape (case,)."""
    undisturbed = exact(t, state, parameters)
    largest = np.ones(len(t))
    for name, value in state.items():
        moved = exact(t, {**state, name: value + DISTURBANCE * size[name]}, parameters)
        for other, whole in size.items():
            change = np.max(np.abs(moved[other] - undisturbed[other]), axis=-1)
            unit = DISTURBANCE * whole[:, 0]
            response = np.divide(change, unit, out=np.ones_like(change), where=unit > 0)
            largest = np.maximum(largest, response)
    return largest
