"""Orders that swing about one order from level to level: accidents of the levels, and no next power.

Coefficients of an error may depend on the level, by the phase of an oscillation or by chance: then every order is a
little wrong, one way or the other, although the shape of the differences stays. No trend can be read from such orders.
Their mean is the slope over all levels in it, in which most of the accidents cancel, and how far they are from it says
how surely it is known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.convergence.thresholds import (
    COINCIDENT,
    GROWS,
    JITTER_ORDERS,
    OF_SWINGS,
    QUIET,
    SURE_TURNS,
)
from vibsim.core.array_types import Flags, Floats, Integers


@dataclass(frozen=True)
class Uneven:
    """Where orders swing; arrays of shape (...)."""

    found: Flags
    sure: Flags
    """Whether they change their direction so often that no power can do that."""
    mean: Floats
    """Mean of these orders; NaN where they do not swing."""
    width: Floats
    """Half the width of its interval."""


def accidents(
    orders: Floats, scatter: Floats, last: Integers, several: Flags, tolerance: float
) -> Uneven:
    """Find the ladders of which the last orders swing about their mean, by no more than the tolerance.

    Parameters
    ----------
    orders, scatter
        Local order and signed scatter of every triple, shape (..., m).
    last
        The last triple that counts, shape (...).
    several
        Whether the order rests on several triples, shape (...).
    tolerance
        How far from their mean the orders may be.
    """
    fewest, most = JITTER_ORDERS
    shape = last.shape
    found, sure = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    mean, width = np.full(shape, np.nan), np.full(shape, np.nan)
    for count in range(fewest, min(most, orders.shape[-1]) + 1):
        index = np.maximum(last[..., None] - np.arange(count), 0)
        values, left = (np.take_along_axis(x, index, axis=-1) for x in (orders, scatter))
        change = np.diff(values, axis=-1)
        turns = np.sum(change[..., 1:] * change[..., :-1] < 0, axis=-1)
        middle = np.mean(values, axis=-1)
        away = np.max(np.abs(values - middle[..., None]), axis=-1)
        swings = several & (last + 1 >= count) & (away <= tolerance)
        swings &= turns >= (1 if count == fewest else SURE_TURNS)
        swings &= np.all((left >= 0) & (left <= COINCIDENT), axis=-1) & ~_turns_away(left)
        found |= swings
        sure = np.where(swings, turns >= SURE_TURNS, sure)
        mean = np.where(swings, middle, mean)
        width = np.where(swings, OF_SWINGS * away, width)
    return Uneven(found, sure, mean, width)


def _turns_away(scatter: Floats) -> Flags:
    """Say where the differences turn from their direction, as another power makes them do; the last triple first."""
    return (scatter[..., 0] > GROWS * scatter[..., 1]) & (scatter[..., 0] > QUIET)
