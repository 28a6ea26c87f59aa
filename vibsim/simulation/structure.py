"""Linear structures stepped as a whole, member by member, and their observed displacements.

A step solves with one symmetric matrix (`vibsim.schemes.newmark`), which SuperLU factors once for each step length and
damping. Every step keeps the observed displacements and velocities and the energies of the whole structure in a table.
The engine's loop then gathers extrema, norms and periods over the table, with the energies as one more coordinate
(`vibsim.simulation.adaptive.gather_over`).

The last bits depend on the versions of SciPy and its libraries and on the machine, but not on other members.
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
from vibsim.models.base import Numbers
from vibsim.models.shared.matrices import factored
from vibsim.models.structure import Loaded
from vibsim.schemes.base import Options, Scheme, Weights
from vibsim.simulation.adaptive import gather_over

KINETIC, POTENTIAL = "_kinetic", "_potential"
"""Names of the additional states that hold the energies."""


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
        Trajectories of the observed states, with the energies of the whole structure.
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
    run = gather_over(
        wide, scheme, options, parameters, table, table[:, 0], dt, steps, every, **more
    )
    return _without_energies(run, count)


def _without_energies(run: Trajectories, count: int) -> Trajectories:
    """Move the energies from the states to `Trajectories.energies`."""
    observed = [*range(count), *range(count + 1, 2 * count + 1)]
    energies = run.states[[count, 2 * count + 1]]
    gathered, series = run.gathered, run.series
    if gathered is not None:
        ranges, norms = gathered.ranges[:, observed], gathered.norms[:, observed]
        gathered = replace(gathered, ranges=ranges, norms=norms)
    if series is not None:
        series = replace(series, velocities_d2t=series.velocities_d2t[:, :count])
    return replace(
        run,
        states=np.ascontiguousarray(run.states[observed]),
        energies=np.moveaxis(energies, 1, 0),
        gathered=gathered,
        series=series,
    )


def points(
    loaded: Loaded, weights: Weights, named: Numbers, initial: Floats, dt: float, steps: int
) -> Floats:
    """Return the observed states and the energies at t = 0 and after each of `steps` steps of length `dt`.

    Parameters
    ----------
    named
        The parameters of the member.
    initial
        Its initial values of all states.

    Returns
    -------
    ndarray
        Shape (steps + 1, 2 count + 2): observed displacements, kinetic energy, observed velocities, potential energy.
        NaN after an overflow.

    Raises
    ------
    SimulationError
        If the matrix of a step is not positive definite.
    """
    structure = loaded.structure
    m, k = structure.mass.sparse.tocsr(), structure.stiffness.sparse.tocsr()
    c = _damping(loaded, named["alpha"], named["beta"])
    solve_mass, solve_step = _factors(loaded, weights, named["alpha"], named["beta"], dt)
    late, near = 1.0 - weights.gamma, 0.5 - weights.beta
    share, old = 1.0 - weights.alpha_f, weights.alpha_f
    loads = loaded.forces(np.arange(steps + 1, dtype=np.float64) * dt, named)
    count = len(structure.names)
    table = np.full((steps + 1, 2 * count + 2), np.nan)
    u, v = structure.start_of(initial)

    def net_force(n: int, u: Floats, v: Floats) -> Floats:
        """Return ``p - C v - K u`` at step n."""
        force: Floats = -(k @ u) if c is None else -(k @ u) - c @ v
        if len(loads):
            force = force + loads[:, n] @ structure.shapes
        return force

    with np.errstate(over="ignore", invalid="ignore"):
        force = net_force(0, u, v)
        a = solve_mass(force)
        for n in range(steps + 1):
            if n:
                reach = u + dt * (v + dt * near * a)
                push = v + (dt * late) * a
                right = share * net_force(n, reach, push)
                if old or weights.alpha_m:
                    right += old * force - weights.alpha_m * (m @ a)
                a = solve_step(right)
                u, v = reach + (weights.beta * dt * dt) * a, push + (weights.gamma * dt) * a
                force = net_force(n, u, v) if old else force
            # written so that NaN fails as well
            if not np.abs(u).sum() + np.abs(v).sum() < OVERFLOW:
                break
            table[n, :count], table[n, count + 1 : -1] = (
                structure.observed @ u,
                structure.observed @ v,
            )
            table[n, count], table[n, -1] = 0.5 * (v @ (m @ v)), 0.5 * (u @ (k @ u))
    return table


def _damping(loaded: Loaded, alpha: float, beta: float) -> Any:
    """Return the matrix C of a member, sparse; None if it is 0."""
    structure, total = loaded.structure, loaded.structure.own_damping
    for factor, matrix in ((alpha, structure.mass), (beta, structure.stiffness)):
        if factor:
            part = factor * matrix.sparse
            total = part if total is None else total + part
    return None if total is None else total.tocsr()


@lru_cache(maxsize=8)
def _factors(loaded: Loaded, weights: Weights, alpha: float, beta: float, dt: float) -> Any:
    """Return the functions that solve with M and with the matrix of a step."""
    structure, c = loaded.structure, _damping(loaded, alpha, beta)
    share = 1.0 - weights.alpha_f
    step = (1.0 - weights.alpha_m) * structure.mass.sparse
    if weights.beta:
        step = step + (share * weights.beta * dt * dt) * structure.stiffness.sparse
    if c is not None:
        step = step + (share * weights.gamma * dt) * c
    factors = factored(structure.mass.sparse), factored(step.tocsc())
    if None in factors:
        rule = f"the matrix of a step of dt = {dt:g} is not positive definite, because the damping is not"
        raise SimulationError(rule)
    return tuple(row.solve for row in factors)
