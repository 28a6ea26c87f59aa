r"""Collocation at the 12 Gauss points of a step, for ``u'' = a(u, u', t)``: coefficients, and the equations of a step.

Order 24 (E. Hairer, G. Wanner, S. Noersett, Solving Ordinary Differential Equations I, section II.7); the equations are
solved by iteration. Within a step the collocation polynomial is the solution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Force = Callable[[Floats, Floats, Floats], Floats]
"""The accelerations, shape (coordinate, stage, case), from positions and velocities of that shape and from times."""

STAGES = 12
ITERATIONS = 60
SMALL = 2.0**-51
"""A change of the accelerations is none that is smaller relative to them and to the velocities over a step."""
STALLED = 2.0**-30
"""Largest change that may be taken for round-off once changes no longer fall: forces magnify that of the positions."""


@dataclass(frozen=True)
class Tableau:
    """Coefficients of collocation for ``u'' = a``, shape (stage,) or (stage, stage)."""

    c: Floats
    first: Floats
    """Of the velocities at the stages."""
    second: Floats
    """Of the positions."""


@cache
def nodes() -> tuple[Floats, Floats, Floats]:
    """Return Gauss's points on [0, 1], their weights, and the barycentric weights of interpolation."""
    x, w = np.polynomial.legendre.leggauss(STAGES)
    c = 0.5 * (1.0 + x)
    gaps = c[:, None] - c[None, :] + np.eye(STAGES)
    return c, 0.5 * w, 1.0 / np.prod(4.0 * gaps, axis=1)


def basis(x: Floats) -> Floats:
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
    at = basis(x[:, None] * c)
    first = x[:, None] * np.sum(weight[:, None] * at, axis=1)
    second = x[:, None] ** 2 * np.sum((weight * (1.0 - c))[:, None] * at, axis=1)
    return first, second


@cache
def tableau() -> Tableau:
    """Return the coefficients of the stages."""
    c, _, _ = nodes()
    first, second = integrals(c)
    return Tableau(c, first, second)


def summed(coefficients: Floats, a: Floats) -> Floats:
    """Return ``coefficients @ a`` over the stages, summed in an order that does not depend on the number of members."""
    return total(coefficients[:, :, None] * a[:, None], axis=2)


def total(terms: Floats, axis: int) -> Floats:
    """Return the sum along an axis before the last one, from its first term to its last."""
    terms = np.ascontiguousarray(terms)
    if terms.shape[-1] == 1:
        # numpy adds up one column in another order than several
        return np.asarray(np.add.accumulate(terms, axis=axis).take(-1, axis=axis))
    return np.asarray(np.add.reduce(terms, axis=axis))


def added(total: Floats, change: Floats, lost: Floats) -> tuple[Floats, Floats]:
    """Return a sum, and what its rounding has lost, from what the sums before have lost."""
    change = change - lost
    found = total + change
    return found, (found - total) - change


def stages(force: Force, u: Floats, v: Floats, t: Floats, h: Floats, a: Floats) -> Floats:
    """Return the accelerations at the stages, shape (coordinate, stage, case), from a guess; NaN for no end."""
    of, both = tableau(), np.concatenate([tableau().first, tableau().second])
    going, before = np.ones(len(h), dtype=bool), np.full(len(h), np.inf)
    straight = u[:, None] + of.c[:, None] * h * v[:, None]
    for _ in range(ITERATIONS):
        once, twice = np.split(summed(both, a), 2, axis=1)
        y = v[:, None] + h * once
        found = np.broadcast_to(force(straight + h * h * twice, y, t), a.shape)
        change = np.max(np.abs(found - a), axis=(0, 1))
        size = np.max(np.abs(found) + np.abs(y) / h, axis=(0, 1))
        # a member that has come to rest in its last digits keeps them, whatever the others do
        a = np.where(going, found, a)
        stalled = (change <= STALLED * size) & ~(change < 0.5 * before)
        going, before = going & ~(change <= SMALL * size) & ~stalled, change
        if not (going & np.isfinite(change)).any():
            break
    return np.where(going, np.nan, a)
