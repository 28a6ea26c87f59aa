"""Batches of small sets of ladders, which are stacked and judged together.

A call of an array operation costs as much as hundreds of numbers. No result depends on the batches.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeVar

STACKED_LADDERS = 4096
"""Largest number of ladders that are stacked; a single set of more is processed alone."""

Row = TypeVar("Row")


def batches(rows: Sequence[Row], ladders: int) -> Iterator[Sequence[Row]]:
    """Yield groups of rows to be stacked; each row has this number of ladders."""
    size = max(STACKED_LADDERS // max(ladders, 1), 1)
    for start in range(0, len(rows), size):
        yield rows[start : start + size]
