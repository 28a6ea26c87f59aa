"""What the pictures of all kinds of checks have in common: what they are, and their ticks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vibsim.checks.fields import name_of
from vibsim.core.record import Record
from vibsim.report import style
from vibsim.report.data import Floats, pick
from vibsim.report.evidence.svg_plot import Panel
from vibsim.report.text import words

MOST_LEVELS = 12
"""With more of them every second one is named."""
COLOUR, SECOND = style.COLOURS[0], style.COLOURS[1]
DECADES = 2.2
"""Up to so many decades a logarithmic scale has 1, 2 and 5 of each."""
DECADE_STEPS = (1, 2, 3, 5, 10, 20, 50, 100, 200)
"""Decades between ticks where there are more."""
FEW_DECADES = 0.7
"""Up to so many it has round numbers as a linear one."""

ALIKE = np.array([1.0 - 1e-11, 1.0 + 1e-11])
"""Growth factors between these differ by rounding only: a scale need not tell them apart."""
NEAR_ONE = 0.02
"""Growth factors that are all so near to 1 are shown less 1."""
FACTOR = 3.0
"""Growth factors beyond this, or one over it, have a logarithmic scale."""

Ticks = list[tuple[float, str]]


@dataclass(frozen=True)
class Picture:
    """A drawing and the words below it."""

    svg: str
    """Empty where there is nothing to draw; the words say why."""
    caption: str


@dataclass(frozen=True)
class Scale:
    """A vertical scale: how numbers are changed for it, and its ticks."""

    title: str
    change: Callable[[Floats], Floats]
    ticks: Callable[[float, float], Ticks]


def measured(record: Record, check: str, name: str, scheme: int, case: int) -> float:
    """Return a number that a check measured of a scheme and a member, such as its ``growth``."""
    return float(pick(record, name_of(check, name), scheme=scheme, case=case))


def short(value: float) -> str:
    """Write a number with up to four significant digits and no zeros behind them."""
    return words.number(float(f"{value:.4g}"), "step")


def brief(value: float) -> str:
    """Write a number with two significant digits."""
    return words.number(value, "brief")


FEWEST = 2
"""Round numbers on a scale: one alone does not tell how large a curve is."""


def ticks(low: float, high: float, most: int = 4) -> Ticks:
    """Return about `most` round numbers in a range, as a scale has them; `FEWEST` at least."""
    raw = (high - low) / most
    ten = 10.0 ** math.floor(math.log10(raw))
    steps = [m * ten for m in (10.0, 5.0, 2.0, 1.0, 0.5)]
    wide = min(step for step in steps if step >= raw)
    for step in steps[steps.index(wide) :]:
        first, last = math.ceil(low / step), math.floor(high / step)
        if last - first + 1 >= FEWEST:
            break
    return [(k * step, words.number(k * step, "step")) for k in range(first, last + 1)]


def log_ticks(low: float, high: float) -> Ticks:
    """Return at most about six ticks of a logarithmic scale.

    Parameters
    ----------
    low, high
        Its ends, as powers of ten.
    """
    if high - low <= FEW_DECADES:
        found = ticks(10.0**low, 10.0**high, 3)
        return [(math.log10(value), text) for value, text in found if value > 0.0]
    powers = range(math.floor(low), math.ceil(high) + 1)
    if high - low <= DECADES:
        values = [m * 10.0**k for k in powers for m in (1.0, 2.0, 5.0)]
        return [(math.log10(value), words.number(value, "step")) for value in values]
    step = next(k for k in DECADE_STEPS if 5 * k >= high - low)
    return [(float(k), style.power(k)) for k in powers if k % step == 0]


def level_ticks(levels: list[int], most: int = MOST_LEVELS) -> Ticks:
    """Name the levels, every second or third one where there are many."""
    every = 1 + len(levels) // (most + 1)
    return [(float(level), str(level)) for level in levels[::every]]


def of_levels(levels: list[int], low: float, high: float, width: float = 240.0) -> Panel:
    """Return an empty panel whose horizontal scale is the level."""
    return Panel((levels[0] - 0.5, levels[-1] + 0.5), (low, high), width)


def over_time(t: Floats, low: float, high: float) -> Panel:
    """Return an empty panel whose horizontal scale is the time."""
    return Panel((float(t[0]), float(t[-1])), (low, high))


def growth_scale(factors: Floats) -> Scale:
    """Return the scale on which growth factors can be told from each other and from 1.

    Parameters
    ----------
    factors
        Those to be shown: positive and finite, one at least.
    """
    if np.all(np.abs(factors - 1.0) <= NEAR_ONE):
        return Scale("growth per period, less 1", lambda x: x - 1.0, lambda a, b: ticks(a, b, 3))
    if factors.max() > FACTOR or factors.min() < 1.0 / FACTOR:
        return Scale("growth per period", logarithms, log_ticks)
    return Scale("growth per period", lambda x: x, ticks)


def logarithms(values: Floats) -> Floats:
    """Return the powers of ten of values; NaN of those that are not positive or not finite."""
    usable = (values > 0.0) & np.isfinite(values)
    return np.log10(np.where(usable, values, np.nan))
