"""Ladders that are worked on together.

A call of an array operation costs as much as hundreds of numbers, so the few ladders of a small experiment are put
beside each other. Arrays of many more would not stay in the cache of a core. No number depends on it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeVar

LADDERS = 4096
"""So many ladders at most are put beside each other; one row of more is worked on by itself."""

Row = TypeVar("Row")


def batches(rows: Sequence[Row], ladders: int) -> Iterator[Sequence[Row]]:
    """Yield rows, of so many ladders each, that are worked on together."""
    size = max(LADDERS // max(ladders, 1), 1)
    for start in range(0, len(rows), size):
        yield rows[start : start + size]
