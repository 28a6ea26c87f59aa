"""Ladders that are worked on together: few are put beside each other, many are judged in blocks in their own units.

A call of an array operation costs as much as hundreds of numbers, so the few ladders of a small experiment are put
beside each other. Arrays of many more would not stay in the cache of a core. No number depends on it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from vibsim.convergence.error_model.posterior import Ladder
from vibsim.convergence.reasons import code
from vibsim.core.array_types import Floats, Integers
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER

LADDERS = 4096
"""So many ladders at most are put beside each other; one row of more is worked on by itself."""
BLOCK = 1024
"""So many ladders are judged together at most."""
LARGEST_RATIO = 1e60
"""Of a difference to the largest finer one, and of noise to the largest difference: more says no more."""

Row = TypeVar("Row")


def batches(rows: Sequence[Row], ladders: int) -> Iterator[Sequence[Row]]:
    """Yield rows, of so many ladders each, that are worked on together."""
    size = max(LADDERS // max(ladders, 1), 1)
    for start in range(0, len(rows), size):
        yield rows[start : start + size]


def in_blocks(
    ladder: Ladder, work: Callable[[Ladder, Floats], dict[str, np.ndarray]]
) -> dict[str, np.ndarray]:
    """Return the reasons and the numbers of ladders.

    `work` gets finite ladders of three levels and more, over their sizes, and the factors on their differences.
    """
    n, count = len(ladder.h), len(ladder.gram)
    finite = np.all(np.isfinite(ladder.gram), axis=(-2, -1)) & np.all(
        np.isfinite(ladder.floor), axis=-1
    )
    reason = np.full(count, code("non_finite"), dtype=np.int8)
    found = _nothing(count, n) | {"reason": reason}
    if n < LEVELS_OF_AN_ORDER:
        reason[finite] = code("too_few_levels")
    else:
        every = np.flatnonzero(finite)
        for start in range(0, len(every), BLOCK):
            rows = every[start : start + BLOCK]
            part, size, factors = _scaled(ladder, rows)
            for name, value in work(part, factors).items():
                in_units = name in ("error", "error_bound", "best_bound")
                found[name][rows] = value * size if in_units else value
    return found


def _nothing(count: int, levels: int) -> dict[str, np.ndarray]:
    """Return the numbers of ladders of which nothing is known."""
    names = ("order", "low", "high", "error", "error_bound", "best_bound")
    unknown = {name: np.full(count, np.nan) for name in names}
    window = {"first": np.zeros(count, dtype=np.int64), "last": np.full(count, levels - 1)}
    weights = np.full((count, levels), np.nan)
    flags = {"contradicted": np.zeros(count, dtype=bool), "sure": np.ones(count, dtype=bool)}
    return {**unknown, **window, **flags, "weights": weights}


def _scaled(ladder: Ladder, rows: Integers) -> tuple[Ladder, Floats, Floats]:
    """Return some of the ladders over the norm of their largest row, that norm, and a factor on every difference.

    Squares of differences that are too large or small for each other would overflow or vanish: coarse levels that have
    blown up so far are brought nearer.
    """
    gram, count = ladder.gram[rows], len(ladder.h) - 1
    norms = np.sqrt(np.diagonal(gram, axis1=1, axis2=2))
    factors = np.ones_like(norms)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for k in range(count - 2, -1, -1):
            ratio = norms[:, k] / np.max((norms * factors)[:, k + 1 : count], axis=-1)
            factors[:, k] = np.where(ratio > LARGEST_RATIO, LARGEST_RATIO / ratio, 1.0)
    # beside differences of 0 any size will do
    factors = np.where(factors > 0.0, factors, 1.0)
    size = np.max(norms * factors, axis=-1)
    size = np.where(size > 0.0, size, 1.0)
    over = factors / size[:, None]
    gram = gram * over[:, :, None] * over[:, None, :]
    # squares of what is larger would overflow
    floor = np.minimum(ladder.floor[rows] / size[:, None], LARGEST_RATIO)
    part = replace(ladder, gram=gram, floor=floor, numbers=ladder.numbers[rows])
    return part, size, factors[:, :count]
