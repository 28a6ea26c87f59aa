r"""What would settle a verdict that is open: how many finer levels, or which levels and which arithmetic.

**Too coarse.** With ``d_k = a h^p + b h^q`` the local orders approach the order p of the scheme, or the expected one
where they are nearer to that, like ``p_k - p = C r^k``, ``r = 2^-(q-p)`` per level. So the last order and the factor r,
as it was seen or as the powers of the scheme give it, say at which level the order is within the tolerance; one more
confirms it. An order far above p is that of levels which have nothing to do with the solution, and tells nothing.

**Round-off.** Differences fall like h^p from the finest clean one on, the predicted round-off of an arithmetic grows
with the number of steps. An order can be read from three levels as long as the finer of their two differences is
`ORDER_ABOVE_ROUND_OFF` times the round-off of its levels.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.formal_orders import even_powers, relative_floors
from vibsim.comparison.order_evidence import evidence
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.convergence.thresholds import (
    HALF_SPACING,
    LEAST_CANDIDATE,
    MOST_ABOVE,
    ORDER_ABOVE_ROUND_OFF,
    ORDINARY_ORDER,
)
from vibsim.convergence.verdict import Judgement
from vibsim.core.vocabulary import REASON_NAMES

Floats = NDArray[np.float64]
Codes = NDArray[np.int8]

UNKNOWN = -1
MOST = 12
"""More levels than that are no prediction."""
SLOWEST = 0.9
"""Orders that approach by a larger factor do not tell where they go."""
FINEST = 40
"""No finer level is looked at."""


def more_levels(q: Comparison, judged: Judgement, order: Floats, tolerance: float) -> Codes:
    """Return how many finer levels a ladder that is too coarse probably needs, shape (scheme, case).

    Parameters
    ----------
    q
        The quantity, compared between levels.
    judged
        The verdict on it.
    order
        Expected order, which broadcasts against (scheme, case).
    tolerance
        How far from it an order may be.

    Returns
    -------
    array
        At least 1; `UNKNOWN` where nothing is known, or the verdict is another one.
    """
    shape, orders = judged.reason.shape, judged.orders
    needed = np.full(shape, UNKNOWN, dtype=np.int8)
    early = judged.reason == REASON_NAMES.index("pre_asymptotic")
    if not np.any(early) or not orders.shape[-1]:
        return needed
    aim = _aim(q, orders[..., -1], np.broadcast_to(order, shape))
    away = np.abs(orders - aim[..., None])
    with np.errstate(all="ignore"):
        promised = np.where(even_powers(q.block.experiment, q.name, q.block.columns), 0.25, 0.5)
        seen = away[..., -1] / away[..., -2] if orders.shape[-1] > 1 else promised
        # what was seen once may be an accident; no power falls faster than the next one
        factor = np.maximum(seen, promised)
        steps = np.ceil(np.log(tolerance / away[..., -1]) / np.log(factor)) + 1
        # an error that falls faster than the powers do is none of them
        known = early & np.isfinite(steps) & (orders[..., -1] <= aim + MOST_ABOVE)
        # how small the promised power still is, behind a higher one, is not in the orders
        known &= ~(
            (orders[..., -1] > q.order + HALF_SPACING) & (q.special > q.order + HALF_SPACING)
        )
    known &= (factor <= SLOWEST) & (steps <= MOST)
    needed[known] = np.maximum(steps[known], 1).astype(np.int8)
    return needed


def _aim(q: Comparison, last: Floats, order: Floats) -> Floats:
    """Return the order that the levels approach: the one that the scheme has, where they are nearer to that one."""
    has = np.broadcast_to(q.order, last.shape)
    with np.errstate(invalid="ignore"):
        return np.where(np.abs(last - has) < np.abs(last - order), has, order)


def finest_readable(
    q: Comparison, judged: Judgement, norm: str, order: Floats, arithmetic: str | None = None
) -> Codes:
    """Return the finest level at which an order can still be read, shape (scheme, case).

    Parameters
    ----------
    norm
        In which differences are measured.
    order
        Expected order, which broadcasts against (scheme, case).
    arithmetic
        Of the schemes that have several; the one that they have where None.

    Returns
    -------
    array
        `UNKNOWN` where the verdict is not ``round_off``, or no three levels show an order.
    """
    shape = judged.reason.shape
    found = np.full(shape, UNKNOWN, dtype=np.int8)
    lost = judged.reason == REASON_NAMES.index("round_off")
    with np.errstate(invalid="ignore"):
        shown = judged.order >= LEAST_CANDIDATE
    p = np.where(shown, judged.order, np.broadcast_to(order, shape))
    lost &= np.isfinite(p)
    if not np.any(lost):
        return found
    size, at = _clean_difference(q, norm, p)
    noise = _noise(q, norm, arithmetic)
    with np.errstate(all="ignore"):
        for level in range(FINEST - 1):
            fall = np.exp2(p * (at - level - 1))
            clean = (size > 0.0) & (
                size * fall >= ORDER_ABOVE_ROUND_OFF * (noise(level + 1) + noise(level + 2))
            )
            found = np.where(lost & clean, level + 2, found).astype(np.int8)
    return found


def _clean_difference(q: Comparison, norm: str, p: Floats) -> tuple[Floats, Floats]:
    """Return the finest difference above round-off, as that of neighbouring levels, and its coarser level.

    Where none is above it, the coarsest difference is taken, which is noise: what can be read is then too much.
    """
    levels = q.block.grid.levels
    e = evidence(q, norm, q.order, ORDINARY_ORDER)
    place = np.zeros(p.shape, dtype=np.int64)
    for i in range(len(levels) - 1):
        clean = e.difference[..., i] >= ORDER_ABOVE_ROUND_OFF * (
            e.floor[..., i] + e.floor[..., i + 1]
        )
        place = np.where(clean, i, place)
    size = np.take_along_axis(e.difference, place[..., None], axis=-1)[..., 0]
    gap = np.diff(np.array(levels))[place]
    whole = np.where(gap > 1, np.expm1(-p * np.log(2.0)) / np.expm1(-p * gap * np.log(2.0)), 1.0)
    return size * whole, np.array(levels, dtype=np.float64)[place]


def _noise(q: Comparison, norm: str, arithmetic: str | None) -> Callable[[int], Floats]:
    """Return what gives the predicted round-off of a level in a norm, shape (scheme, case)."""
    block = q.block
    e = evidence(q, norm, q.order, ORDINARY_ORDER)
    if block.stored_floor[-1] > 0.0:
        # what storing leaves is the same at every level, in any arithmetic
        return lambda level: e.floor[..., -1]
    base = e.floor[..., -1] / block.relative_floor[..., -1]

    def at(level: int) -> Floats:
        steps = (block.experiment.steps(level),)
        floors = relative_floors(block.experiment, steps, block.columns, arithmetic)
        return np.asarray(base * floors[..., 0])

    return at
