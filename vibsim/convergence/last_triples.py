"""The last triples of a ladder before round-off: what the order and its trend are read from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibsim.convergence.roundoff_onset import LOG2
from vibsim.convergence.settled_orders import HIDDEN, JUMP, READABLE

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]

AGREE = 0.01
"""Two triples agree that have no more left besides one power."""


@dataclass(frozen=True)
class Tail:
    """The last triples of every ladder; arrays of shape (...)."""

    count: Integers
    """Number of triples before round-off."""
    last: Integers
    """The last of them."""
    several: Flags
    """Whether the one before belongs to the window, too."""
    local: Floats
    """The last local order."""
    change: Floats
    """Its change from the triple before; 0 where there is one triple only."""
    earlier: Floats
    """The change before that; NaN where the order rests on two triples only."""
    spread: Floats
    """Signed scatter of the last triple."""
    before: Floats
    """That of the triple before; 0 where there is one triple only."""
    noise: Floats
    """How much of the last triple the predicted round-off may be."""


def last_triples(orders: Floats, scatter: Floats, clean: Flags, noise: Floats) -> Tail:
    """Return the last triples of ladders; all arrays of shape (..., m), of which the `clean` ones come first."""
    count = np.sum(clean, axis=-1)
    last = np.maximum(count - 1, 0)
    local, spread, rest = (at(x, last) for x in (orders, scatter, noise))
    jump = np.abs(local - at(orders, last - 1))
    several = (count > 1) & ~_starts_here(jump, np.abs(spread), rest)
    before = np.where(several, at(scatter, last - 1), 0.0)
    change = np.where(several, local - at(orders, last - 1), 0.0)
    known = several & (count > 2)
    earlier = np.where(known, at(orders, last - 1) - at(orders, last - 2), np.nan)
    earlier = np.where(_starts_before(before, change, earlier), np.nan, earlier)
    return Tail(count, last, several, local, change, earlier, spread, before, rest)


def _starts_here(jump: Floats, size: Floats, noise: Floats) -> Flags:
    """Say where the window begins with the last triple: it is proportional, and the one before has another order.

    A power that fades would have left more in the scatter than there is. The coarser levels are of another range:
    they have blown up, or their errors are as large as the solution.
    """
    return (jump > JUMP) & (size <= HIDDEN) & (size > np.maximum(READABLE, 3 * noise))


def _starts_before(before: Floats, change: Floats, earlier: Floats) -> Flags:
    """Say where the window begins with the last triple but one: the last two agree, and the one before is far away."""
    return (np.abs(earlier) > JUMP) & (np.hypot(before, LOG2 * change) <= AGREE)


def at(values: Floats, index: Integers) -> Floats:
    """Return one entry of the last axis for each ladder; the first one for a negative index."""
    return np.take_along_axis(values, np.maximum(index, 0)[..., None], axis=-1)[..., 0]
