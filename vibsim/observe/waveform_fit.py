r"""A computed oscillation told apart into a shift in time and a factor, against a motion U that it should be.

Around every time t, in a window of one to two periods, the computed position is fitted by

    u_h(s)  =  c + exp(alpha(s)) U(s + phi(s)),      alpha and phi linear in s,

by Newton's method on the conditions that what is left is orthogonal to 1, U, s U, U' and s U'. So ``phi(t)`` is the
time by which the computed motion is early (negative: late), and ``exp(alpha(t)) - 1`` the part by which its amplitude
is too large; to first order the error is ``a u + phi u'``. Shifts are not linearised: a shift by phi is no change of
the amplitude by phi^2, as it would be in first-order terms. Both may change with time: a frequency that is wrong, and
an exponential growth, are met exactly, so that the one does not leak into the other. On ``u'' + w^2 u = 0`` every
scheme whose solution is ``A exp(lambda t) cos(w~ t + theta)`` leaves nothing. The constant takes what a scheme gets
wrong of the place around which it swings.

A shift that is not small is first read from the phase plane: the time at which U has the angle ``atan2(-v, w u)`` that
the computed motion has now.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vibsim.convergence.differences import total
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.observe.quintic_interpolant import Template
from vibsim.observe.thresholds import (
    BEYOND_THE_ENDS,
    HALF_WINDOW,
    LARGE_SHIFT,
    LAST_ROUND_MOVES,
    LEAST_PER_SHIFT,
    ROUNDS,
    SHORTEST_RUN,
    WINDOW_POINTS,
)

PIECE = 2**18
"""Numbers of one kind that are worked on at a time."""


@dataclass(frozen=True)
class Shift:
    """Shape (r, t); a row is NaN throughout where it could not be found at some time."""

    time: Floats
    """By which the computed motion is early."""
    factor: Floats
    """Of the amplitude, less one."""


def strides(period: Floats, spacing: Floats, points: int) -> Integers:
    """Return the distance between the points of a window, shape (r,); 0 where the run or the samples are too few.

    Parameters
    ----------
    period
        Of the motion, shape (r,).
    spacing
        Distance between the samples, shape (r,).
    points
        Number of samples.
    """
    samples = period / spacing
    wanted = np.ceil(samples / (2 * HALF_WINDOW))
    most = (points - 1) // (2 * HALF_WINDOW)
    found = np.clip(wanted, 1, max(most, 1))
    usable = (
        (samples >= LEAST_PER_SHIFT)
        & (most >= 1)
        & (found * 2 * HALF_WINDOW >= SHORTEST_RUN * samples)
    )
    return np.where(usable, found, 0).astype(np.int64)


def shift(
    position: Floats, velocity: Floats, of: Template, period: Floats, stride: Integers
) -> Shift:
    """Tell shift and factor of computed motions apart.

    Parameters
    ----------
    position, velocity
        The computed motion, shape (r, t). The velocity is used for a first guess of large shifts only.
    of
        The motion that it should be.
    period, stride
        Shape (r,); see `strides`.
    """
    found = np.full((2, *position.shape), np.nan)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        guess, largest = _guess(position, velocity, of, period)
        kept = (stride > 0) & np.isfinite(position).all(axis=-1)
        kept &= np.isfinite(of.position).all(axis=-1) & np.isfinite(of.velocity).all(axis=-1)
        least = 0.0
        for most, rounds in ROUNDS:
            rows = np.flatnonzero(kept & (largest >= least) & (largest < most))
            least = most
            for chosen, at in _pieces(rows, position.shape[-1]):
                part = _rows(of, chosen)
                mine = position[chosen], guess[chosen], part, period[chosen], stride[chosen]
                found[:, chosen[:, None], at] = _fitted(*mine, at, rounds)
        found[:, ~np.isfinite(found).all(axis=(0, 2))] = np.nan
    return Shift(found[0], found[1])


def _pieces(rows: Integers, points: int) -> Iterator[tuple[Integers, Integers]]:
    """Yield rows and samples that are worked on together."""
    piece = max(PIECE // WINDOW_POINTS, 1)
    step = max(piece // points, 1)
    for first in range(0, len(rows), step):
        for start in range(0, points, piece):
            yield rows[first : first + step], np.arange(start, min(start + piece, points))


def _rows(of: Template, chosen: Integers) -> Template:
    return Template(
        of.position[chosen],
        of.velocity[chosen],
        of.spacing[chosen],
        of.coefficients[:, chosen],
    )


def _fitted(
    position: Floats,
    guess: Floats,
    of: Template,
    period: Floats,
    stride: Integers,
    at: Integers,
    rounds: int,
) -> Floats:
    """Return shift and factor at the samples `at`, shape (2, r, len(at)); windows lie along the first dimension."""
    last = position.shape[-1] - 1
    low, high = _inside(guess, of.spacing)
    high = np.maximum(high - 2 * HALF_WINDOW * stride, low)
    first = np.clip(at - HALF_WINDOW * stride[:, None], low[:, None], high[:, None])
    centre = first + HALF_WINDOW * stride[:, None]
    places = first + stride[:, None] * np.arange(WINDOW_POINTS)[:, None, None]
    rows = np.arange(len(position))[:, None]
    u, still = position[rows, places], ~_turns(of.velocity[rows, places])
    s = ((np.arange(WINDOW_POINTS) - HALF_WINDOW) / HALF_WINDOW)[:, None, None]
    radian, h = period[:, None] / (2 * math.pi), of.spacing[:, None]
    phi, slope = guess[rows, centre], np.zeros(centre.shape)
    rise, offset = (np.zeros(centre.shape) for _ in range(2))
    alpha = 0.5 * np.log(_spread(u) / _spread(of.position[rows, places]))
    moved = np.full(centre.shape, np.inf)
    for _ in range(rounds):
        where = places + (phi + slope * s) / h
        there, speed = of.at(where)
        beyond = np.maximum(-where, where - last)
        weight = np.clip((BEYOND_THE_ENDS - beyond) / (0.5 * BEYOND_THE_ENDS), 0.0, 1.0)
        left = (u - offset) * np.exp(-alpha - rise * s) - there
        speed = speed * radian
        by = _solved([np.ones(u.shape), there, s * there, speed, s * speed], left, weight)
        # of a factor the whole of the change is taken, however large it is
        gain = np.maximum(by[1], -0.9)
        offset = offset + by[0] * np.exp(alpha)
        alpha, rise = alpha + np.log1p(gain), rise + by[2] / (1.0 + gain)
        phi, slope = phi + by[3] * radian, slope + by[4] * radian
        moved = np.maximum(np.abs(by[1]) + np.abs(by[2]), np.abs(by[3]) + np.abs(by[4]))
    away = (at - centre) / (HALF_WINDOW * stride[:, None])
    found = np.stack([phi + slope * away, np.expm1(alpha + rise * away)])
    return np.where(still | ~(moved < LAST_ROUND_MOVES), np.nan, found)


def _inside(guess: Floats, spacing: Floats) -> tuple[Integers, Integers]:
    """Return the first and the last sample that a guessed shift leaves within the template, each of shape (r,)."""
    last = guess.shape[-1] - 1
    moved = np.arange(last + 1) + guess / spacing[:, None]
    inside = (moved >= 0) & (moved <= last)
    return np.argmax(inside, axis=-1), last - np.argmax(inside[:, ::-1], axis=-1)


def _turns(velocity: Floats) -> Flags:
    """Say where the motion turns within a window: only then it oscillates."""
    return np.asarray((np.min(velocity, axis=0) < 0) & (np.max(velocity, axis=0) > 0))


def _spread(values: Floats) -> Floats:
    """Return the sum of squares around the mean over a window, shape (r, t)."""
    rest = values - _sum(values) / WINDOW_POINTS
    return _sum(rest * rest)


def _sum(values: Floats) -> Floats:
    """Return the sum over a window, shape (r, t)."""
    return total(np.moveaxis(values, 0, -1))


def _solved(basis: list[Floats], left: Floats, weight: Floats) -> list[Floats]:
    """Return the least-squares coefficients of `left` in the basis, each of shape (r, t).

    Gaussian elimination of the normal equations, written out so that the bits do not depend on a library.
    """
    n = len(basis)
    weighted = [weight * row for row in basis]
    matrix = [
        [_sum(weighted[i] * basis[j]) if j >= i else None for j in range(n)] for i in range(n)
    ]
    a: list[list[Floats]] = [
        [np.asarray(matrix[min(i, j)][max(i, j)]) for j in range(n)] for i in range(n)
    ]
    b = [_sum(row * left) for row in weighted]
    for k in range(n):
        for i in range(k + 1, n):
            ratio = a[i][k] / a[k][k]
            a[i] = [x - ratio * y for x, y in zip(a[i], a[k], strict=True)]
            b[i] = b[i] - ratio * b[k]
    found = [b[0]] * n
    for k in reversed(range(n)):
        rest = b[k]
        for j in range(k + 1, n):
            rest = rest - a[k][j] * found[j]
        found[k] = rest / a[k][k]
    return found


def _guess(
    position: Floats, velocity: Floats, of: Template, period: Floats
) -> tuple[Floats, Floats]:
    """Return a first guess of the shift from the phase plane, shape (r, t), and the largest one in radians, shape (r,).

    It is 0 for rows where all are small.
    """
    w = 2 * math.pi / period[:, None]
    middle = 0.5 * (np.max(of.position, axis=-1) + np.min(of.position, axis=-1))[:, None]
    turned, target = (
        np.unwrap(np.arctan2(-v, w * (u - middle)), axis=-1)
        for u, v in ((position, velocity), (of.position, of.velocity))
    )
    found = np.zeros(position.shape)
    largest = np.nan_to_num(np.max(np.abs(turned - target), axis=-1))
    monotone = np.min(np.diff(target, axis=-1), axis=-1) > 0
    times = of.times
    for row in np.flatnonzero((largest > LARGE_SHIFT) & monotone).tolist():
        late = np.maximum(turned[row] - target[row, -1], 0.0) / w[row]
        found[row] = np.interp(turned[row], target[row], times[row]) + late - times[row]
    return found, largest
