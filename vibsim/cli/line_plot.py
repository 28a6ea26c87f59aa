"""Draw a series of any length as text, one line for each time.

Source: vibration text, section 3.4 (``visualize_front_ascii``) and exercise 13. Time runs downwards, the numerical and
the exact solution have a symbol each, and a column counts the periods.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from vibsim.core.array_types import Floats

NUMERICAL, EXACT, BOTH, AXIS = "+", "o", "*", "|"
LINES_PER_PERIOD = 20  # most lines per period
_LABELS = 24  # columns for the labels: the time and the number of periods
_LEAST, _MOST = 12, 72  # smallest and largest number of columns of the plot itself


class Series(NamedTuple):
    """A quantity of one member over time."""

    name: str
    unit: str
    t: Floats  # times, shape (t,), in s
    values: Floats  # the numerical solution at these times; not finite where it broke down
    exact: Floats | None  # the exact solution at these times, or a reference; None if unknown
    period: float  # period in s; not finite if there is none
    name_of_exact: str = "exact"


class Drawing(NamedTuple):
    """Lines of text, and the indices of the samples that they show."""

    lines: list[str]
    shown: range


def draw(series: Series, columns: int, rows: int, start: float = 0.0) -> Drawing:
    """Draw up to `rows` lines of a series, from time `start` [s], in a terminal with `columns` columns.

    A period has at most `LINES_PER_PERIOD` lines. Without a period the lines cover the whole series.
    """
    first = int((series.t < start).sum())
    shown = range(first, len(series.t), _stride(series, first, rows))[:rows]
    drawn = [*(series.values[n] for n in shown)]
    if series.exact is not None:
        drawn += [series.exact[n] for n in shown]
    finite = [float(value) for value in drawn if math.isfinite(value)]
    low, high = min(finite, default=0.0), max(finite, default=0.0)
    width = min(max(columns - _LABELS, _LEAST), _MOST)
    lines = [_head(series, low, high, width)]
    lines += _lines(series, shown, low, high, width)
    return Drawing(lines, shown)


def _stride(series: Series, first: int, rows: int) -> int:
    """Return the number of samples from one line to the next."""
    count = len(series.t) - first
    if count > 1 and math.isfinite(series.period) and series.period > 0:
        step = float(series.t[-1] - series.t[first]) / (count - 1)
        return max(round(series.period / (LINES_PER_PERIOD * step)), 1)
    return max(math.ceil(count / rows), 1)


def _head(series: Series, low: float, high: float, width: int) -> str:
    """Return the line above the plot: its range, and the headings of the columns beside it."""
    unit = f" [{series.unit}]" if series.unit not in ("", "1") else ""
    left, right = f"{low:.4g}", f"{high:.4g}"
    middle = f"{series.name}{unit}".center(max(width - len(left) - len(right), 0))
    periods = "periods" if math.isfinite(series.period) else ""
    return f"{'t':>10}  {left}{middle}{right}  {periods}".rstrip()


def _lines(series: Series, shown: range, low: float, high: float, width: int) -> Iterator[str]:
    def column(value: float) -> int:
        return round((value - low) / (high - low) * (width - 1)) if high > low else width // 2

    for n in shown:
        canvas = [" "] * width
        if low <= 0.0 <= high:
            canvas[column(0.0)] = AXIS
        value = float(series.values[n])
        exact = math.nan if series.exact is None else float(series.exact[n])
        if math.isfinite(exact):
            canvas[column(exact)] = EXACT
        if math.isfinite(value):
            place = column(value)
            canvas[place] = BOTH if canvas[place] == EXACT else NUMERICAL
        time = float(series.t[n])
        count = f"{time / series.period:.2f}" if math.isfinite(series.period) else ""
        note = count if math.isfinite(value) else f"{count} not finite"
        yield f"{time:>10.5g}  {''.join(canvas)}  {note}".rstrip()


def legend(series: Series) -> str:
    """Return the legend of the symbols."""
    text = f"{NUMERICAL} {series.name}"
    return text if series.exact is None else f"{text}, {EXACT} {series.name_of_exact}, {BOTH} both"
