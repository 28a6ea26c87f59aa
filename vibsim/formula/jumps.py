"""Where a formula jumps, and pulses that lie between the times at which it is looked at, so that no step knows of them.

A pulse is told from what steps see: between two times the formula leaves, by far, all values that it has at these and
at those beside them. Bounds of the formula over intervals of time (`vibsim.formula.arrays`) say where that may
be: these are halved until a value is found there, or none can be.

The derivative of a formula leaves jumps out, so that its integral is not the difference of the formula. Over a piece of
time [a, b] the difference D of ``f(b) - f(a)`` and the integral of f' vanishes for a continuous f and a piece that is
short enough. At a jump it stays what it is, however short the piece becomes. So pieces with a D are halved, on the side
where more of it lies, until it has gone or nothing is left to halve. Where a pulse lies between the ends of a piece,
the piece ends within it: its jumps would cancel.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Floats, Integers
from vibsim.formula.arrays import bounds, values
from vibsim.formula.derivative import derivative
from vibsim.formula.tree import Call, Compare, Expression, names_in, walk

HALVINGS = 48
MOST = 2**14
"""Intervals that are looked at together, at most: those that may hold the largest values."""
BEYOND = 2.0
"""A pulse leaves the values around it by more than so many times their range, ..."""
LEAST = 1e-9
"""... and by this part of the largest value at all times."""
HALF = 0.5
"""What a pulse still has of its height at its ends."""

PIECES = 1024
"""Of the whole interval."""
MOST_PULSES = 8
"""So many pulses between the ends of pieces are looked at."""
UNEVEN = 0.37
"""How far their ends are moved, in pieces, so that they do not keep step with a square wave."""
JUMP_HALVINGS = 50
SMALL = 1e-6
"""A jump is larger than this part of the formula's largest value."""
GENTLE = frozenset(
    ("sin", "cos", "exp", "expm1", "sinh", "cosh", "tanh", "atan", "asinh", "erf", "erfc")
)
"""Functions that are smooth wherever they are taken."""


@dataclass(frozen=True)
class Pulses:
    """One pulse of every member that has any, shape (case,)."""

    time: Floats
    """A time within it; NaN where there is none."""
    width: Floats

    def and_others(self, other: Pulses) -> Pulses:
        """Return these, and others of members that have none of these."""
        none = np.isnan(self.time)
        return Pulses(
            np.where(none, other.time, self.time), np.where(none, other.width, self.width)
        )


@dataclass(frozen=True)
class _Gaps:
    """Gaps between successive times, flat over members; arrays of shape (gap,)."""

    formula: Expression
    numbers: Mapping[str, Floats]
    case: Integers
    begin: Floats
    end: Floats
    low: Floats
    """The least value that is no pulse."""
    high: Floats

    def of(self, which: Integers) -> Mapping[str, Floats]:
        """Return the numbers of some gaps."""
        return {name: x[which] for name, x in self.numbers.items()}

    def excess(self, which: Integers, t: Floats) -> Floats:
        """Return how far values at times in some gaps are from being none of a pulse; 0 or less where they are none."""
        value = np.broadcast_to(values(self.formula, {**self.of(which), "t": t}), t.shape)
        return np.maximum(self.low[which] - value, value - self.high[which])

    def largest_excess(self, which: Integers, begin: Floats, end: Floats) -> Floats:
        """Return how large that may be between two times."""
        low, high = bounds(self.formula, {**self.of(which), "t": (begin, end)})
        found = np.maximum(self.low[which] - low, high - self.high[which])
        return np.broadcast_to(found, begin.shape)


def hidden_pulses(formula: Expression, numbers: Mapping[str, Floats], t: Floats) -> Pulses:
    """Find a pulse of every member between the times at which it is looked at.

    Parameters
    ----------
    formula
        In ``t`` and other names.
    numbers
        Values of these, each of shape (case, gap) or (case, 1): what they are behind each of the times but the last.
    t
        The times, shape (case, gap + 1), ascending; NaN behind the last one of a member.
    """
    cases, count = len(t), t.shape[1] - 1
    time, width = np.full(cases, np.nan), np.full(cases, np.nan)
    if "t" not in names_in(formula) or count < 1:
        return Pulses(time, width)
    with np.errstate(all="ignore"):
        gaps = _gaps(formula, numbers, t)
        row = np.flatnonzero(np.isfinite(gaps.low + gaps.high + gaps.end))
        a, b = gaps.begin[row], gaps.end[row]
        for _ in range(HALVINGS):
            excess = gaps.largest_excess(row, a, b)
            left = np.flatnonzero((excess > 0.0) & np.isnan(time[gaps.case[row]]))
            if len(left) > MOST:
                left = left[np.argsort(-excess[left], kind="stable")[:MOST]]
            row, a, b = row[left], a[left], b[left]
            if not len(row):
                break
            middle = 0.5 * (a + b)
            hits = np.flatnonzero(gaps.excess(row, middle) > 0.0)
            # of several the first one in time stays
            for i in hits[np.argsort(-middle[hits], kind="stable")]:
                time[gaps.case[row[i]]] = middle[i]
                width[gaps.case[row[i]]] = _width(gaps, row[i : i + 1], middle[i : i + 1])
            row, a, b = np.tile(row, 2), np.append(a, middle), np.append(middle, b)
    return Pulses(time, width)


def _gaps(formula: Expression, numbers: Mapping[str, Floats], t: Floats) -> _Gaps:
    """Return the gaps with what the formula is around each."""
    count = t.shape[1] - 1
    around = np.arange(count)[:, None] + np.array([-1, 0, 1, 2])
    places = np.take(t, np.clip(around, 0, count), axis=1)
    own = {name: np.broadcast_to(x, (len(t), count)) for name, x in numbers.items()}
    with_places = {name: x[..., None] for name, x in own.items()}
    seen = np.broadcast_to(values(formula, {**with_places, "t": places}), places.shape)
    # behind the last time of a member nothing is known
    seen = np.where(np.isfinite(places), seen, seen[..., 1:2])
    low, high = np.min(seen, axis=-1), np.max(seen, axis=-1)
    size = np.nanmax(np.abs(np.where(np.isfinite(seen), seen, np.nan)), axis=(1, 2), initial=0.0)
    room = BEYOND * (high - low) + LEAST * size[:, None]
    case = np.broadcast_to(np.arange(len(t))[:, None], low.shape)
    flat = {name: x.ravel() for name, x in own.items()}
    limits = (low - room).ravel(), (high + room).ravel()
    return _Gaps(formula, flat, case.ravel(), t[:, :-1].ravel(), t[:, 1:].ravel(), *limits)


def _width(gaps: _Gaps, which: Integers, t: Floats) -> float:
    """Return the time over which the pulse around a time has half its height or more, to a factor of 2."""
    height = gaps.excess(which, t)[0]
    length = float(gaps.end[which][0] - gaps.begin[which][0])
    reach = length * 0.5 ** np.arange(HALVINGS)
    found = 0.0
    for side in (-1.0, 1.0):
        rows = np.broadcast_to(which, reach.shape)
        high = gaps.excess(rows, t + side * reach) >= HALF * height
        found += float(reach[np.argmax(high)]) if high.any() else 0.0
    return found


def first_jump(formula: Expression, numbers: Mapping[str, float], end: float) -> float | None:
    """Return the time of the first jump of a formula in ``t`` from 0 to `end`; None where it has none.

    Parameters
    ----------
    numbers
        Values of its other names.
    """
    if not any(
        isinstance(part, Compare) or (isinstance(part, Call) and part.function not in GENTLE)
        for part in walk(formula)
    ):
        return None
    slope = derivative(formula, "t")
    place, weight = np.polynomial.legendre.leggauss(3)

    def missing(a: Floats, b: Floats) -> Floats:
        """Return D of some pieces."""
        t = a + 0.5 * (b - a) * (1.0 + place[:, None])
        mean = 0.5 * weight @ np.broadcast_to(values(slope, {**numbers, "t": t}), t.shape)
        ends = [np.broadcast_to(values(formula, {**numbers, "t": x}), x.shape) for x in (a, b)]
        found: Floats = np.abs(ends[1] - ends[0] - (b - a) * mean)
        return np.where(np.isfinite(found), found, 0.0)

    k = np.arange(PIECES + 1.0)
    edges = end / PIECES * (k + np.where(k % PIECES == 0.0, 0.0, UNEVEN * np.sin(1.7 * k)))
    edges = _with_pulses(formula, numbers, edges)
    with np.errstate(all="ignore"):
        size = np.abs(np.broadcast_to(values(formula, {**numbers, "t": edges}), edges.shape))
        least = SMALL * float(np.max(size, initial=0.0, where=np.isfinite(size)))
        a, b = edges[:-1], edges[1:]
        kept = missing(a, b) > least
        a, b = a[kept], b[kept]
        for _ in range(JUMP_HALVINGS):
            middle = 0.5 * (a + b)
            left, right = missing(a, middle), missing(middle, b)
            is_left = left >= right
            a, b = np.where(is_left, a, middle), np.where(is_left, middle, b)
            kept = np.maximum(left, right) > least
            a, b = a[kept], b[kept]
    return float(b[0]) if len(b) else None


def _with_pulses(formula: Expression, numbers: Mapping[str, float], edges: Floats) -> Floats:
    """Return the ends of pieces with times in and around the pulses between them."""
    columns = {name: np.full((1, 1), float(value)) for name, value in numbers.items()}
    for _ in range(MOST_PULSES):
        found = hidden_pulses(formula, columns, edges[None])
        if np.isnan(found.time[0]):
            break
        around = found.time[0] + found.width[0] * np.array([-1.0, 0.0, 1.0])
        edges = np.unique(np.append(edges, np.clip(around, edges[0], edges[-1])))
    return edges
