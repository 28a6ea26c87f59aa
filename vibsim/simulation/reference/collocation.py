r"""Collocation at the 12 Gauss points of a step, for ``u'' = a(u, u', t)``: the equations of a step, and solutions.

Order 24 (E. Hairer, G. Wanner, S. Noersett, Solving Ordinary Differential Equations I, section II.7); the equations are
solved by fixed-point iteration. Within a step the solution is the collocation polynomial. Smooth motions take equal
steps, others those of `vibsim.simulation.reference.piecewise_collocation`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any, TypeVar

import numpy as np

from vibsim.core.array_types import Floats

Force = Callable[[Floats, Floats, Floats], Floats]
"""The accelerations, shape (coordinate, stage, case), from positions and velocities of that shape and from times."""

STAGES = 12
ITERATIONS = 60
SETTLED_CHANGE = 2.0**-51
"""Converged if accelerations change by less than this, relative to them plus the velocities over the step."""
STALLED = 2.0**-30
"""Largest change that counts as round-off once changes no longer decrease: forces magnify the rounding of positions."""


@cache
def nodes() -> tuple[Floats, Floats, Floats]:
    """Return the Gauss points on [0, 1], their weights, and the barycentric weights of interpolation."""
    x, w = np.polynomial.legendre.leggauss(STAGES)
    c = 0.5 * (1.0 + x)
    gaps = c[:, None] - c[None, :] + np.eye(STAGES)
    return c, 0.5 * w, 1.0 / np.prod(4.0 * gaps, axis=1)


def _basis(x: Floats) -> Floats:
    """Return the Lagrange polynomials of the points, shape (..., stage)."""
    c, _, weight = nodes()
    gap = x[..., None] - c
    hit = gap == 0.0
    terms = weight / np.where(hit, 1.0, gap)
    basis = terms / np.sum(terms, axis=-1, keepdims=True)
    return np.asarray(np.where(np.any(hit, axis=-1, keepdims=True), hit, basis))


def integrals(x: Floats) -> tuple[Floats, Floats]:
    """Return the first and second integrals of the Lagrange polynomials from 0 to x, shape (time, stage)."""
    c, weight, _ = nodes()
    at = _basis(x[:, None] * c)
    first = x[:, None] * np.sum(weight[:, None] * at, axis=1)
    second = x[:, None] ** 2 * np.sum((weight * (1.0 - c))[:, None] * at, axis=1)
    return first, second


@cache
def _coefficients() -> tuple[Floats, tuple[Floats, Floats], Floats]:
    """Return the coefficients of both integrals at the stages, of both over the step, and of the next step's stages."""
    c = nodes()[0]
    return np.concatenate(integrals(c)), integrals(np.ones(1)), _basis(1.0 + c)


def summed(coefficients: Floats, a: Floats) -> Floats:
    """Return ``coefficients @ a`` over the stages, summed in an order that does not depend on the number of members."""
    return total(coefficients[:, :, None] * a[:, None], axis=2)


def total(terms: Floats, axis: int) -> Floats:
    """Return the sum along an axis other than the last, from the first term to the last."""
    terms = np.ascontiguousarray(terms)
    if terms.shape[-1] == 1:
        # numpy would sum a single column in a different order
        return np.asarray(np.add.accumulate(terms, axis=axis).take(-1, axis=axis))
    return np.asarray(np.add.reduce(terms, axis=axis))


def stages(force: Force, u: Floats, v: Floats, t: Floats, h: Floats, a: Floats) -> Floats:
    """Return the accelerations at the stages, shape (coordinate, stage, case), from a guess; NaN if not converged.

    ``t`` are the times of the stages, shape (stage, case).
    """
    both = _coefficients()[0]
    going, before = np.ones(len(h), dtype=bool), np.full(len(h), np.inf)
    straight = u[:, None] + nodes()[0][:, None] * h * v[:, None]
    for _ in range(ITERATIONS):
        once, twice = np.split(summed(both, a), 2, axis=1)
        y = v[:, None] + h * once
        new = np.broadcast_to(force(straight + h * h * twice, y, t), a.shape)
        change = np.max(np.abs(new - a), axis=(0, 1))
        size = np.max(np.abs(new) + np.abs(y) / h, axis=(0, 1))
        # a converged member keeps its bits, independent of the others
        a = np.where(going, new, a)
        stalled = (change <= STALLED * size) & ~(change < before)
        going, before = going & ~(change <= SETTLED_CHANGE * size) & ~stalled, change
        if not (going & np.isfinite(change)).any():
            break
    return np.where(going, np.nan, a)


def ahead(a: Floats) -> Floats:
    """Return a guess of the accelerations at the stages of the next step of equal length."""
    return summed(_coefficients()[2], a)


def advanced(
    u: Floats, v: Floats, h: Floats, a: Floats, lost: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return positions and velocities at the end of a step, and their compensations (`added`)."""
    first, second = _coefficients()[1]
    u, lost_u = added(u, h * v + h * h * summed(second, a)[:, 0], lost[0])
    v, lost_v = added(v, h * summed(first, a)[:, 0], lost[1])
    return u, v, np.stack([lost_u, lost_v])


def added(total: Floats, change: Floats, lost: Floats) -> tuple[Floats, Floats]:
    """Return the compensated sum of `total` and `change`, and the new compensation (Kahan); `lost` is the old one."""
    change = change - lost
    sum_ = total + change
    return sum_, (sum_ - total) - change


@dataclass(frozen=True)
class Solved:
    """A solution by equal steps: states at the start of each step, and accelerations at the stages."""

    end: Floats
    position: Floats
    """Shape (step, coordinate, case)."""
    velocity: Floats
    acceleration: Floats
    """Shape (step, coordinate, stage, case)."""

    @property
    def length(self) -> Floats:
        """Lengths of the steps, shape (step, case)."""
        return np.repeat(self.end[None] / len(self.position), len(self.position), axis=0)

    @property
    def begin(self) -> Floats:
        """Start times of the steps, shape (step, case)."""
        return self.length * np.arange(len(self.position))[:, None]

    def at(self, fraction: Floats) -> Floats:
        """Return all positions and then all velocities at fractions of the end time, shape (state, case, time)."""
        steps = len(self.position)
        place = fraction * steps
        step = np.minimum(place.astype(np.int64), steps - 1)
        x, h = (place - step)[:, None, None], self.end / steps
        inner = (self.acceleration[step, :, j] for j in range(STAGES))
        u, v = _inside(self.position[step], self.velocity[step], h, x, inner)
        return np.moveaxis(np.concatenate([u, v], axis=1), 0, -1)


@dataclass(frozen=True)
class Pieces:
    """A solution by steps of different lengths; NaN after a member's last step, and for members without a solution."""

    end: Floats
    begin: Floats
    """Start times of the steps, shape (step, case)."""
    length: Floats
    position: Floats
    """Shape (step, coordinate, case)."""
    velocity: Floats
    acceleration: Floats
    """Shape (step, coordinate, stage, case)."""

    def at(self, fraction: Floats) -> Floats:
        """Return all positions and then all velocities at fractions of the end time, shape (state, case, time)."""
        count = self.position.shape[1]
        states = np.full((2 * count, len(self.end), len(fraction)), np.nan)
        for case, end in enumerate(self.end):
            known = int(np.sum(np.isfinite(self.length[:, case])))
            # in parts, to bound memory
            for first in range(0, len(fraction) if known else 0, 4096):
                part = slice(first, first + 4096)
                states[:, case, part] = self._at(case, fraction[part] * end, known)
        return states

    def _at(self, case: int, t: Floats, known: int) -> Floats:
        begin = self.begin[:known, case]
        step = np.maximum(np.searchsorted(begin, t, side="right") - 1, 0)
        h = self.length[step, case]
        u, v = (row[step, :, case].T for row in (self.position, self.velocity))
        inner = (self.acceleration[step, :, j, case].T for j in range(STAGES))
        return np.concatenate(_inside(u, v, h, (t - begin[step]) / h, inner))


def _inside(
    u: Floats, v: Floats, h: Floats, x: Floats, inner: Iterable[Floats]
) -> tuple[Floats, Floats]:
    """Return positions and velocities after fractions x of steps, from those at the start and the stage accelerations.

    All arrays broadcast against each other.
    """
    once, twice = (row.T.reshape(STAGES, *x.shape) for row in integrals(x.ravel()))
    u = u + h * x * v
    for j, a in enumerate(inner):
        v = v + h * (once[j] * a)
        u = u + h * h * (twice[j] * a)
    return u, v


Solution = TypeVar("Solution", bound=Solved | Pieces)


def of_members(solution: Solution, members: Any) -> Solution:
    """Return the solution of a subset of the members."""
    arrays = {row.name: getattr(solution, row.name)[..., members] for row in fields(solution)}
    return replace(solution, **arrays)


def solve(force: Force, start: Floats, end: Floats, steps: int) -> Solved:
    """Take equal steps to the end time of each member; NaN from where the iteration does not converge.

    Parameters
    ----------
    start
        All positions and then all velocities at t = 0, shape (state, case).
    end
        End times, shape (case,).
    """
    h = end / steps
    u, v = np.array(np.split(start, 2))
    lost = np.zeros((2, *u.shape))
    inner = (len(u), STAGES, len(end))
    position, velocity = np.empty((2, steps, *u.shape))
    kept = Solved(end, position, velocity, np.empty((steps, *inner)))
    a = np.broadcast_to(force(u[:, None], v[:, None], 0.0 * end), inner)
    for n in range(steps):
        a = stages(force, u, v, (n + nodes()[0][:, None]) * h, h, a)
        kept.position[n], kept.velocity[n], kept.acceleration[n] = u, v, a
        u, v, lost = advanced(u, v, h, a, lost)
        a = ahead(a)
    return kept
