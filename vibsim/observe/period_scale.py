"""How long an oscillation of a member takes, as far as windows over time need to know it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vibsim.observe.member_block import MemberBlock
from vibsim.observe.thresholds import PIECES_OF_TIME

Floats = NDArray[np.float64]


def swing(block: MemberBlock) -> Floats:
    """Return the period of the motion of every member, in the unit of time, shape (case,).

    That of the exact solution where it has one, else that of small oscillations; of a motion with neither, an eighth
    of the time.
    """
    end = np.broadcast_to(block.group.end, block.shape[1:])
    exact = _of_case(block, "exact_period")
    w = np.abs(_of_case(block, "natural_frequency"))
    with np.errstate(divide="ignore"):
        small = np.where(w > 0, 2.0 * math.pi / w, np.nan)
    found = np.where(np.isfinite(exact) & (exact > 0), exact, small)
    return np.asarray(np.where(np.isfinite(found), found, end / PIECES_OF_TIME))


def _of_case(block: MemberBlock, name: str) -> Floats:
    """Return a number of every member; NaN where the levels do not hold it."""
    if name not in block.finest:
        return np.full(block.shape[1:], np.nan)
    return np.broadcast_to(np.asarray(block.finest[name], dtype=np.float64), block.shape[1:])
