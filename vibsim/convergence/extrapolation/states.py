r"""Extrapolation of a motion over all levels, at each time independently: the best entry and its error bound.

The triangular scheme and the error bar are those of `vibsim.convergence.extrapolation`, with the powers of the scheme.

The error of an entry is estimated, besides round-off, as follows:

- the change ``T[i][j-1] - T[i-1][j-1]`` and the factor K by which it must fall in its column give the remaining error
  of ``T[i][j-1]``. If changes fall by another factor, faster or slower, the entry is trusted less: `trust` is the worst
  agreement, a factor up to 1, over all columns of the row so far.
- one more extrapolation reduces that error about as much as the last one did, times the cost of the coarser level, and
  never below `LARGEST_GAIN` of it. If every power is taken to be there, some may be missing or small: the extrapolation
  that should remove one then gains nothing, and the one before it much. So it counts as gaining no more than the worse
  of the last two, and the second as gaining nothing.
- if a finer row contradicts an entry, the error is at least the contradiction.

The error is the larger of du and dv/w, so that it is not small where one of them happens to cross zero. For the same
reason a change at any time is the largest change so far.

The same code works on floats (one member, one time, without numpy's overhead) and on arrays, with the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from vibsim.convergence.extrapolation import thresholds as th
from vibsim.convergence.extrapolation.triangular_scheme import (
    Entry,
    error_left,
    next_row,
    triangular_scheme,
)
from vibsim.convergence.thresholds import ROUND_OFF_SAFETY
from vibsim.elementary.exponential import power

LASTING = 2.0**-52
"""Relative error that all levels share: rounding of parameters, of the step, and in elementary functions."""

_TINY = 1e-200


@dataclass(frozen=True)
class Arithmetic:
    """The operations that differ between floats and arrays. `larger` and `smaller` ignore NaN."""

    larger: Callable[[Any, Any], Any]
    smaller: Callable[[Any, Any], Any]
    choose: Callable[[Any, Any, Any], Any]
    so_far: Callable[[Any], Any]  # running maximum over time; may overwrite its argument
    holds_anywhere: Callable[[Any], Any]


def _larger(a: float, b: float) -> float:
    return a if a > b or b != b else b


def _smaller(a: float, b: float) -> float:
    return a if a < b or b != b else b


def _choose(condition: bool, a: Any, b: Any) -> Any:
    return a if condition else b


def _so_far(values: Any) -> Any:
    if values.shape[1] < MANY_MEMBERS:
        return np.fmax.accumulate(values, axis=0)
    for previous, current in pairwise(values):
        np.fmax(previous, current, out=current)
    return values


MANY_MEMBERS = 16
"""From this number of members on, ``np.fmax.accumulate`` is slower than a Python loop over times."""

FLOATS = Arithmetic(_larger, _smaller, _choose, lambda value: value, bool)
"""For one member at one time."""
ARRAYS = Arithmetic(np.fmax, np.fmin, np.where, _so_far, np.any)
"""For arrays of shape (t, case)."""


@dataclass(frozen=True)
class Circumstances:
    """Facts about the members besides their levels; floats, or arrays that broadcast against (t, case)."""

    rate: Any  # w: dv/w counts like du
    size: Any  # size of the solution over the whole run
    limit: Any  # larger estimated errors count as unknown
    phase: Any  # w t
    response: Any  # ``1/(w end)^p``, a factor of the response; 0 if disturbances do not grow
    noise: Any  # round-off so far, in units of its prediction for a solution of size 1; at least `size`
    # ratio of the responses to a lasting and to a momentary disturbance: ``max(1, w t)``; 1 without measured noise
    spread: Any


class Best(NamedTuple):
    """The best entry at each time of each member; floats, or arrays of shape (t, case)."""

    position: Any
    velocity: Any
    error: Any  # bound of the errors of the position and of velocity/w; infinite if unknown
    # row of the entry times number of levels plus its column; the finest level if the error is unknown, -1 if failed
    entry: Any


Pair = tuple[Any, Any]
"""Position and velocity."""


@dataclass(frozen=True)
class Tableau:
    """The coefficients that depend only on the steps of the levels and on the scheme with its options."""

    entries: tuple[tuple[Entry, ...], ...]  # row i holds the entries j = 1, ..., i
    round_off: tuple[tuple[float, ...], ...]  # relative round-off of the entries
    # Row i times the change of its level times ``1/(w end)^p`` is the response of the motion to a lasting relative
    # disturbance of its equation. (Central differences disturb it by ``(w h)^p / (2 (p+1)!)``.)
    amplification: tuple[float, ...]
    has_every_power: bool  # whether the powers are p, p + 1, ..., some of which may be missing


@lru_cache(maxsize=256)
def tableau(steps: tuple[int, ...], p: int, q: int, round_off: tuple[float, ...]) -> Tableau:
    """Return the tableau of a ladder; `round_off` is that of each level, relative. See `triangular_scheme`."""
    rows = triangular_scheme(steps, p, q)
    noise = tuple(
        tuple(entry.round_off(round_off[i - j : i + 1]) for j, entry in enumerate(row, start=1))
        for i, row in enumerate(rows)
    )
    amplification = [0.0] + [
        2.0 * math.factorial(p + 1) * (1.0 + row[0].factor) * power(float(n), float(p))
        for row, n in zip(rows[1:], steps[:-1], strict=True)
    ]
    return Tableau(rows, noise, tuple(amplification), has_every_power=q == 1)


class _Row(NamedTuple):
    """One row of the tableau; lists over the columns."""

    position: list[Any]
    velocity: list[Any]
    changes: list[Any]  # largest changes so far from the previous row
    bounds: list[Any]  # bounds of the truncation errors of columns 1, 2, ...


def best_entry(
    table: Tableau, levels: Sequence[Pair], facts: Circumstances, ops: Arithmetic = ARRAYS
) -> Best:
    """Extrapolate, and return the entry with the least bound at each time of each member.

    Parameters
    ----------
    levels
        Position and velocity of each level, from coarse to fine; NaN where a level failed.
    """
    row = _Row([levels[0][0]], [levels[0][1]], [], [])
    candidates: list[tuple[int, Pair, Any]] = []
    response: Any = 0.0
    noise = lasting = response
    for i, level in enumerate(levels[1:], start=1):
        finer = _next_row(table, i, level, row, facts, ops)
        for j in range(1, i):
            # the error is at least the difference from the finer row
            bound = ops.larger(row.bounds[j - 1], finer.changes[j])
            floor = noise * table.round_off[i - 1][j - 1] + lasting
            candidates.append(
                ((i - 1) * len(levels) + j, (row.position[j], row.velocity[j]), bound + floor)
            )
        response = ops.larger(table.amplification[i] * facts.response * finer.changes[0], response)
        noise = ops.larger(response / facts.spread, facts.noise) * ROUND_OFF_SAFETY
        lasting = LASTING * (facts.size * (1.0 + facts.phase) + response)
        row = finer
    last = len(levels) - 1
    for j in range(1, last + 1):
        floor = noise * table.round_off[last][j - 1] + lasting
        candidates.append(
            (last * len(levels) + j, (row.position[j], row.velocity[j]), row.bounds[j - 1] + floor)
        )
    return _least(candidates, levels[-1], last * len(levels), ops)


def _least(
    found: Sequence[tuple[int, Pair, Any]], finest: Pair, code: int, ops: Arithmetic
) -> Best:
    """Return the entries with the least bounds; among equals that of the finest row and the last column."""
    position, velocity = finest
    is_finite = (position - position) + (velocity - velocity) == 0.0
    entry, error = (ops.choose(is_finite, code, -1), ops.choose(is_finite, math.inf, math.inf))
    for entry_number, (x, y), bound in reversed(found):
        better = bound < error
        if ops.holds_anywhere(better):
            # false for entries that are not finite
            better = better & ((x - x) + (y - y) == 0.0)
            position, velocity = ops.choose(better, x, position), ops.choose(better, y, velocity)
            error, entry = ops.choose(better, bound, error), ops.choose(better, entry_number, entry)
    return Best(position, velocity, error, entry)


def _next_row(
    table: Tableau, i: int, level: Pair, row: _Row, facts: Circumstances, ops: Arithmetic
) -> _Row:
    """Return row i, that of a level, with bounds that exclude round-off; `row` is the previous one."""
    entries = table.entries[i]
    position, dx = next_row(entries, level[0], row.position)
    velocity, dy = next_row(entries, level[1], row.velocity)
    changes, bounds, lefts = list[Any](), list[Any](), list[Any]()
    trust: Any = 1.0
    last_gain: Any = 1.0
    for j, entry in enumerate(entries):
        change = ops.so_far(ops.larger(abs(dx[j]), abs(dy[j]) / facts.rate)) + _TINY
        changes.append(change)
        left = change
        if entry.change_fall:
            fall = row.changes[j] / (change * entry.change_fall) + _TINY
            trust = ops.smaller(ops.smaller(fall, 1.0 / fall), trust)
            has_fall = fall == fall
        if j or entry.change_fall:
            left = error_left(change, ops.larger(entry.fall * trust, th.LEAST_FALL))
        if j == 0 and entry.change_fall:
            left = ops.choose(has_fall, left, change)
        if j > 1:
            gain = ops.smaller(entry.coarser * lefts[-1] / lefts[-2], 1.0)
            left = ops.larger(lefts[-1] * gain, left)
        bound = ops.choose(th.STATE_SAFETY * left > facts.limit, math.inf, th.STATE_SAFETY * left)
        if j:
            safety = (
                th.GAIN_SAFETY if len(entries) > 2 or entry.change_fall else th.FIRST_GAIN_SAFETY
            )
            gain = safety * entry.coarser * left / (lefts[-1] * trust)
            believed = ops.larger(gain, last_gain) if table.has_every_power else gain
            bound = bound * ops.larger(ops.smaller(believed, 1.0), th.LARGEST_GAIN)
            last_gain = gain
            bounds[-1] = ops.larger(entry.factor * change, bounds[-1])
        lefts.append(left)
        bounds.append(bound / (trust * trust + _TINY))
    return _Row(position, velocity, changes, bounds)
