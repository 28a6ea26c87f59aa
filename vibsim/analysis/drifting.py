"""The drift of the energy of an experiment's members, from what the levels hold; see `vibsim.analysis.drift`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.drift import Drift, drift_of
from vibsim.analysis.facts import BLAME
from vibsim.analysis.floor import SPACING_AT_ONE, solution_size
from vibsim.analysis.part import CENTRED, Part, energy_at_start
from vibsim.analysis.series import safe_ratio
from vibsim.schemes import SCHEMES
from vibsim.schemes.base import UNIT_ROUND_OFF, round_off

Floats = NDArray[np.float64]

STEPPED = 4.0
"""How often ``N p + N^(1/2) p^2`` round-offs may be in the energy of a scheme that keeps it: 1.02 at most was seen."""
MOST_ROUNDED = 1e-3
"""Part of the energy above which a deviation is never called rounding, however large the step."""


def drift_at(part: Part, level: int, name: str = "energy_deviation") -> Drift:
    """Find how an energy deviation grows at a level; NaN rows of its series are ``unclear``.

    Parameters
    ----------
    name
        ``energy_deviation`` or ``energy_deviation_d2t``.
    """
    record, index = part.records[level], part.grid.levels.index(level)
    initial = energy_at_start(record)
    missing = np.full((*part.shape, len(record["t"])), np.nan)
    deviation = np.asarray(record[name], dtype=float) if name in record else missing
    size = np.abs(initial) + solution_size([np.nan_to_num(deviation)])
    floor = part.floor_of(name, size)[..., index]
    floor = np.maximum(floor, _of_steps(part, level) * size * part.magnified)
    # the tolerance of an adaptive scheme is an error that it makes, and no round-off
    floor[part.adaptive] = SPACING_AT_ONE * size[part.adaptive]
    w = np.asarray(record["natural_frequency"], dtype=float)
    return drift_of(
        _running(part, level, name, deviation),
        _ratio(part, level, name, deviation),
        initial,
        floor,
        w * part.group.end / (2.0 * np.pi),
    )


def _of_steps(part: Part, level: int) -> Floats:
    """Return what rounding adds to the energy in proportion to the size of a step, over `BLAME`, (scheme, case).

    Rounded coefficients make every step, of the size p = w dt, larger or smaller by the same: N p. Steps larger than a
    radian are differences of numbers p^2 large, which are rounded otherwise each time: ``N^(1/2) p^2``. Centred
    differences have a prediction of their own for each way of writing them.
    """
    kinds = [SCHEMES[scheme.kind] for scheme in part.experiment.schemes]
    plain = np.array([kind.round_off is round_off for kind in kinds])
    index = part.grid.levels.index(level)
    p, steps = part.omega_dt[:, index], part.grid.steps[index]
    size = STEPPED * UNIT_ROUND_OFF * (steps * p + steps**0.5 * p * p)
    return np.where(plain[:, None], np.minimum(size, MOST_ROUNDED), 0.0) / BLAME


def _running(part: Part, level: int, name: str, deviation: Floats) -> Floats:
    """Return the largest deviation over every step so far; where storage is bounded, over the samples so far."""
    record = part.records[level]
    if f"{name}_running_max" in record:
        return np.asarray(record[f"{name}_running_max"], dtype=float)
    values = np.abs(deviation)
    if name.endswith(CENTRED):
        values[..., [0, -1]] = 0.0
    return np.asarray(np.maximum.accumulate(values, axis=-1))


def _ratio(part: Part, level: int, name: str, deviation: Floats) -> Floats:
    """Return the energy over that at the start; from the energy itself, which has more digits where it decays."""
    record, initial = part.records[level], energy_at_start(part.records[level])[..., None]
    energy = name.replace("_deviation", "")
    values = record[energy] if energy in record else initial + deviation
    ratio = safe_ratio(*np.broadcast_arrays(values, initial))
    if name.endswith(CENTRED):
        ratio[..., 0] = 1.0
    return ratio
