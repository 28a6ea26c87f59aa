"""The drift of the energy of an experiment's members, from what the levels hold; see `vibsim.observe.energy_drift`."""

from __future__ import annotations

import numpy as np

from vibsim.apriori.roundoff_floor import SPACING_AT_ONE, solution_size
from vibsim.convergence.differences import largest, safe_ratio
from vibsim.convergence.thresholds import ABOVE_ROUND_OFF
from vibsim.core.array_types import Floats
from vibsim.formula import derivative, plus, values
from vibsim.models.base import tree
from vibsim.observe.energy_drift import Drift, drift_of
from vibsim.observe.member_block import CENTRED, MemberBlock, energy_at_start
from vibsim.observe.thresholds import MOST_ROUNDED, STEPPED
from vibsim.schemes import SCHEMES
from vibsim.schemes.base import UNIT_ROUND_OFF, round_off


def drift_at(block: MemberBlock, level: int, name: str = "energy_deviation") -> Drift:
    """Find how an energy deviation grows at a level; NaN rows of its series are ``unclear``.

    Parameters
    ----------
    name
        ``energy_deviation`` or ``energy_deviation_d2t``.
    """
    record, index = block.records[level], block.grid.levels.index(level)
    initial = energy_at_start(record)
    missing = np.full((*block.shape, len(record["t"])), np.nan)
    deviation = np.asarray(record[name], dtype=float) if name in record else missing
    size = np.abs(initial) + solution_size([np.nan_to_num(deviation)])
    # an energy without bound has a floor without bound
    with np.errstate(over="ignore", invalid="ignore"):
        grows = _conditioned(block, level, size)
        # a motion that magnifies a disturbance shifts it in time, which leaves the energy as it is
        floor = block.floor_of(name, size * grows / block.magnified)[..., index]
        floor = np.maximum(floor, _of_steps(block, level) * size * grows)
    # the tolerance of an adaptive scheme is an error that it makes, and no round-off
    floor[block.adaptive] = SPACING_AT_ONE * size[block.adaptive]
    w = np.asarray(record["natural_frequency"], dtype=float)
    return drift_of(
        _running(block, level, name, deviation),
        _ratio(block, level, name, deviation),
        initial,
        floor,
        w * block.group.end / (2.0 * np.pi),
        deviation,
    )


def _conditioned(block: MemberBlock, level: int, size: Floats) -> Floats:
    """Return the factor by which rounding of the states is felt by the energy, at least 1, shape (scheme, case).

    A conserved energy keeps every error dE that a rounded state dx makes: ``dE = sum of (dE/dx) dx``, with dx relative
    to the size of x. Relative to the energy that is 2 of an oscillation about 0, which counts as 1, and much more where
    positions are large beside the swing. An energy that is not conserved follows the motion, with what that magnifies.

    Parameters
    ----------
    size
        Size of the energy, shape (scheme, case).
    """
    model, record = block.model, block.records[level]
    if not model.conservative:
        return np.broadcast_to(block.magnified, size.shape)
    states = {s.name: np.asarray(record[s.name], dtype=float) for s in model.states}
    named = {row.name: block.group.parameters[row.key][:, None] for row in model.parameters}
    energy = plus(tree(model, model.kinetic_energy), tree(model, model.potential_energy))
    square = np.zeros(next(iter(states.values())).shape)
    with np.errstate(all="ignore"):
        for name, values_of in states.items():
            slope = values(derivative(energy, name), {**named, **states, "t": 0.0})
            square = square + (slope * largest(values_of)[..., None]) ** 2
        felt = 0.5 * safe_ratio(np.sqrt(largest(square)), size)
    return np.asarray(np.fmax(felt, 1.0))


def _of_steps(block: MemberBlock, level: int) -> Floats:
    """Return what rounding adds to the energy in proportion to the size of a step, shape (scheme, case).

    It is relative to the energy, over `ABOVE_ROUND_OFF`.
    Rounded coefficients make every step, of the size p = w dt, larger or smaller by the same: N p. Steps larger than a
    radian are differences of numbers p^2 large, which are rounded otherwise each time: ``N^(1/2) p^2``. Centred
    differences have a prediction of their own for each way of writing them.
    """
    kinds = [SCHEMES[scheme.kind] for scheme in block.experiment.schemes]
    plain = np.array([kind.round_off is round_off for kind in kinds])
    index = block.grid.levels.index(level)
    p, steps = block.omega_dt[:, index], block.grid.steps[index]
    size = STEPPED * UNIT_ROUND_OFF * (steps * p + steps**0.5 * p * p)
    return np.where(plain[:, None], np.minimum(size, MOST_ROUNDED), 0.0) / ABOVE_ROUND_OFF


def _running(block: MemberBlock, level: int, name: str, deviation: Floats) -> Floats:
    """Return the largest deviation over every step so far; where storage is bounded, over the samples so far."""
    record = block.records[level]
    if f"{name}_running_max" in record:
        return np.asarray(record[f"{name}_running_max"], dtype=float)
    values = np.abs(deviation)
    if name.endswith(CENTRED):
        values[..., [0, -1]] = 0.0
    return np.asarray(np.maximum.accumulate(values, axis=-1))


def _ratio(block: MemberBlock, level: int, name: str, deviation: Floats) -> Floats:
    """Return the energy over that at the start; from the energy itself, which has more digits where it decays."""
    record, initial = block.records[level], energy_at_start(block.records[level])[..., None]
    energy = name.replace("_deviation", "")
    values = record[energy] if energy in record else initial + deviation
    ratio = safe_ratio(*np.broadcast_arrays(values, initial))
    if name.endswith(CENTRED):
        ratio[..., 0] = 1.0
    return ratio
