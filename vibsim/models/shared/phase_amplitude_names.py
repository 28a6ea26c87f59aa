"""Names of the parts of a position's error: a shift in time, and a factor of the amplitude.

The parts are quantities like others, but no level stores them: they are made from the position when levels are
compared (`vibsim.observe.phase_amplitude_error`).
"""

from __future__ import annotations

from vibsim.models.base import Model

PHASE, AMPLITUDE = "_phase_error", "_amplitude_error"
"""What follows the name of the position."""


def has_error_parts(model: Model) -> bool:
    """Tell whether the motion is smooth: across an impact, or a corner of the force, a shift is not all there is."""
    return model.events is None and model.lookup is None


def error_parts(model: Model) -> tuple[str, ...]:
    """Name the parts of every position's error; empty where there are none."""
    if not has_error_parts(model):
        return ()
    return tuple(name + end for name in model.positions for end in (PHASE, AMPLITUDE))


def is_error_part(name: str) -> bool:
    """Tell whether a quantity is a part of a position's error."""
    return name.endswith((PHASE, AMPLITUDE))


def whole_of(name: str) -> str:
    """Return the position that a part belongs to; any other quantity as it is."""
    return name.removesuffix(PHASE).removesuffix(AMPLITUDE)
