"""What a ``stable`` check measures: whether a run grows, and whether by as much as theory predicts.

Unstable is an overflow, w dt beyond the stability limit of the scheme, or growth beyond the exact solution's that
refinement within the ladder does not remove (``docs/verdicts.md``, Stable, conserves, equal). The growth of Forward
Euler vanishes with dt and is none. An overflow at a time that finer levels do not move is that of the motion, an escape
or a formula that has no value there, and no instability.
At the limit itself a scheme may be stable or grow in proportion to t: there the measurement alone decides.

Beyond the limit of a linear model the growth must be the predicted one. The amplitude may follow it late: at a limit
two roots meet, and ``1 + 2 N`` comes before the power takes over. So the logarithms of both over the whole run may
differ by `NEAR` of themselves and ln(4 + 2 N). A larger difference means that scheme or theory is not what it claims to
be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibsim.convergence.thresholds import BLOWN_UP
from vibsim.observe import oscillation, predicted_oscillation
from vibsim.observe.member_block import MemberBlock

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

LIMIT_ROUNDING = 1e-9
"""w dt within this part of the limit is at the limit, as in `ladder_statistics.breakdown`."""
ALIKE = 0.15
"""Two levels fail at one time that fail within this part of it: the finer one sees it at most a step earlier."""
NEAR = 0.1
"""How far the logarithm of a growth may be from the predicted one, as a part of it."""


@dataclass(frozen=True)
class Growth:
    """What was found of a level; arrays of shape (scheme, case)."""

    unstable: Flags
    escaped: Flags
    """Whether the motion itself, not the step, ends the calculation: an escape, or a formula without a value."""
    contradicted: Flags
    """Whether a linear model beyond the limit grows otherwise than predicted_oscillation."""
    measured: Floats
    """Growth factor of the amplitude per period; NaN below two peaks, and of several coordinates."""
    predicted: Floats
    """The same by theory, of the fastest small oscillations; NaN for adaptive schemes."""


def growth_at(block: MemberBlock, level: int) -> Growth:
    """Find whether schemes and members are stable at a level."""
    index = block.grid.levels.index(level)
    p = np.broadcast_to(block.fastest[:, index], block.shape)
    beyond = p > block.stability_limit * (1.0 + LIMIT_ROUNDING)
    at_limit = ~beyond & (p >= block.stability_limit * (1.0 - LIMIT_ROUNDING))
    broken = block.failed[..., index]
    escaped = broken & ~beyond & _breaks_down_alike(block)
    growth = block.growth[..., index]
    grown = (growth > BLOWN_UP) & (at_limit | ~_removed(block, index))
    measured = _measured(block, level)
    expected = predicted_oscillation.dominant_growth(block, level)
    short = ~broken & predicted_oscillation.is_simple(block) & beyond
    return Growth(
        unstable=(broken & ~escaped) | beyond | grown,
        escaped=escaped & ~grown,
        contradicted=short & _differs(block, index, measured, expected),
        measured=measured,
        predicted=expected,
    )


def _measured(block: MemberBlock, level: int) -> Floats:
    """Return the growth as `convergence.nc` has it, and where a run is too short for that the one over all of it."""
    found = oscillation.growth_of_motion(block, level)
    if len(block.model.positions) > 1:
        return found
    return np.where(
        np.isfinite(found), found, oscillation.growth_over_run(block, block.records[level])
    )


def _breaks_down_alike(block: MemberBlock) -> Flags:
    """Say where the two finest levels broke down at the same time, which a finer one does not move, shape (s, c)."""
    finest = [block.records[level] for level in block.grid.levels[-2:]]
    if len(finest) == 1 or any("failure_time" not in record for record in finest):
        return np.zeros(block.shape, dtype=bool)
    before, last = (np.asarray(record["failure_time"], dtype=float) for record in finest)
    alike = np.abs(before - last) <= ALIKE * before
    return np.asarray(np.all(block.failed[..., -2:], axis=-1) & alike)


def _removed(block: MemberBlock, index: int) -> Flags:
    """Say where the next finer level, or the step from the next coarser one, at least halves the growth."""
    growth = block.growth
    if growth.shape[-1] == 1:
        return np.zeros(block.shape, dtype=bool)
    coarse = min(index, growth.shape[-1] - 2)
    return np.asarray(growth[..., coarse + 1] < 0.5 * growth[..., coarse])


def _differs(block: MemberBlock, index: int, measured: Floats, expected: Floats) -> Flags:
    periods = predicted_oscillation.natural_frequency(block) * block.group.end / (2.0 * np.pi)
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = np.abs(np.log(measured) - np.log(expected)) * periods
        whole = np.log(expected) * periods
    late = np.log(4.0 + 2.0 * block.grid.steps[index])
    return np.asarray(apart > NEAR * np.abs(whole) + late)
