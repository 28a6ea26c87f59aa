"""Linear structures stepped as a whole, member by member, and sampled by what is observed of them.

A step solves with one symmetric matrix (`vibsim.schemes.newmark`), which SuperLU factors once for each length of step
and damping. What is kept of every step are the observed displacements and velocities and the energies of the whole
structure. They are put into a table, over which the loop of every other scheme gathers extrema, norms and periods, with
the energies as one more coordinate (`vibsim.simulation.adaptive.gather_over`).

The last bits depend on the versions of SciPy and of its linear algebra, and on the machine, but on no other member.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.errors import SimulationError
from vibsim.engine import Trajectories
from vibsim.engine.gather import OVERFLOW
from vibsim.formula import Name
from vibsim.models import Model, State
from vibsim.models.shared.matrices import factored
from vibsim.models.structure import Loaded
from vibsim.schemes.base import Options, Scheme, Weights
from vibsim.simulation.adaptive import gather_over

KINETIC, POTENTIAL = "_kinetic", "_potential"
"""States that carry the energies along."""


def integrate(
    model: Model,
    scheme: Scheme,
    options: Options,
    parameters: Floats,
    initial: Floats,
    dt: Floats,
    steps: int,
    every: int,
    **more: Any,
) -> Trajectories:
    """Step the structure of every member, and gather over its points; see `vibsim.engine.integrate`.

    Returns
    -------
    Trajectories
        Of what is observed, with the energies of the whole structure beside it.
    """
    assert model.loaded is not None
    assert scheme.weights is not None
    weights, count = scheme.weights(options), model.coordinates
    table = np.zeros((len(dt), steps + 2, 2 * count + 2))
    keys = [row.key for row in model.parameters]
    for i in range(len(dt)):
        named = model.loaded.named(dict(zip(keys, parameters[i], strict=True)), 0)
        table[i, :-1] = points(model.loaded, weights, named, initial[i], float(dt[i]), steps)
    wide = replace(
        model,
        states=(
            *model.states[:count],
            State(KINETIC, "1", "kinetic energy"),
            *model.states[count:],
            State(POTENTIAL, "1", "potential energy"),
        ),
        acceleration="0",
        further_accelerations=("0",) * count,
        kinetic_energy=Name(KINETIC),
        potential_energy=Name(POTENTIAL),
        loaded=None,
    )
    found = gather_over(
        wide, scheme, options, parameters, table, table[:, 0], dt, steps, every, **more
    )
    return _without_energies(found, count)


def _without_energies(found: Trajectories, count: int) -> Trajectories:
    """Take the energies out of the states."""
    own = [*range(count), *range(count + 1, 2 * count + 1)]
    energies = found.states[[count, 2 * count + 1]]
    gathered, series = found.gathered, found.series
    if gathered is not None:
        gathered = replace(gathered, ranges=gathered.ranges[:, own], norms=gathered.norms[:, own])
    if series is not None:
        series = replace(series, velocities_d2t=series.velocities_d2t[:, :count])
    return replace(
        found,
        states=np.ascontiguousarray(found.states[own]),
        energies=np.moveaxis(energies, 1, 0),
        gathered=gathered,
        series=series,
    )


def points(
    own: Loaded, weights: Weights, named: dict[str, float], initial: Floats, dt: float, steps: int
) -> Floats:
    """Return what a step keeps, at every one of `steps` steps of the length `dt` and at t = 0.

    Parameters
    ----------
    named
        The parameters of the member.
    initial
        Its initial values of all states.

    Returns
    -------
    ndarray
        Shape (step, 2 count + 2): observed displacements, kinetic energy, observed velocities, potential energy. NaN
        behind the last step that can be stored.

    Raises
    ------
    SimulationError
        Where the matrix of a step is not positive definite.
    """
    structure = own.structure
    m, k = structure.mass.sparse.tocsr(), structure.stiffness.sparse.tocsr()
    c = _damping(own, named["alpha"], named["beta"])
    first, solve = _factors(own, weights, named["alpha"], named["beta"], dt)
    late, near = 1.0 - weights.gamma, 0.5 - weights.beta
    share, old = 1.0 - weights.alpha_f, weights.alpha_f
    loads = own.forces(np.arange(steps + 1, dtype=np.float64) * dt, named)
    count = len(structure.names)
    found = np.full((steps + 1, 2 * count + 2), np.nan)
    u, v = structure.start_of(initial)

    def left(n: int, u: Floats, v: Floats) -> Floats:
        """Return ``p - C v - K u`` at step n."""
        force: Floats = -(k @ u) if c is None else -(k @ u) - c @ v
        if len(loads):
            force = force + loads[:, n] @ structure.shapes
        return force

    with np.errstate(over="ignore", invalid="ignore"):
        force = left(0, u, v)
        a = first(force)
        for n in range(steps + 1):
            if n:
                reach = u + dt * (v + dt * near * a)
                push = v + (dt * late) * a
                right = share * left(n, reach, push)
                if old or weights.alpha_m:
                    right += old * force - weights.alpha_m * (m @ a)
                a = solve(right)
                u, v = reach + (weights.beta * dt * dt) * a, push + (weights.gamma * dt) * a
                force = left(n, u, v) if old else force
            # written so that NaN fails as well
            if not np.abs(u).sum() + np.abs(v).sum() < OVERFLOW:
                break
            found[n, :count], found[n, count + 1 : -1] = (
                structure.observed @ u,
                structure.observed @ v,
            )
            found[n, count], found[n, -1] = 0.5 * (v @ (m @ v)), 0.5 * (u @ (k @ u))
    return found


def _damping(own: Loaded, alpha: float, beta: float) -> Any:
    """Return the matrix C of a member, sparse; None where there is none."""
    structure, found = own.structure, own.structure.own_damping
    for factor, matrix in ((alpha, structure.mass), (beta, structure.stiffness)):
        if factor:
            part = factor * matrix.sparse
            found = part if found is None else found + part
    return None if found is None else found.tocsr()


@lru_cache(maxsize=8)
def _factors(own: Loaded, weights: Weights, alpha: float, beta: float, dt: float) -> Any:
    """Return what solves with M, and with the matrix of a step."""
    structure, c = own.structure, _damping(own, alpha, beta)
    share = 1.0 - weights.alpha_f
    step = (1.0 - weights.alpha_m) * structure.mass.sparse
    if weights.beta:
        step = step + (share * weights.beta * dt * dt) * structure.stiffness.sparse
    if c is not None:
        step = step + (share * weights.gamma * dt) * c
    found = factored(structure.mass.sparse), factored(step.tocsc())
    if None in found:
        rule = f"the matrix of a step of dt = {dt:g} is not positive definite, because the damping is not"
        raise SimulationError(rule)
    return tuple(row.solve for row in found)
