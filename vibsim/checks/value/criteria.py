"""What a ``value`` check asks of a number, and how far beyond that a number is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim.checks.numbers_in_words import number
from vibsim.experiment.value_names import VALUES

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ValueCheck

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


SAMPLED = ("at", "end")
"""Numbers that are a sample of a series, and are told by its name."""


def what(check: ValueCheck, quantity: str | None = None, value: str = "") -> str:
    """Say which number is meant.

    Parameters
    ----------
    quantity, value
        How the page writes the quantity and the name of the number; as the check does where not given.
    """
    quantity, value = quantity or check.quantity, value or check.value
    when = "at the end"
    if check.at.t is not None or check.at.step is not None:
        when = f"at t = {check.at.t:g}" if check.at.t is not None else f"at step {check.at.step}"
    if check.value in SAMPLED:
        return f"{quantity} {when}"
    return f"{value} of {quantity}" if quantity else value


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
