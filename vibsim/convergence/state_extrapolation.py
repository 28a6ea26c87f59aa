r"""Extrapolation of a motion over all levels, at every time by itself: which entry to believe how far.

The scheme and the error bar are those of `vibsim.convergence.extrapolation`, with the powers of the scheme.

What is known of the error of an entry, besides round-off:

- the change ``T[i][j-1] - T[i-1][j-1]`` and the factor K by which it must fall in its column give the error that
  ``T[i][j-1]`` still has. What was seen to fall by another factor, more or less, is trusted less: `trust` is the worst
  agreement, a factor, of all columns of the row so far.
- extrapolating once more divides that error by about as much as extrapolating the last time did, times what the
  coarser level costs; never by more than `LARGEST_GAIN`.
- an entry that a finer row contradicts is as wrong as the contradiction says.

Position and velocity count together, as the larger of du and dv/w: a time at which the error of one happens to cross
zero is then no time at which it is thought small. For the same reason a change is as large as it has been so far.

The same text works on floats (one member, one time, without numpy's overhead) and on arrays, with the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from vibsim.convergence import thresholds as th
from vibsim.convergence.extrapolation import Entry, error_left, next_row, triangular_scheme
from vibsim.elementary.exponential import power

LASTING = 2.0**-52
"""Relative error of what every level has in common: parameters, the step, the elementary functions."""

_TINY = 1e-200


@dataclass(frozen=True)
class Arithmetic:
    """The few functions that floats and arrays do not share. The larger and the smaller ignore NaN."""

    larger: Callable[[Any, Any], Any]
    smaller: Callable[[Any, Any], Any]
    choose: Callable[[Any, Any, Any], Any]
    so_far: Callable[[Any], Any]  # the largest value up to each time; may change what it is given
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
    for before, now in pairwise(values):
        np.fmax(before, now, out=now)
    return values


MANY_MEMBERS = 16
"""From so many members on numpy's own loop over times is slower than one of ours over rows of members."""

FLOATS = Arithmetic(_larger, _smaller, _choose, lambda value: value, bool)
"""For one member at one time."""
ARRAYS = Arithmetic(np.fmax, np.fmin, np.where, _so_far, np.any)
"""For arrays of shape (t, case)."""


@dataclass(frozen=True)
class Circumstances:
    """What is known of the members besides their levels; floats, or arrays that broadcast against (t, case)."""

    rate: Any  # w: dv/w counts like du
    size: Any  # size of the solution over the whole time
    limit: Any  # an estimated error beyond it is not believed
    phase: Any  # w t
    # ``1/(w end)^p``, which `Tableau.amplification` is to be multiplied with; 0 where disturbances do not grow
    response: Any
    noise: Any  # round-off so far over its prediction relative to 1; at least `size`
    # part of the response to a lasting disturbance that is the response to one passing: ``max(1, w t)``, or 1 where the
    # noise was not measured
    spread: Any


class Best(NamedTuple):
    """The best entry at every time of every member; floats, or arrays of shape (t, case)."""

    position: Any
    velocity: Any
    error: Any  # bound for the position, and over w the velocity; infinite if not known
    # which entry: its row times the number of levels, plus its column. Where nothing is known of the error, the finest
    # level; -1 where that has failed
    entry: Any


Pair = tuple[Any, Any]
"""Position and velocity."""


@dataclass(frozen=True)
class Tableau:
    """What the steps of the levels say; one for every scheme with its options."""

    entries: tuple[tuple[Entry, ...], ...]  # row i holds the entries j = 1, ..., i
    round_off: tuple[tuple[float, ...], ...]  # of the same entries, relative to the solution
    # row i: times the change of its level and ``1/(w end)^p`` this is the response of the motion to a lasting relative
    # disturbance of its equation: the scheme itself disturbs it by ``(w h)^p / (2 (p+1)!)``, for central differences
    amplification: tuple[float, ...]


@lru_cache(maxsize=256)
def tableau(steps: tuple[int, ...], p: int, q: int, round_off: tuple[float, ...]) -> Tableau:
    """Return the tableau of a ladder; `round_off` is relative, of every level. See `triangular_scheme` for the rest."""
    rows = triangular_scheme(steps, p, q)
    noise = tuple(
        tuple(entry.round_off(round_off[i - j : i + 1]) for j, entry in enumerate(row, start=1))
        for i, row in enumerate(rows)
    )
    amplification = [0.0] + [
        2.0 * math.factorial(p + 1) * (1.0 + row[0].factor) * power(float(n), float(p))
        for row, n in zip(rows[1:], steps[:-1], strict=True)
    ]
    return Tableau(rows, noise, tuple(amplification))


class _Row(NamedTuple):
    """One row of the tableau; lists over the columns."""

    position: list[Any]
    velocity: list[Any]
    changes: list[Any]  # from the row before, so far
    bounds: list[Any]  # bounds of the errors of truncation of columns 1, 2, ...


def best_entry(
    table: Tableau, levels: Sequence[Pair], known: Circumstances, of: Arithmetic = ARRAYS
) -> Best:
    """Extrapolate, and choose the entry with the least bound at every time of every member.

    Parameters
    ----------
    levels
        Position and velocity of every level, from coarse to fine; NaN where a level has failed.
    """
    row = _Row([levels[0][0]], [levels[0][1]], [], [])
    found: list[tuple[int, Pair, Any]] = []
    response: Any = 0.0
    noise = lasting = response
    for i, level in enumerate(levels[1:], start=1):
        finer = _next_row(table.entries[i], level, row, known, of)
        for j in range(1, i):
            # at least as wrong as the finer row says
            bound = of.larger(row.bounds[j - 1], finer.changes[j])
            floor = noise * table.round_off[i - 1][j - 1] + lasting
            found.append(
                ((i - 1) * len(levels) + j, (row.position[j], row.velocity[j]), bound + floor)
            )
        response = of.larger(table.amplification[i] * known.response * finer.changes[0], response)
        noise = of.larger(response / known.spread, known.noise) * th.ROUND_OFF_SAFETY
        lasting = LASTING * (known.size * (1.0 + known.phase) + response)
        row = finer
    last = len(levels) - 1
    for j in range(1, last + 1):
        floor = noise * table.round_off[last][j - 1] + lasting
        found.append(
            (last * len(levels) + j, (row.position[j], row.velocity[j]), row.bounds[j - 1] + floor)
        )
    return _least(found, levels[-1], last * len(levels), of)


def _least(found: Sequence[tuple[int, Pair, Any]], finest: Pair, code: int, of: Arithmetic) -> Best:
    """Return the entries with the least bounds; among equals that of the finest row and the last column."""
    position, velocity = finest
    is_finite = (position - position) + (velocity - velocity) == 0.0
    entry, error = of.choose(is_finite, code, -1), of.choose(is_finite, math.inf, math.inf)
    for number, (x, y), bound in reversed(found):
        better = bound < error
        if of.holds_anywhere(better):
            # what is not finite fails the comparison
            better = better & ((x - x) + (y - y) == 0.0)
            position, velocity = of.choose(better, x, position), of.choose(better, y, velocity)
            error, entry = of.choose(better, bound, error), of.choose(better, number, entry)
    return Best(position, velocity, error, entry)


def _next_row(
    entries: Sequence[Entry], level: Pair, row: _Row, known: Circumstances, of: Arithmetic
) -> _Row:
    """Return the row of a level from the row of the level before, without its round-off."""
    position, dx = next_row(entries, level[0], row.position)
    velocity, dy = next_row(entries, level[1], row.velocity)
    changes, bounds, lefts = list[Any](), list[Any](), list[Any]()
    trust: Any = 1.0
    for j, entry in enumerate(entries):
        change = of.so_far(of.larger(abs(dx[j]), abs(dy[j]) / known.rate)) + _TINY
        changes.append(change)
        left = change
        if entry.change_fall:
            fall = row.changes[j] / (change * entry.change_fall) + _TINY
            trust = of.smaller(of.smaller(fall, 1.0 / fall), trust)
            is_known = fall == fall
        if j or entry.change_fall:
            left = error_left(change, of.larger(entry.fall * trust, th.LEAST_FALL))
        if j == 0 and entry.change_fall:
            left = of.choose(is_known, left, change)
        if j > 1:
            gain = of.smaller(entry.coarser * lefts[-1] / lefts[-2], 1.0)
            left = of.larger(lefts[-1] * gain, left)
        bound = of.choose(th.STATE_SAFETY * left > known.limit, math.inf, th.STATE_SAFETY * left)
        if j:
            safety = (
                th.GAIN_SAFETY if len(entries) > 2 or entry.change_fall else th.FIRST_GAIN_SAFETY
            )
            gain = safety * entry.coarser * left / (lefts[-1] * trust)
            bound = bound * of.larger(of.smaller(gain, 1.0), th.LARGEST_GAIN)
            bounds[-1] = of.larger(entry.factor * change, bounds[-1])
        lefts.append(left)
        bounds.append(bound / (trust * trust + _TINY))
    return _Row(position, velocity, changes, bounds)
