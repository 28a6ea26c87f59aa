"""What the checks of one level have in common: the level, and whether anything moves at it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibsim.convergence.thresholds import ABOVE_ROUND_OFF
from vibsim.core.array_types import Flags
from vibsim.observe.member_block import MemberBlock

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ConservesCheck, EqualCheck, StableCheck


def level_of(block: MemberBlock, check: StableCheck | ConservesCheck | EqualCheck) -> int:
    """Return the level that a check is about: the finest one where it names none."""
    return block.grid.levels[-1] if check.level is None else check.level


def lies_still(block: MemberBlock, level: int) -> Flags:
    """Say where no position moves by more than round-off at any step of a level, shape (scheme, case)."""
    record, still = block.records[level], np.ones(block.shape, dtype=bool)
    floor = ABOVE_ROUND_OFF * block.relative_floor[..., block.grid.levels.index(level)]
    for name in block.model.positions:
        if f"{name}_min" not in record:
            return np.zeros(block.shape, dtype=bool)
        low, high = (np.asarray(record[f"{name}_{end}"], dtype=float) for end in ("min", "max"))
        with np.errstate(invalid="ignore"):
            still &= high - low <= floor * np.maximum(np.abs(low), np.abs(high))
    return still
