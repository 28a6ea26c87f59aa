"""Sensitivity of a problem: the factor by which it magnifies small disturbances, and so rounding errors.

Near the separatrix a pendulum lingers at the top, and a disturbance of the last digit becomes a different motion. The
round-off floor is then higher by the factor by which the exact solution responds to disturbances. Disturbances during
the motion count as well as those at the start: at the bottom, the last digit of the energy decides how long the next
visit to the top takes.

A motion ``u'' = a(u)`` responds to a small disturbance in two ways. Along the motion, ``f = (v, a)``, the disturbance
is a constant shift in time. Across it, along the gradient of the energy ``n = (-a, v)``, it changes the energy, and the
time shift then grows by ``C(t) - C(s)``, where C does not depend on the disturbance. So C, computed from one disturbed
solution, gives the response at any time t to any disturbance at an earlier time s:

    f(s)          becomes    f(t)
    n(s)/|n(s)|^2 becomes    n(t)/|n(t)|^2 + (C(t) - C(s)) f(t)
"""

from __future__ import annotations

import numpy as np

from vibsim.convergence.differences import laid_out, largest
from vibsim.core.array_types import Flags, Floats
from vibsim.experiment import Experiment
from vibsim.models import Model
from vibsim.observe.thresholds import DISTURBANCE, INSTANT, NEAR_REST, PLACES
from vibsim.simulation.members import Members, in_columns

States = dict[str, Floats]


def sensitivity(
    experiment: Experiment, t: Floats, group: Members, known: States | None = None
) -> Floats:
    """Return the factor by which disturbances of the state grow, at least 1, shape (case,).

    It is the largest later change of a state, relative to the size of that state over the run, for a relative change
    of one state. 1 if the model has no exact solution. A model that is not conservative is disturbed only at the start,
    because its exact solution cannot be started later.

    Parameters
    ----------
    t
        Times, shape (case, t).
    known
        The exact solution at these times, if it has been computed.
    """
    model = experiment.model.definition
    if model.exact is None:
        return np.ones(len(t))
    parameters, initial = in_columns(group.parameters), in_columns(group.initial)
    if not model.conservative or not model.is_alone:
        return _by_trial(model, t, initial, parameters)
    factor, doubtful = _linear(model, t, initial, parameters, known)
    if doubtful.any():
        rows = ({k: v[doubtful] for k, v in table.items()} for table in (initial, parameters))
        factor[doubtful] = _by_trial(model, t[doubtful], *rows)
    return factor


def _solve(model: Model, t: Floats, initial: States, parameters: States) -> list[Floats]:
    """Return exact position and velocity, shape (case, t)."""
    assert model.exact is not None
    states = model.exact(t, initial, parameters)
    return [laid_out(states[state.name]) for state in model.states]


def _linear(
    model: Model, t: Floats, initial: States, parameters: States, known: States | None
) -> tuple[Floats, Flags]:
    """Return the factor by the formulas of the module docstring, and which members start next to an equilibrium."""
    w = np.asarray(model.natural_frequency(parameters), dtype=np.float64)
    names = [state.name for state in model.states]
    u, v = [known[n] for n in names] if known else _solve(model, t, initial, parameters)
    instant = INSTANT / w
    ahead = _solve(model, t + instant, initial, parameters)[1]
    f = [w * v, (ahead - v) / instant]
    across = [-f[1] / w, v]
    # an overflow makes the factor infinite or NaN, and the member doubtful
    with np.errstate(over="ignore", invalid="ignore"):
        square = f[0] * f[0] + f[1] * f[1]
    sizes = [largest(u) * w[:, 0], largest(v)]
    size = np.maximum(*sizes)
    slope = np.sqrt(square[:, 0]) / w[:, 0]
    doubtful = ~(slope > NEAR_REST * size)
    push = DISTURBANCE * size / np.where(doubtful, 1.0, slope)
    pushes = [(push * part[:, 0])[:, None] for part in (across[0] / w, across[1])]
    moved = {n: initial[n] + part for n, part in zip(names, pushes, strict=True)}
    change = [x - y for x, y in zip(_solve(model, t, moved, parameters), (u, v), strict=True)]
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        along = (f[0] * (w * change[0]) + f[1] * change[1]) / square
        late = along / (push * slope * slope)[:, None]
        factor = _largest_response(f, [x * (w * w) / square for x in across], across, late, sizes)
    doubtful |= ~np.isfinite(factor)
    return np.clip(factor, 1.0, 2.0 / DISTURBANCE), doubtful


def _places(t: Floats) -> range:
    """Return the indices of the times at which a disturbance is tried."""
    last = t.shape[-1] - 1
    return range(0, last, max(last // PLACES, 1))


def _largest_response(
    f: list[Floats], ahead: list[Floats], across: list[Floats], late: Floats, sizes: list[Floats]
) -> Floats:
    """Return the largest later response to a disturbance of one state during the motion, shape (case,).

    f, ``n/|n|^2`` (`ahead`), the gradient n of the energy (`across`) and C (`late`) have shape (case, t), the sizes of
    the states shape (case,).
    """
    factor = np.ones(len(late))
    scaled = [(x / s[:, None], y / s[:, None]) for x, y, s in zip(f, ahead, sizes, strict=True)]
    for place in _places(late):
        delay = late[:, place:] - late[:, place, None]
        square = f[0][:, place] ** 2 + f[1][:, place] ** 2
        for i, size in enumerate(sizes):
            shift = (f[i][:, place] * size / square)[:, None]
            energy = (across[i][:, place] * size)[:, None]
            time = shift + energy * delay
            for motion, gradient in scaled:
                response = time * motion[:, place:] + energy * gradient[:, place:]
                factor = np.maximum(factor, largest(response))
    return factor


def _by_trial(model: Model, t: Floats, initial: States, parameters: States) -> Floats:
    """Return the largest response to disturbances of each state at several times, shape (case,)."""
    assert model.exact is not None
    exact = model.exact(t, initial, parameters)
    sizes = {name: np.max(np.abs(values), axis=-1, keepdims=True) for name, values in exact.items()}
    factor = np.ones(len(t))
    for place in _places(t) if model.conservative else [0]:
        elapsed = t[:, place:] - t[:, place : place + 1]
        state = {name: values[:, place : place + 1] for name, values in exact.items()}
        undisturbed = model.exact(elapsed, state, parameters)
        for name, value in state.items():
            pushed = {**state, name: value + DISTURBANCE * sizes[name]}
            moved = model.exact(elapsed, pushed, parameters)
            for other, size in sizes.items():
                change = np.max(np.abs(moved[other] - undisturbed[other]), axis=-1)
                unit = DISTURBANCE * size[:, 0]
                response = np.divide(change, unit, out=np.ones_like(change), where=unit > 0)
                # NaN, where the exact solution is not known, is ignored
                factor = np.fmax(factor, response)
    return factor
