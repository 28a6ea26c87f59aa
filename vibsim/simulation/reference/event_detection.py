"""Switches that leave their mode within a step of collocation, found by samples of the polynomial and a root."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.simulation.reference.collocation import integrals, summed, total
from vibsim.simulation.reference.one_sided_forces import Sides

Begin = tuple[Floats, Floats, Floats]
"""Positions and velocities, shape (coordinate, case), and time, shape (case,), at the start of a step."""

PARTS_OF_A_STEP = 32
"""Number of equal parts of a step, at whose ends switches are sampled."""
PROBE = 2.0**-8
"""Fraction of a step after which the side that the motion enters is determined."""
NUDGE = 2.0**-10
"""Distance of two points before and after the end of a step, as a fraction of it, for the slope there."""
X = np.array(
    [0.0, PROBE, *(np.arange(1, PARTS_OF_A_STEP + 1) / PARTS_OF_A_STEP), 1.0 - NUDGE, 1.0 + NUDGE]
)
LAST = PARTS_OF_A_STEP + 1
"""Index of the end of the step."""
EQUAL = np.array([0, *range(2, LAST + 1)])
"""Indices of the equally spaced samples."""
REGULA_FALSI_STEPS = 12
"""Iterations of regula falsi; the remaining error is corrected when the step ends."""
ROUGH = 1e-9
"""Relative tolerance of a root, in values of the function at the ends of the bracket."""
DOUBTFUL = 0.1
"""A peak between samples is examined if its distance to the border is below this fraction of its curvature term."""
NARROWER = (1.0 / 16.0, 1.0 / 256.0)
"""Distances of the points, relative to those of the samples, for the refinement of such a peak."""


@dataclass(frozen=True)
class Exits:
    """The switches during a step of n members."""

    quantity: Floats
    """Values at `X`, shape (switch, sample, n)."""
    low: Floats
    """Lower end of the mode, shape (switch, n)."""
    high: Floats
    turned: Flags
    """Whether a switch at a border enters the other mode, shape (switch, n)."""
    modes: Floats
    """The modes, updated for switches that turned, shape (switch, n)."""
    size: Floats
    """Largest absolute value of each quantity, shape (switch, n)."""
    hidden: Floats
    """Fraction of the step at which a switch is outside its mode between two samples inside; NaN for none, (n,)."""
    hidden_switch: Integers

    @property
    def outside(self) -> Floats:
        """How far each quantity is outside its mode after the start, shape (switch, sample, n)."""
        return _outside(self.quantity[:, 1 : LAST + 1], self.low[:, None], self.high[:, None])

    def leaves(self, aim: Integers) -> Flags:
        """Tell whether a switch leaves its mode; the switch `aim` (-1: none) may do so at the end of the step."""
        is_out = self.outside > 0.0
        aimed = np.flatnonzero(aim >= 0)
        is_out[aim[aimed], -1, aimed] = False
        return np.asarray(is_out.any(axis=(0, 1)) | np.isfinite(self.hidden))

    def roots(
        self, sides: Sides, modes: Floats, begin: Begin, h: Floats, a: Floats, which: Integers
    ) -> tuple[Integers, Floats, Floats]:
        """Return the switch that leaves first, the border that it crosses, and the fraction of the step until then.

        Parameters
        ----------
        sides, modes, begin, h, a
            The step, restricted to n' members.
        which
            Indices of these among the n members.
        """
        outside = np.take(self.outside, which, axis=-1)
        low, high = np.take(self.low, which, axis=1), np.take(self.high, which, axis=1)
        switch, left, right = self._brackets(outside, which)
        case = np.arange(len(which))

        def excess(x: Floats) -> tuple[Floats, Floats]:
            u, v, t = _at(begin, h, a, x)
            q = sides.quantities(modes, u, v, t)[switch, case]
            return _outside(q, low[switch, case], high[switch, case]), q

        x = _root(lambda x: excess(x)[0], left, right)
        above = excess(right)[1] >= high[switch, case]
        return switch, np.where(above, high[switch, case], low[switch, case]), x

    def _brackets(self, outside: Floats, which: Integers) -> tuple[Integers, Floats, Floats]:
        """Return the first switch, and fractions of the step before and after its exit, each of shape (n',)."""
        is_out = (outside > 0.0).any(axis=0)
        is_found = is_out.any(axis=0)
        first = np.argmax(is_out, axis=0)
        case = np.arange(len(which))
        after = outside[:, first, case]
        start = _outside(self.quantity[:, 0][:, which], self.low[:, which], self.high[:, which])
        before = np.where(first > 0, outside[:, np.maximum(first - 1, 0), case], start)
        with np.errstate(all="ignore"):
            way = np.minimum(before, 0.0) / (np.minimum(before, 0.0) - after)
        switch = np.argmin(np.where(after > 0.0, np.abs(way), np.inf), axis=0)
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
    """Return the behaviour of every switch during a step.

    Parameters
    ----------
    edge
        Border at which a switch is at the start, NaN if at none, shape (switch, n).
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
    """Return how far a quantity is outside its mode; negative inside."""
    return np.maximum(low - q, q - high)


def overshoot(exits: Exits, aim: Integers, goal: Floats) -> Floats:
    """Return the fraction of a step from where the switch `aim` has the value `goal` to its end; NaN if `aim` is -1."""
    q = exits.quantity[np.maximum(aim, 0), :, np.arange(len(aim))].T
    with np.errstate(all="ignore"):
        slope = (q[LAST + 2] - q[LAST + 1]) / (2.0 * NUDGE)
        return np.where(aim >= 0, (q[LAST] - goal) / slope, np.nan)


def _at(begin: Begin, h: Floats, a: Floats, x: Floats) -> Begin:
    """Return states and times after a fraction x of a step; each member has its own x."""
    u, v, t = begin
    once, twice = integrals(x)
    along = u + h * x * v + h * h * total(twice.T * a, axis=1)
    return along, v + h * total(once.T * a, axis=1), t + h * x


def _root(function: Callable[[Floats], Floats], left: Floats, right: Floats) -> Floats:
    """Return a root of an increasing function between two points, by regula falsi (Illinois variant)."""
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
    """Return where a switch is outside its mode between two samples inside, and its index; NaN for none."""
    cases, ((u, v, t), h, a) = q.shape[-1], step
    hidden, switch = np.full(cases, np.nan), np.zeros(cases, dtype=np.int64)
    gap = _outside(q[:, EQUAL], borders[0][:, None], borders[1][:, None])
    before, here, after = gap[:, :-2], gap[:, 1:-1], gap[:, 2:]
    bend = 2.0 * here - before - after
    with np.errstate(all="ignore"):
        peak = here + (after - before) ** 2 / (8.0 * bend)
        near = (here <= 0.0) & (here >= before) & (here >= after) & (bend > 0.0)
        near &= peak > -DOUBTFUL * bend
    for k, i, n in zip(*np.nonzero(near), strict=True):
        place = (
            i + 1.0 + 0.5 * (after[k, i, n] - before[k, i, n]) / bend[k, i, n]
        ) / PARTS_OF_A_STEP
        if np.isfinite(hidden[n]) and hidden[n] <= place:
            continue
        member = slice(n, n + 1)
        step_of_member = (u[:, member], v[:, member], t[member]), h[member], a[..., member]
        ends = borders[0][k, n], borders[1][k, n]
        sides_of_member = sides.of(np.array([n]))
        excess = partial(_excess, sides_of_member, modes[:, member], k, ends, step_of_member)
        x = _peak(excess, place)
        if excess(x) > 0.0:
            hidden[n], switch[n] = x, k
    return hidden, switch


def _excess(
    sides: Sides,
    modes: Floats,
    k: int,
    ends: tuple[float, float],
    step: tuple[Begin, Floats, Floats],
    x: float,
) -> float:
    """Return how far a switch of a single member is outside its mode after a fraction x of a step."""
    q = float(sides.quantity(k, modes, *_at(*step, np.array([x])))[0])
    return max(ends[0] - q, q - ends[1])


def _peak(function: Callable[[float], float], place: float) -> float:
    """Return the maximum of a function near a place, by parabolic interpolation."""
    for part in NARROWER:
        d = part / PARTS_OF_A_STEP
        before, here, after = function(place - d), function(place), function(place + d)
        bend = 2.0 * here - before - after
        if bend > 0.0:
            place += float(np.clip(0.5 * (after - before) / bend, -1.0, 1.0)) * d
    return place
