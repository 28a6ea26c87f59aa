"""What a ``value`` check asks of a number, and how far beyond that a number is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.numbers_in_words import number
from vibsim.spec.values import VALUES

if TYPE_CHECKING:
    from vibsim.spec.checks import ValueCheck

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

HALF = 0.5
"""Counted numbers are equal, or apart by more."""


def compare(check: ValueCheck, measured: Floats) -> tuple[Flags, Floats]:
    """Return where numbers are as they should be, and how far beyond the border they are; of any shape."""
    if check.below is not None:
        return measured < check.below, measured - check.below
    if check.above is not None:
        return measured > check.above, check.above - measured
    wanted = float("nan") if check.equals is None else check.equals
    away, allowed = np.asarray(np.abs(measured - wanted)), check.allowed
    return away <= allowed, away - allowed


def rule(check: ValueCheck) -> str:
    """Say what a number should be."""
    if check.below is not None:
        return f"below {number(check.below)}"
    if check.above is not None:
        return f"above {number(check.above)}"
    wanted = float("nan") if check.equals is None else check.equals
    is_counted = VALUES[check.value].measure == "count" and check.allowed < HALF
    told = f"{wanted:.15g}" if is_counted else f"{wanted!r} within {number(check.allowed)}"
    return f"equal to {told}"


def border(check: ValueCheck) -> str:
    """Return the key that holds the number that the check asks for."""
    return next(key for key in ("equals", "below", "above") if getattr(check, key) is not None)
