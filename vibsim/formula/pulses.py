"""Pulses that lie between the times at which a formula is looked at, so that no step knows of them.

A pulse is told from what steps see: between two times the formula leaves, by far, all values that it has at these and
at those beside them. Bounds of the formula over intervals of time (`vibsim.formula.intervals`) say where that may
be: these are halved until a value is found there, or none can be.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibsim.formula.arrays import values
from vibsim.formula.intervals import bounds
from vibsim.formula.tree import Expression, names_in

Floats = NDArray[np.float64]

HALVINGS = 48
MOST = 2**14
"""Intervals that are looked at together, at most: those that may hold the largest values."""
BEYOND = 2.0
"""A pulse leaves the values around it by more than so many times their range, ..."""
LEAST = 1e-9
"""... and by this part of the largest value at all times."""
HALF = 0.5
"""What a pulse still has of its height at its ends."""


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
    case: NDArray[np.int64]
    begin: Floats
    end: Floats
    low: Floats
    """The least value that is no pulse."""
    high: Floats

    def value(self, which: NDArray[np.int64], t: Floats) -> Floats:
        """Return the formula at times in some gaps."""
        own = {name: x[which] for name, x in self.numbers.items()}
        return np.broadcast_to(values(self.formula, {**own, "t": t}), t.shape)

    def beyond(self, which: NDArray[np.int64], value: Floats) -> Floats:
        """Return how far values in some gaps are from being none of a pulse; 0 or less where they are none."""
        return np.maximum(self.low[which] - value, value - self.high[which])

    def may_have(self, which: NDArray[np.int64], begin: Floats, end: Floats) -> Floats:
        """Return how far values between two times may be beyond."""
        own = {name: x[which] for name, x in self.numbers.items()}
        low, high = bounds(self.formula, {**own, "t": (begin, end)})
        return np.broadcast_to(
            np.maximum(self.low[which] - low, high - self.high[which]), begin.shape
        )


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
            excess = gaps.may_have(row, a, b)
            left = np.flatnonzero((excess > 0.0) & np.isnan(time[gaps.case[row]]))
            if len(left) > MOST:
                left = left[np.argsort(-excess[left], kind="stable")[:MOST]]
            row, a, b = row[left], a[left], b[left]
            if not len(row):
                break
            middle = 0.5 * (a + b)
            hits = np.flatnonzero(gaps.beyond(row, gaps.value(row, middle)) > 0.0)
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


def _width(gaps: _Gaps, which: NDArray[np.int64], t: Floats) -> float:
    """Return the time over which the pulse around a time has half its height or more, to a factor of 2."""
    height = gaps.beyond(which, gaps.value(which, t))[0]
    length = float(gaps.end[which][0] - gaps.begin[which][0])
    reach = length * 0.5 ** np.arange(HALVINGS)
    found = 0.0
    for side in (-1.0, 1.0):
        rows = np.broadcast_to(which, reach.shape)
        high = gaps.beyond(rows, gaps.value(rows, t + side * reach)) >= HALF * height
        found += float(reach[np.argmax(high)]) if high.any() else 0.0
    return found
