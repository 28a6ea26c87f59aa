"""Check that a potential energy belongs to its spring, by work, or to the forces of a system, by power."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.experiment.faults import Report
from vibsim.formula import ZERO, Expression, derivative, has_rule, parse, values, values_of
from vibsim.models import Model, tree
from vibsim.models.base import by_name
from vibsim.models.shared.identities import AGREE, TESTS

AMPLITUDES = (-6, 8)  # range of the exponents of 2 of the amplitudes at which both are compared
PANELS, POINTS = 32, 16  # number of quadrature panels per amplitude, and of points per panel
NOT_FOUND = "no potential energy was found of the forces that the positions make"


def check_potential(
    model: Model, parameters: Mapping[str, float], texts: Mapping[str, str], report: Report
) -> None:
    """Compare the potential energy with the work of the spring between half and full amplitudes.

    `texts` holds the formulas of the file by field.
    """
    names = (model.position, *(row.name for row in model.parameters))
    numbers = by_name(model.parameters, parameters)
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


def note_potential(
    model: Model, parameters: Mapping[str, float], start: Mapping[str, float], report: Report
) -> None:
    """Note a written potential energy V of a system that is not that of its forces F, at states around the start.

    At rest the derivative of the power dE/dt with respect to the velocities is grad V - F. If its Jacobian with respect
    to the positions is symmetric and not 0, the remaining forces have a potential, which V lacks. Damping, driving,
    constant forces, and forces without a potential do not satisfy this. Nor do accelerations of unequal masses with the
    potential of their forces: there every row of grad V is a multiple of that of -F.
    """
    x, v = model.positions, model.velocities
    energy = tree(model, model.potential_energy)
    power = tree(model, model.driving or ZERO) - tree(model, model.dissipation or ZERO)
    forces, own = (
        [derivative(derivative(of, a), b) for a in first for b in x]
        for of, first in ((power, v), (energy, x))
    )
    rng = np.random.default_rng(21)
    largest = max(abs(start[name]) for name in x) or 1.0
    sizes = {name: abs(start[name]) or largest for name in x}
    numbers = {name: start[name] + sizes[name] * rng.uniform(-1.0, 1.0, TESTS) for name in x}
    numbers |= {row.name: np.full(TESTS, parameters[row.key]) for row in model.parameters}
    numbers |= dict.fromkeys(v, np.zeros(TESTS))
    if any(formula.names - numbers.keys() for formula in forces) or energy.names & set(v):
        return
    found = [np.broadcast_to(value, TESTS) for value in values_of(forces + own, numbers)]
    remaining, curvature = np.reshape(found, (2, len(x), len(x), TESTS))
    size = np.max(np.abs(remaining) + np.abs(curvature), axis=(0, 1))
    is_known = np.isfinite(size)
    with np.errstate(invalid="ignore"):
        is_symmetric = np.abs(remaining - np.swapaxes(remaining, 0, 1)) <= AGREE * size
        is_nonzero = np.abs(remaining) > AGREE * size
        stiffness = (curvature - remaining)[..., is_known]
        squares = np.sum(stiffness**2, axis=(1, 2), keepdims=True)
        mass = np.sum(curvature[..., is_known] * stiffness, axis=(1, 2), keepdims=True) / squares
        away = np.abs(curvature[..., is_known] - np.where(squares > 0.0, mass * stiffness, 0.0))
        is_of_masses = np.all(away <= AGREE * size[is_known]) and np.all(mass[squares > 0.0] > 0.0)
    if (
        is_known.any()
        and (is_symmetric[..., is_known].all() or is_of_masses)
        and is_nonzero[..., is_known].all(axis=-1).any()
    ):
        rule = "does not give the forces, so the energy changes even without damping"
        hint = "beside `acceleration` masses are 1: write `force` and `mass`, and vibsim finds it where it can"
        report.note(("model", "potential"), rule, hint)


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
