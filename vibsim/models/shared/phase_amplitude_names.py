"""Names of the parts of a position's error: a shift in time, and a factor of the amplitude.

The parts are quantities like others, but no level stores them: they are made from the position when levels are
compared (`vibsim.observe.phase_amplitude_error`).
"""

from __future__ import annotations

from vibsim.core.vocabulary import AMPLITUDE, PHASE
from vibsim.models.base import Model


def has_error_parts(model: Model) -> bool:
    """Tell whether the motion is smooth and its accelerations are known.

    Across an impact, or a corner of the force, a shift is not all there is; accelerations of a structure are not kept.
    """
    return model.events is None and model.lookup is None and model.loaded is None


def error_parts(model: Model) -> tuple[str, ...]:
    """Name the parts of every position's error; empty where there are none."""
    if not has_error_parts(model):
        return ()
    return tuple(name + end for name in model.positions for end in (PHASE, AMPLITUDE))
