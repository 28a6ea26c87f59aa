"""Formulas of stored samples, by the functions that the loops use at every step."""

from __future__ import annotations

from typing import Any

from vibsim.engine.kernel_stubs import SYSTEM, observed, parameters_of, point_of


def run(
    parameters: Any, table: Any, dt: Any, every: int, first: int, samples: Any, found: Any
) -> None:
    """Fill `found` with the values of as many members as it has, the first of them being member `first`.

    Parameters
    ----------
    parameters
        Shape (case, n_parameters).
    table
        What formulas look up, shape (row, point); empty where they do not.
    dt, every
        Step of each member, shape (case,), and steps between samples.
    samples
        All positions and all velocities, shape (state, case, n_samples).
    found
        A row of each formula, shape (formula, members, n_samples); NaN where the samples are.
    """
    for member in range(found.shape[1]):
        case = first + member
        p = parameters_of(parameters, table, case)
        for k in range(found.shape[2]):
            if SYSTEM:
                u, v = point_of(samples, case, k)
            else:
                u = float(samples[0, case, k])
                v = float(samples[1, case, k])
            values = observed(u, v, (k * every) * float(dt[case]), p)
            for i in range(found.shape[0]):
                found[i, member, k] = values[i]
