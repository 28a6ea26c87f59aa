"""Energies of stored samples, by the formulas that the loops use at every step."""

from __future__ import annotations

from typing import Any

from vibsim.engine.bound import energies, parameters_of


def run(parameters: Any, dt: Any, every: int, first: int, samples: Any, found: Any) -> None:
    """Fill `found` with the energies of as many members as it has, the first of them being member `first`.

    Parameters
    ----------
    parameters
        Shape (case, n_parameters).
    dt, every
        Step of each member, shape (case,), and steps between samples.
    samples
        Position and velocity, shape (2, case, n_samples).
    found
        Kinetic and potential energy, shape (2, members, n_samples); NaN where the samples are.
    """
    for member in range(found.shape[1]):
        case = first + member
        p = parameters_of(parameters, case)
        for k in range(found.shape[2]):
            u = float(samples[0, case, k])
            v = float(samples[1, case, k])
            kinetic, potential = energies(u, v, (k * every) * float(dt[case]), p)
            found[0, member, k] = kinetic
            found[1, member, k] = potential
