"""Blocks of ladders that are judged at once, each ladder scaled to its own size.

Arrays of many more ladders would exceed the cache of a core. No result depends on the blocks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from vibsim.convergence.error_model.ladder import Ladder
from vibsim.convergence.reasons import code
from vibsim.core.array_types import Floats, Integers
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER

BLOCK_LADDERS = 2048
"""Largest number of ladders that are judged at once."""
LARGEST_RATIO = 1e60
"""Limit of the ratio of a difference to the largest finer one, and of noise to the largest difference."""


def in_blocks(
    ladder: Ladder, work: Callable[[Ladder, Floats], dict[str, np.ndarray]]
) -> dict[str, np.ndarray]:
    """Return the fields of an `Assessment` of ladders, and `sure`.

    `work` is called with scaled, finite ladders of at least three levels and the factors of `_scaled`.
    """
    n, count = len(ladder.h), len(ladder.gram)
    finite = np.all(np.isfinite(ladder.gram), axis=(-2, -1)) & np.all(
        np.isfinite(ladder.floor), axis=-1
    )
    reason = np.full(count, code("non_finite"), dtype=np.int8)
    result = _unknown(count, n) | {"reason": reason}
    if n < LEVELS_OF_AN_ORDER:
        reason[finite] = code("too_few_levels")
    else:
        finite_rows = np.flatnonzero(finite)
        for start in range(0, len(finite_rows), BLOCK_LADDERS):
            rows = finite_rows[start : start + BLOCK_LADDERS]
            block, size, factors = _scaled(ladder, rows)
            for name, value in work(block, factors).items():
                has_unit = name in ("error", "error_bound", "best_bound")
                result[name][rows] = value * size if has_unit else value
    return result


def _unknown(count: int, levels: int) -> dict[str, np.ndarray]:
    """Return the fields of undecided ladders, except for the reason."""
    names = ("order", "low", "high", "error", "error_bound", "best_bound", "logarithm")
    numbers = {name: np.full(count, np.nan) for name in names}
    window = {"first": np.zeros(count, dtype=np.int64), "last": np.full(count, levels - 1)}
    weights = np.full((count, levels), np.nan)
    flags = {"contradicted": np.zeros(count, dtype=bool), "sure": np.ones(count, dtype=bool)}
    return {**numbers, **window, **flags, "weights": weights}


def _scaled(ladder: Ladder, rows: Integers) -> tuple[Ladder, Floats, Floats]:
    """Return some ladders divided by the norm of their largest row, that norm, and a factor for each difference.

    The factors shrink differences of coarse levels that have blown up, whose squares would overflow.
    """
    gram, count = ladder.gram[rows], len(ladder.h) - 1
    norms = np.sqrt(np.diagonal(gram, axis1=1, axis2=2))
    factors = np.ones_like(norms)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for k in range(count - 2, -1, -1):
            ratio = norms[:, k] / np.max((norms * factors)[:, k + 1 : count], axis=-1)
            factors[:, k] = np.where(ratio > LARGEST_RATIO, LARGEST_RATIO / ratio, 1.0)
    # next to differences of 0 any factor will do
    factors = np.where(factors > 0.0, factors, 1.0)
    size = np.max(norms * factors, axis=-1)
    size = np.where(size > 0.0, size, 1.0)
    scales = factors / size[:, None]
    gram = gram * scales[:, :, None] * scales[:, None, :]
    # squares of larger noise would overflow
    floor = np.minimum(ladder.floor[rows] / size[:, None], LARGEST_RATIO)
    block = replace(ladder, gram=gram, floor=floor, numbers=ladder.numbers[rows])
    return block, size, factors[:, :count]
