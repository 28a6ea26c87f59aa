"""A verdict on a ladder as text for a terminal: status, sentence, advice, and the table of levels with bars."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from vibsim.convergence.study.notation import digits_of_values, number

if TYPE_CHECKING:
    from vibsim.convergence.study.verdict import LadderVerdict, Level

COLUMNS = 100
_BAR = 24
_LEAST = 4
"""Characters of the longest and of the shortest bar."""


def as_text(verdict: LadderVerdict, columns: int = COLUMNS) -> str:
    """Return the text, wrapped to a terminal with this number of columns."""
    return "\n".join(_lines(verdict, max(columns, 40)))


def _lines(verdict: LadderVerdict, columns: int) -> Iterator[str]:
    yield f"{verdict.status}  {verdict.reason}  {verdict.quantity}"
    for text in filter(None, (verdict.sentence, verdict.advice)):
        yield textwrap.indent(textwrap.fill(text, columns - 2), "  ")
    yield ""
    digits = digits_of_values(level.value for level in verdict.levels) if verdict.is_number else 4
    rows = [_head(verdict), *(_row(level, digits) for level in verdict.levels)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    bars = ["", *_bars(verdict.levels)]
    if any(bars):
        bars[0] = "|difference|, logarithmic"
    for row, bar in zip(rows, bars, strict=True):
        cells = "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))
        yield f"  {cells}  {bar}".rstrip()[:columns]


def _head(verdict: LadderVerdict) -> Sequence[str]:
    value = "value" if verdict.is_number else "norm"
    error = "error" if verdict.is_exact_known else "estimated error"
    return verdict.size_name, value, error, "difference", "ratio", "order"


def _row(level: Level, digits: int) -> Sequence[str]:
    return (
        number(level.h, 6),
        number(level.value, digits),
        number(level.error, 3),
        number(level.difference, 3),
        number(level.ratio, 4),
        "-" if level.order is None else f"{level.order:.2f}",
    )


def _bars(levels: Sequence[Level]) -> list[str]:
    """Return a bar for each level, with length proportional to the log of its difference; empty if fewer than two."""
    sizes = [abs(level.difference) if level.difference else 0.0 for level in levels]
    logs = [math.log10(size) if size > 0.0 else math.nan for size in sizes]
    known = [x for x in logs if not math.isnan(x)]
    if len(known) < 2:
        return [""] * len(levels)
    low, high = min(known), max(known)
    span = max(high - low, 1e-300)
    return [
        "" if math.isnan(x) else "#" * (_LEAST + round((_BAR - _LEAST) * (x - low) / span))
        for x in logs
    ]
