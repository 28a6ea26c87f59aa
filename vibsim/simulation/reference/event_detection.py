"""Where a switch leaves its mode within a step of collocation: seen at samples of the polynomial, found as a root."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.simulation.reference.collocation import integrals, summed, total
from vibsim.simulation.reference.one_sided_forces import Sides

Begin = tuple[Floats, Floats, Floats]
"""Positions and velocities, shape (coordinate, case), and time, shape (case,), where a step begins."""

PARTS_OF_A_STEP = 32
"""Equal parts of a step at whose ends a switch is looked at."""
PROBE = 2.0**-8
"""Part of a step after which the side is read into which the motion goes."""
NUDGE = 2.0**-10
"""Part of a step before and behind its end between which the slope is taken."""
X = np.array(
    [0.0, PROBE, *(np.arange(1, PARTS_OF_A_STEP + 1) / PARTS_OF_A_STEP), 1.0 - NUDGE, 1.0 + NUDGE]
)
LAST = PARTS_OF_A_STEP + 1
"""Index of the end of the step."""
EQUAL = np.array([0, *range(2, LAST + 1)])
"""Indices of the equally spaced samples."""
REGULA_FALSI_STEPS = 12
"""Steps of regula falsi; what they leave is corrected where the step ends."""
ROUGH = 1e-9
"""A value is one of a root that is smaller, relative to those at both ends."""
DOUBTFUL = 0.1
"""A peak between samples is looked at that is nearer to the border than this part of its rise from them."""
NARROWER = (1.0 / 16.0, 1.0 / 256.0)
"""Distances of the points, over those of the samples, by which the place of such a peak is corrected."""


@dataclass(frozen=True)
class Exits:
    """What the switches do in a step; n members."""

    quantity: Floats
    """At `X`, shape (switch, sample, n)."""
    low: Floats
    """Lower end of the mode, shape (switch, n)."""
    high: Floats
    turned: Flags
    """Whether a switch at a border goes into the other mode, shape (switch, n)."""
    modes: Floats
    """The modes with those that turned, shape (switch, n)."""
    size: Floats
    """Largest value of each quantity, shape (switch, n)."""
    hidden: Floats
    """Part of the step at which a switch is beyond its mode between two samples that are not; NaN for none, (n,)."""
    hidden_switch: Integers

    @property
    def outside(self) -> Floats:
        """Return how far each quantity is beyond its mode behind the start, shape (switch, sample, n)."""
        return _outside(self.quantity[:, 1 : LAST + 1], self.low[:, None], self.high[:, None])

    def leaves(self, aim: Integers) -> Flags:
        """Tell whether a switch leaves its mode; that of `aim` may at the very end, where it is meant to."""
        is_out = self.outside > 0.0
        meant = np.flatnonzero(aim >= 0)
        is_out[aim[meant], -1, meant] = False
        return np.asarray(is_out.any(axis=(0, 1)) | np.isfinite(self.hidden))

    def roots(
        self, sides: Sides, modes: Floats, begin: Begin, h: Floats, a: Floats, which: Integers
    ) -> tuple[Integers, Floats, Floats]:
        """Return which switch leaves first, through which value, and after which part of the step.

        Parameters
        ----------
        sides, modes, begin, h, a
            The step, of those n' members alone that are asked for.
        which
            Their places among the n members.
        """
        outside = np.take(self.outside, which, axis=-1)
        low, high = np.take(self.low, which, axis=1), np.take(self.high, which, axis=1)
        switch, left, right = self._brackets(outside, which)
        own = np.arange(len(which))

        def beyond(x: Floats) -> tuple[Floats, Floats]:
            u, v, t = _at(begin, h, a, x)
            q = sides.quantities(modes, u, v, t)[switch, own]
            return _outside(q, low[switch, own], high[switch, own]), q

        x = _root(lambda x: beyond(x)[0], left, right)
        above = beyond(right)[1] >= high[switch, own]
        return switch, np.where(above, high[switch, own], low[switch, own]), x

    def _brackets(self, outside: Floats, which: Integers) -> tuple[Integers, Floats, Floats]:
        """Return the first switch, and parts of the step before and behind its exit, each of shape (n',)."""
        is_out = (outside > 0.0).any(axis=0)
        is_found = is_out.any(axis=0)
        first = np.argmax(is_out, axis=0)
        own = np.arange(len(which))
        behind = outside[:, first, own]
        start = _outside(self.quantity[:, 0][:, which], self.low[:, which], self.high[:, which])
        before = np.where(first > 0, outside[:, np.maximum(first - 1, 0), own], start)
        with np.errstate(all="ignore"):
            way = np.minimum(before, 0.0) / (np.minimum(before, 0.0) - behind)
        switch = np.argmin(np.where(behind > 0.0, np.abs(way), np.inf), axis=0)
        left, right = X[first], X[first + 1]
        hidden = self.hidden[which]
        earlier = np.isfinite(hidden) & (~is_found | (hidden < right))
        left = np.where(earlier, np.maximum(hidden - 1.0 / PARTS_OF_A_STEP, 0.0), left)
        return (
            np.where(earlier, self.hidden_switch[which], switch),
            left,
            np.where(earlier, hidden, right),
        )


def find_exits(
    sides: Sides, modes: Floats, edge: Floats, begin: Begin, h: Floats, a: Floats
) -> Exits:
    """Look at every switch during a step.

    Parameters
    ----------
    edge
        Value at whose border a switch is at the start, NaN elsewhere, shape (switch, n).
    h, a
        Length of the step, shape (n,), and accelerations at its stages, shape (coordinate, stage, n).
    """
    u, v, t = begin
    x = X[:, None]
    once, twice = np.split(summed(_of_samples(), a), 2, axis=1)
    along = u[:, None] + h * x * v[:, None] + h * h * twice
    q = sides.quantities(modes, along, v[:, None] + h * once, t + h * x)
    side = np.where(q[:, 1] > edge, edge, np.where(q[:, 1] < edge, edge - 1.0, modes))
    borders = sides.borders(modes)
    size = np.max(np.abs(np.nan_to_num(q[:, : LAST + 1])), axis=1)
    return Exits(
        q, *borders, side != modes, side, size, *_hidden(sides, modes, borders, q, (begin, h, a))
    )


@cache
def _of_samples() -> Floats:
    return np.concatenate(integrals(X))


def _outside(q: Floats, low: Floats, high: Floats) -> Floats:
    """Return how far a quantity is beyond its mode; negative within."""
    return np.maximum(low - q, q - high)


def overshoot(found: Exits, aim: Integers, goal: Floats) -> Floats:
    """Return by which part of a step its end is behind the place where a switch has the value `goal`; NaN for none."""
    own = np.arange(len(aim))
    q = found.quantity[np.maximum(aim, 0), :, own].T
    with np.errstate(all="ignore"):
        slope = (q[LAST + 2] - q[LAST + 1]) / (2.0 * NUDGE)
        return np.where(aim >= 0, (q[LAST] - goal) / slope, np.nan)


def _at(begin: Begin, h: Floats, a: Floats, x: Floats) -> Begin:
    """Return the states after a part x of a step, each member with its own, and the times."""
    u, v, t = begin
    once, twice = integrals(x)
    along = u + h * x * v + h * h * total(twice.T * a, axis=1)
    return along, v + h * total(once.T * a, axis=1), t + h * x


def _root(function: Callable[[Floats], Floats], left: Floats, right: Floats) -> Floats:
    """Return a root between two points, by regula falsi (Illinois); the function is larger on the right."""
    low, high = np.minimum(function(left), 0.0), function(right)
    kept, x, size = np.zeros(len(left)), right, np.abs(high) + np.abs(low)
    going = np.ones(len(left), dtype=bool)
    for _ in range(REGULA_FALSI_STEPS):
        way = np.where(low == 0.0, 0.5, low / np.where(high > low, low - high, -1.0))
        x = np.where(going, left + way * (right - left), x)
        value = function(x)
        is_high = value > 0.0
        low = np.where(is_high & (kept > 0.0), 0.5 * low, low)
        high = np.where(~is_high & (kept < 0.0), 0.5 * high, high)
        kept = np.where(is_high, 1.0, -1.0)
        left, low = np.where(is_high, left, x), np.where(is_high, low, value)
        right, high = np.where(is_high, x, right), np.where(is_high, value, high)
        going &= np.abs(value) > ROUGH * size
        if not going.any():
            break
    return x


def _hidden(
    sides: Sides,
    modes: Floats,
    borders: tuple[Floats, Floats],
    q: Floats,
    step: tuple[Begin, Floats, Floats],
) -> tuple[Floats, Integers]:
    """Return where a switch is beyond its mode between two samples that are not, and which; NaN for none."""
    cases, ((u, v, t), h, a) = q.shape[-1], step
    found, switch = np.full(cases, np.nan), np.zeros(cases, dtype=np.int64)
    gap = _outside(q[:, EQUAL], borders[0][:, None], borders[1][:, None])
    before, here, behind = gap[:, :-2], gap[:, 1:-1], gap[:, 2:]
    bend = 2.0 * here - before - behind
    with np.errstate(all="ignore"):
        peak = here + (behind - before) ** 2 / (8.0 * bend)
        near = (here <= 0.0) & (here >= before) & (here >= behind) & (bend > 0.0)
        near &= peak > -DOUBTFUL * bend
    for k, i, n in zip(*np.nonzero(near), strict=True):
        place = (
            i + 1.0 + 0.5 * (behind[k, i, n] - before[k, i, n]) / bend[k, i, n]
        ) / PARTS_OF_A_STEP
        if np.isfinite(found[n]) and found[n] <= place:
            continue
        one = slice(n, n + 1)
        own = (u[:, one], v[:, one], t[one]), h[one], a[..., one]
        ends = borders[0][k, n], borders[1][k, n]
        beyond = partial(_beyond, sides.of(np.array([n])), modes[:, one], k, ends, own)
        x = _peak(beyond, place)
        if beyond(x) > 0.0:
            found[n], switch[n] = x, k
    return found, switch


def _beyond(
    alone: Sides,
    modes: Floats,
    k: int,
    ends: tuple[float, float],
    step: tuple[Begin, Floats, Floats],
    x: float,
) -> float:
    """Return how far a switch of one member is beyond its mode after a part x of a step."""
    q = float(alone.quantity(k, modes, *_at(*step, np.array([x])))[0])
    return max(ends[0] - q, q - ends[1])


def _peak(function: Callable[[float], float], place: float) -> float:
    """Return where a function is largest near a place, by parabolas."""
    for part in NARROWER:
        d = part / PARTS_OF_A_STEP
        before, here, behind = function(place - d), function(place), function(place + d)
        bend = 2.0 * here - before - behind
        if bend > 0.0:
            place += float(np.clip(0.5 * (behind - before) / bend, -1.0, 1.0)) * d
    return place
