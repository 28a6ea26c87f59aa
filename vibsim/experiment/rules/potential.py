"""Check that a potential energy belongs to its spring, by comparison with the work of the spring."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.experiment.faults import Report
from vibsim.formula import Expression, has_rule, parse, values
from vibsim.models import Model, tree

AMPLITUDES = (-6, 8)
"""Range of the exponents of 2 of the amplitudes at which both are compared."""
PANELS, POINTS = 32, 16
"""Number of quadrature panels per amplitude, and of points per panel."""
AGREE = 1e-9
"""Relative tolerance of the comparison."""
NOT_FOUND = "no potential energy was found of the forces that the positions make"


def check_potential(
    model: Model, parameters: Mapping[str, float], texts: Mapping[str, str], report: Report
) -> None:
    """Compare the potential energy with the work of the spring between half and full amplitudes.

    `texts` holds the formulas of the file by field.
    """
    names = (model.position, *(row.name for row in model.parameters))
    numbers = {row.name: parameters[row.key] for row in model.parameters}
    spring = parse(texts.get("spring", model.position), names)
    potential = tree(model, model.potential_energy)
    is_given = "potential" in texts
    size = 2.0 ** np.arange(*AMPLITUDES)
    u = np.concatenate([-size, size])
    with np.errstate(all="ignore"):
        coarse, work = (_work(spring, numbers, model.position, u, n) for n in (PANELS, 2 * PANELS))
        energy = [values(potential, {**numbers, model.position: x}) for x in (u, 0.5 * u)]
        scale = np.abs(work) + np.abs(energy[0]) + np.abs(energy[1])
        # quadrature across a corner or a pole is less accurate
        is_known = np.abs(work - coarse) <= 0.1 * AGREE * scale
        is_right = np.abs(energy[0] - energy[1] - work) <= AGREE * scale
    is_compared = is_known & np.isfinite(energy).all(axis=0)
    wrong = is_compared & ~is_right
    if is_given and wrong.any():
        rule = f"is not the integral of the spring: its slope differs near u = {u[wrong][0]:.3g}"
        report.add(("model", "potential"), rule, value=texts["potential"])
    elif is_given and not is_compared.any():
        rule = "cannot be compared with the spring: one of them is defined nowhere"
        report.add(("model", "potential"), rule, value=texts["potential"])
    elif not is_given and not has_rule(spring, model.position):
        wrong = np.isfinite(work) & ~(is_known & is_right)
        if wrong.any():
            rule = "its potential energy cannot be computed: it has corners, is singular or varies fast"
            hint = "write the energy as `potential`, a formula whose slope is the spring"
            report.add(("model", "spring"), rule, hint)


def _work(
    spring: Expression, numbers: Mapping[str, float], position: str, u: Floats, panels: int
) -> Floats:
    """Return the integral of the spring from u/2 to u, by Gauss-Legendre quadrature in every panel."""
    place, weight = np.polynomial.legendre.leggauss(POINTS)
    middle = (2.0 * np.arange(panels)[:, None] + 1.0 + place) / (2.0 * panels)
    places = u[:, None, None] * (0.5 + 0.5 * middle)
    force = np.broadcast_to(values(spring, {**numbers, position: places}), places.shape)
    found: Floats = 0.5 / (2.0 * panels) * u * np.sum(weight * force, axis=(1, 2))
    return found
