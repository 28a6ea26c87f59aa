"""Cells of a result of a check; the index needs them without what measures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vibsim.core.vocabulary import ERROR_FACTS, decisive_number
from vibsim.report import words
from vibsim.report.tables.table import Cell


def measured_order(result: Mapping[str, Any]) -> tuple[Cell, Cell, Cell, Cell]:
    """Return the order of a result, the ends of its interval, and the levels that it rests on."""
    low, high = words.interval_of(result) or (None, None)
    window = words.levels_of(result)
    return words.fact(result, "order"), low, high, words.levels(window) if window else None


def number_of(result: Mapping[str, Any]) -> float | None:
    """Return the number that decides a result."""
    return decisive_number(result.get("facts") or {})


def error_of(result: Mapping[str, Any]) -> tuple[Cell, ...]:
    """Return the error of the finest level, its bound, and the error over the size of the solution."""
    return tuple(words.fact(result, name) for name in ERROR_FACTS)
