"""How much a problem magnifies small disturbances: rounding errors grow with it.

Near the separatrix a pendulum lingers at the top, and a disturbance of the last digit becomes a different motion. The
floor of round-off then lies higher, by the factor by which the exact solution responds to a disturbance. One on the
way counts as well as one at the start: at the bottom an energy that is wrong in its last digit decides how long the
next visit to the top takes.

A motion ``u'' = a(u)`` responds to a small disturbance in one of two ways. Along the motion, ``f = (v, a)``, it is a
shift in time, and stays one. Across it, along the gradient of the energy ``n = (-a, v)``, it changes the energy,
and the time shift then grows by ``C(t) - C(s)``, whatever the disturbance was. So C, which one disturbed solution
tells, gives the response at every time to every disturbance at every other:

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
    of one state. 1 where the model has no exact solution to tell. A model that is not conservative is disturbed at the
    start only, because its exact solution cannot be started on the way.

    Parameters
    ----------
    t
        Times, shape (case, t).
    known
        The exact solution at these times, where it has been worked out.
    """
    model = experiment.model.definition
    if model.exact is None:
        return np.ones(len(t))
    parameters, initial = in_columns(group.parameters), in_columns(group.initial)
    if not model.conservative or not model.is_alone:
        return _by_trial(model, t, initial, parameters)
    found, doubtful = _linear(model, t, initial, parameters, known)
    if doubtful.any():
        rows = ({k: v[doubtful] for k, v in table.items()} for table in (initial, parameters))
        found[doubtful] = _by_trial(model, t[doubtful], *rows)
    return found


def _solve(model: Model, t: Floats, initial: States, parameters: States) -> list[Floats]:
    """Return exact position and velocity, shape (case, t)."""
    assert model.exact is not None
    found = model.exact(t, initial, parameters)
    return [laid_out(found[state.name]) for state in model.states]


def _linear(
    model: Model, t: Floats, initial: States, parameters: States, known: States | None
) -> tuple[Floats, Flags]:
    """Return the factor by the formulas at the head, and where a start is next to an equilibrium."""
    w = np.asarray(model.natural_frequency(parameters), dtype=np.float64)
    names = [state.name for state in model.states]
    u, v = [known[n] for n in names] if known else _solve(model, t, initial, parameters)
    instant = INSTANT / w
    ahead = _solve(model, t + instant, initial, parameters)[1]
    f = [w * v, (ahead - v) / instant]
    across = [-f[1] / w, v]
    # a motion whose square is too large for a number: the factor is not finite, and says so
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
        found = _largest_response(f, [x * (w * w) / square for x in across], across, late, sizes)
    doubtful |= ~np.isfinite(found)
    return np.clip(found, 1.0, 2.0 / DISTURBANCE), doubtful


def _places(t: Floats) -> range:
    """Return the places in time at which a disturbance is tried."""
    last = t.shape[-1] - 1
    return range(0, last, max(last // PLACES, 1))


def _largest_response(
    f: list[Floats], ahead: list[Floats], across: list[Floats], late: Floats, sizes: list[Floats]
) -> Floats:
    """Return the largest later response to a disturbance of one state on the way, shape (case,).

    f, the gradient n of the energy (`across`), ``n/|n|^2`` (`ahead`) and C (`late`) have the shape (case, t), the sizes
    of the states the shape (case,).
    """
    found = np.ones(len(late))
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
                found = np.maximum(found, largest(response))
    return found


def _by_trial(model: Model, t: Floats, initial: States, parameters: States) -> Floats:
    """Return the largest response to disturbances that are tried one by one, shape (case,)."""
    assert model.exact is not None
    exact = model.exact(t, initial, parameters)
    size = {name: np.max(np.abs(values), axis=-1, keepdims=True) for name, values in exact.items()}
    found = np.ones(len(t))
    for place in _places(t) if model.conservative else [0]:
        rest = t[:, place:] - t[:, place : place + 1]
        state = {name: values[:, place : place + 1] for name, values in exact.items()}
        undisturbed = model.exact(rest, state, parameters)
        for name, value in state.items():
            pushed = {**state, name: value + DISTURBANCE * size[name]}
            moved = model.exact(rest, pushed, parameters)
            for other, whole in size.items():
                change = np.max(np.abs(moved[other] - undisturbed[other]), axis=-1)
                unit = DISTURBANCE * whole[:, 0]
                response = np.divide(change, unit, out=np.ones_like(change), where=unit > 0)
                # where the exact solution is not known, nothing is reported
                found = np.fmax(found, response)
    return found
