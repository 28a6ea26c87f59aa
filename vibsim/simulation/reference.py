r"""A reference solution to about twelve digits, of smooth models whose exact solution is not known.

Collocation at the 12 Gauss points of a step (order 24; E. Hairer, G. Wanner, S. Noersett, Solving Ordinary Differential
Equations I, section II.7), its equations solved by iteration, and the step halved until two solutions agree. It shares
no arithmetic with the schemes and their kernels: formulas are evaluated by numpy. Between the ends of steps the
collocation polynomial is the solution. What is left between the last two solutions bounds the error of the last one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from vibsim.expression import values
from vibsim.models import Model, tree
from vibsim.simulation.members import Members

Floats = NDArray[np.float64]
Force = Callable[[Floats, Floats, Floats], Floats]
"""The accelerations, shape (coordinate, stage, case), from positions and velocities of that shape and from times."""

METHOD = "collocation at 12 Gauss points of a step, halved until two solutions agree"
STAGES = 12
FEWEST, MOST = 8, 2**11
"""Steps over the whole interval."""
ITERATIONS = 60
COMPARED = 64
"""At so many equal times, and at t = 0, two solutions are compared."""
ACCURATE = 1e-12
"""A solution is accepted whose bound is smaller, relative to its largest value."""
SETTLED = 2e-14
"""No more is to be had from halving the step."""
SLOW = 32.0
"""A smooth motion that is resolved gains far more by halving the step; one that gains less twice is none."""
RESOLVED = 1e-3
"""A relative difference below says that the steps see the motion."""
SMALL = 2.0**-51
"""A change of the accelerations is none that is smaller relative to them and to the velocities over a step."""
STALLED = 2.0**-30
"""Largest change that may be taken for round-off once changes no longer fall: forces magnify that of the positions."""
ROUND_OFF = 16.0 * 2.0**-52
"""Relative bound of the rounding errors, beside one that grows with the root of the number of steps."""


@dataclass(frozen=True)
class Tableau:
    """Coefficients of collocation for ``u'' = a``, shape (stage,) or (stage, stage)."""

    c: Floats
    first: Floats
    """Of the velocities at the stages."""
    second: Floats
    """Of the positions."""


@dataclass(frozen=True)
class Solved:
    """A solution by steps: states at their starts, and accelerations at the stages."""

    end: Floats
    position: Floats
    """Shape (step, coordinate, case)."""
    velocity: Floats
    acceleration: Floats
    """Shape (step, coordinate, stage, case)."""

    def at(self, fraction: Floats) -> Floats:
        """Return all positions and then all velocities at fractions of the end time, shape (state, case, time)."""
        steps = len(self.position)
        place = fraction * steps
        step = np.minimum(place.astype(np.int64), steps - 1)
        first, second = integrals(place - step)
        h = self.end / steps
        u = self.position[step] + h * (place - step)[:, None, None] * self.velocity[step]
        v = self.velocity[step].copy()
        for j in range(STAGES):
            a = self.acceleration[step, :, j]
            v += h * (first[:, j, None, None] * a)
            u += h * h * (second[:, j, None, None] * a)
        return np.moveaxis(np.concatenate([u, v], axis=1), 0, -1)


@cache
def nodes() -> tuple[Floats, Floats, Floats]:
    """Return Gauss's points on [0, 1], their weights, and the barycentric weights of interpolation."""
    x, w = np.polynomial.legendre.leggauss(STAGES)
    c = 0.5 * (1.0 + x)
    gaps = c[:, None] - c[None, :] + np.eye(STAGES)
    return c, 0.5 * w, 1.0 / np.prod(4.0 * gaps, axis=1)


def _basis(x: Floats) -> Floats:
    """Return the polynomials that are 1 at one of the points and 0 at the others, shape (..., stage)."""
    c, _, weight = nodes()
    gap = x[..., None] - c
    hit = gap == 0.0
    terms = weight / np.where(hit, 1.0, gap)
    found = terms / np.sum(terms, axis=-1, keepdims=True)
    return np.asarray(np.where(np.any(hit, axis=-1, keepdims=True), hit, found))


def integrals(x: Floats) -> tuple[Floats, Floats]:
    """Return the integrals of these polynomials from 0 to x, and the integrals of those, shape (time, stage)."""
    c, weight, _ = nodes()
    basis = _basis(x[:, None] * c)
    first = x[:, None] * np.sum(weight[:, None] * basis, axis=1)
    second = x[:, None] ** 2 * np.sum((weight * (1.0 - c))[:, None] * basis, axis=1)
    return first, second


@cache
def tableau() -> Tableau:
    """Return the coefficients of the stages."""
    c, _, _ = nodes()
    first, second = integrals(c)
    return Tableau(c, first, second)


def _sum(coefficients: Floats, a: Floats) -> Floats:
    """Return ``coefficients @ a`` over the stages, summed in an order that does not depend on the number of members."""
    if a.shape[-1] == 1:
        # numpy adds up one column in another order than several
        return _sum(coefficients, np.repeat(a, 2, axis=-1))[..., :1]
    return np.asarray(np.add.reduce(coefficients[:, :, None] * a[:, None], axis=2))


def solve(force: Force, start: Floats, end: Floats, steps: int) -> Solved:
    """Take equal steps to the end time of each member; NaN from where the iteration does not end.

    Parameters
    ----------
    start
        All positions and then all velocities at t = 0, shape (state, case).
    end
        End times, shape (case,).
    """
    of = tableau()
    whole_first, whole_second = integrals(np.ones(1))
    ahead = _basis(1.0 + of.c)
    h = end / steps
    u, v = np.array(np.split(start, 2))
    count = len(u)
    lost = np.zeros((2, count, len(end)))
    shape = (steps, count, len(end))
    stages = (count, STAGES, len(end))
    kept = Solved(end, np.empty(shape), np.empty(shape), np.empty((steps, *stages)))
    a = np.broadcast_to(force(u[:, None], v[:, None], 0.0 * end), stages)
    for n in range(steps):
        a = _stages(force, u, v, (n + of.c[:, None]) * h, h, a)
        kept.position[n], kept.velocity[n], kept.acceleration[n] = u, v, a
        # the rounding of each sum is carried along
        changes = h * v + h * h * _sum(whole_second, a)[:, 0], h * _sum(whole_first, a)[:, 0]
        u, lost[0] = _added(u, changes[0], lost[0])
        v, lost[1] = _added(v, changes[1], lost[1])
        a = _sum(ahead, a)
    return kept


def _added(total: Floats, change: Floats, lost: Floats) -> tuple[Floats, Floats]:
    change = change - lost
    found = total + change
    return found, (found - total) - change


def _stages(force: Force, u: Floats, v: Floats, t: Floats, h: Floats, a: Floats) -> Floats:
    """Return the accelerations at the stages, shape (coordinate, stage, case), from a guess; NaN for no end."""
    of = tableau()
    going, before = np.ones(len(h), dtype=bool), np.full(len(h), np.inf)
    straight = u[:, None] + of.c[:, None] * h * v[:, None]
    for _ in range(ITERATIONS):
        y = v[:, None] + h * _sum(of.first, a)
        found = np.broadcast_to(force(straight + h * h * _sum(of.second, a), y, t), a.shape)
        change = np.max(np.abs(found - a), axis=(0, 1))
        size = np.max(np.abs(found) + np.abs(y) / h, axis=(0, 1))
        # a member that has come to rest in its last digits keeps them, whatever the others do
        a = np.where(going, found, a)
        stalled = (change <= STALLED * size) & ~(change < 0.5 * before)
        going, before = going & ~(change <= SMALL * size) & ~stalled, change
        if not (going & np.isfinite(change)).any():
            break
    return np.where(going, np.nan, a)


def reference(
    model: Model, group: Members, fraction: Floats
) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Return the states at fractions of the end time, shape (case, time), and bounds of their errors, shape (case,).

    NaN stands where the accuracy is not reached: of motions that are not smooth, or too sensitive.
    """
    names = [state.name for state in model.states]
    parameters = {row.name: group.parameters[row.key] for row in model.parameters}
    columns = (*(group.initial[name] for name in names), group.end, *parameters.values())
    numbers = tuple(np.ascontiguousarray(column, dtype=float).tobytes() for column in columns)
    chosen, bounds = _chosen(model, numbers)
    series = np.full((len(names), len(group.end), len(fraction)), np.nan)
    for members, solved in chosen:
        series[:, members] = solved.at(fraction)
    return dict(zip(names, series, strict=True)), dict(zip(names, bounds, strict=True))


@lru_cache(maxsize=8)
def _chosen(
    model: Model, numbers: tuple[bytes, ...]
) -> tuple[list[tuple[NDArray[np.int64], Solved]], Floats]:
    """Return the solutions that were accepted, each with its members, and the bounds, shape (state, case)."""
    states = len(model.states)
    columns = [np.frombuffer(column) for column in numbers]
    start, end, rest = np.array(columns[:states]), columns[states], columns[states + 1 :]
    names = [row.name for row in model.parameters]
    times = np.arange(COMPARED + 1) / COMPARED
    bounds = np.full((states, len(end)), np.nan)
    accepted = []
    left, steps = np.arange(len(end)), FEWEST
    before, gap, slow = None, np.full(len(end), np.inf), np.zeros(len(end), dtype=np.int64)
    with np.errstate(all="ignore"):
        while len(left) and steps <= MOST:
            own = dict(zip(names, (column[left] for column in rest), strict=True))
            solved = solve(partial(_force, model, own), start[:, left], end[left], steps)
            now = solved.at(times)
            if before is not None:
                size = np.max(np.abs(now), axis=-1)
                error = np.max(np.abs(now - before), axis=-1)
                relative = np.max(error / np.where(size > 0.0, size, 1.0), axis=0)
                gain = gap / relative
                slow = np.where((gain < SLOW) & (relative < RESOLVED), slow + 1, 0)
                is_there = (relative <= SETTLED) | ((relative <= ACCURATE) & (gain < SLOW))
                if is_there.any():
                    accepted.append((left[is_there], _of(solved, is_there)))
                    rounding = ROUND_OFF * (1.0 + 0.25 * steps**0.5) * size
                    bounds[:, left[is_there]] = (error + rounding)[:, is_there]
                goes_on = ~is_there & (slow < 2)
                left, gap, slow = left[goes_on], relative[goes_on], slow[goes_on]
                now = now[:, goes_on]
            before, steps = now, 2 * steps
    return accepted, bounds


def _force(model: Model, parameters: dict[str, Floats], u: Floats, v: Floats, t: Floats) -> Floats:
    """Return the accelerations of a model; see `Force`."""
    numbers = {
        **parameters,
        **dict(zip(model.positions, u, strict=True)),
        **dict(zip(model.velocities, v, strict=True)),
        "t": t,
    }
    found = (values(tree(model, formula), numbers) for formula in model.accelerations)
    return np.stack([np.broadcast_to(a, np.broadcast_shapes(u.shape[1:], t.shape)) for a in found])


def _of(solved: Solved, members: NDArray[np.bool_]) -> Solved:
    return Solved(
        solved.end[members],
        solved.position[..., members],
        solved.velocity[..., members],
        solved.acceleration[..., members],
    )
