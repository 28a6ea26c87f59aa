"""What a ``value`` check asks of a number, how far beyond that a number is, and on which levels it rests."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim.experiment.value_names import VALUES

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import ValueCheck

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def compare(check: ValueCheck, measured: Floats) -> tuple[Flags, Floats]:
    """Return where numbers are as they should be, and how far beyond the border they are; of any shape."""
    if check.below is not None:
        return measured < check.below, measured - check.below
    if check.above is not None:
        return measured > check.above, check.above - measured
    wanted = float("nan") if check.equals is None else check.equals
    away, allowed = np.asarray(np.abs(measured - wanted)), check.allowed
    return away <= allowed, away - allowed


SAMPLED = ("at", "end")
"""Numbers that are a sample of a series, and are told by its name."""


COUNTED = frozenset({"accepted_steps", "force_evaluations"})
"""Numbers that finer levels make larger, and no more accurate."""


def depends_on_level(name: str) -> bool:
    """Say whether a number is another at another level, or rests on the whole ladder."""
    return "level" in VALUES[name].at or sees_several_levels(name)


def lacks_levels(experiment: Experiment, check: ValueCheck) -> bool:
    """Say whether a number rests on more levels than the experiment has."""
    return VALUES[check.value].finer_levels >= len(experiment.levels)


def sees_several_levels(name: str) -> bool:
    """Say whether a number rests on more than one level: on finer ones, or on the whole ladder."""
    row = VALUES[name]
    return row.finer_levels > 0 or (row.of == "convergent" and "level" not in row.at)
