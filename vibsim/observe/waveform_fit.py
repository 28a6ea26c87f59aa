r"""Decomposition of a computed oscillation into a time shift and an amplitude factor relative to a motion U.

Around every time t, in a window of one to two periods, the computed position is fitted by

    u_h(s)  =  c + exp(alpha(s)) U(s + phi(s)),      alpha and phi linear in s,

by Newton's method on the conditions that the residual is orthogonal to 1, U, s U, U' and s U'. So ``phi(t)`` is the
time by which the computed motion is early (negative: late), and ``exp(alpha(t)) - 1`` the relative excess of its
amplitude; to first order the error is ``a u + phi u'``. Shifts are not linearised: to first order a shift by phi would
also appear as a change of the amplitude by phi^2. Both may vary with time: a wrong frequency and an exponential growth
are fitted exactly, so that neither contaminates the other. On ``u'' + w^2 u = 0`` every scheme whose solution is
``A exp(lambda t) cos(w~ t + theta)`` leaves no residual. The constant c absorbs errors of the centre of oscillation.

The initial guess of a shift that is not small comes from the phase plane: the time at which U has the current angle
``atan2(-v, w u)`` of the computed motion.

Between its samples U is a quintic, ``c0 + c1 y + ... + c5 y^5`` with y from 0 to 1, that matches position, velocity and
acceleration at both points (Hermite interpolation). Near a point its error is ``|y|^3 h^6/720`` times the sixth
derivative: it vanishes with the distance from the point, so that a small time shift costs no accuracy.

Each row r is one scheme and member.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vibsim.convergence.differences import total
from vibsim.core.array_types import Floats, Integers
from vibsim.elementary import on_arrays
from vibsim.observe import thresholds as th

NUMBERS_AT_A_TIME = 2**18  # size of temporary arrays
SAMPLES_AT_A_TIME = NUMBERS_AT_A_TIME // th.WINDOW_POINTS  # each sample has its own window


@dataclass(frozen=True)
class QuinticInterpolant:
    """Reference motions, interpolated between their samples."""

    position: Floats  # shape (r, t)
    velocity: Floats  # shape (r, t)
    spacing: Floats  # distance between points, shape (r,)
    coefficients: Floats  # of the cell after each point but the last, shape (6, r, t-1)

    def at(self, place: Floats) -> tuple[Floats, Floats]:
        """Return position and velocity at places in units of the spacing, shape (..., r, n), also beyond the ends."""
        cells = self.coefficients.shape[-1]
        cell = np.clip(np.floor(np.nan_to_num(place)), 0, cells - 1)
        y = place - cell
        flat = cell.astype(np.int64) + cells * np.arange(len(self.spacing))[:, None]
        c = [row.ravel().take(flat) for row in self.coefficients]
        position = c[0] + y * (c[1] + y * (c[2] + y * (c[3] + y * (c[4] + y * c[5]))))
        slope = c[1] + y * (2 * c[2] + y * (3 * c[3] + y * (4 * c[4] + y * (5 * c[5]))))
        return position, slope / self.spacing[:, None]

    def repeated(self, count: int) -> QuinticInterpolant:
        """Return `count` copies of the motions one after the other, shape (count r, t)."""
        position, velocity = (np.tile(x, (count, 1)) for x in (self.position, self.velocity))
        coefficients = np.tile(self.coefficients, (1, count, 1))
        return QuinticInterpolant(position, velocity, np.tile(self.spacing, count), coefficients)


def quintic_interpolant(
    position: Floats, velocity: Floats, acceleration: Floats, spacing: Floats
) -> QuinticInterpolant:
    """Return the motion with these samples, shape (r, t), at a distance of shape (r,)."""
    h = spacing[:, None]
    v, a = h * velocity, h * h * acceleration
    u0, u1 = position[:, :-1], position[:, 1:]
    v0, v1, a0, a1 = v[:, :-1], v[:, 1:], a[:, :-1], a[:, 1:]
    rise = u1 - u0
    coefficients = [
        u0,
        v0,
        0.5 * a0,
        10 * rise - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1,
        -15 * rise + 8 * v0 + 7 * v1 + 1.5 * a0 - a1,
        6 * rise - 3 * v0 - 3 * v1 - 0.5 * a0 + 0.5 * a1,
    ]
    return QuinticInterpolant(position, velocity, spacing, np.stack(coefficients))


def strides(period: Floats, spacing: Floats, points: int) -> Integers:
    """Return the distance between the points of a window, in samples; 0 if run or samples are too few; shape (r,).

    `period` and the `spacing` of samples have shape (r,).
    """
    samples = period / spacing
    most = (points - 1) // (2 * th.HALF_WINDOW)
    stride = np.clip(np.ceil(samples / (2 * th.HALF_WINDOW)), 1, max(most, 1))
    usable = (samples >= th.LEAST_PER_SHIFT) & (most >= 1)
    usable &= stride * 2 * th.HALF_WINDOW >= th.SHORTEST_RUN * samples
    return np.where(usable, stride, 0).astype(np.int64)


def fit_shift(
    position: Floats, velocity: Floats, of: QuinticInterpolant, period: Floats, stride: Integers
) -> Floats:
    """Return time shift and amplitude factor of computed motions.

    Parameters
    ----------
    position, velocity
        The computed motion, shape (r, t). The velocity is only used for the initial guess of large shifts.
    of
        The reference motion.
    period, stride
        Shape (r,); see `strides`.

    Returns
    -------
    array
        The time by which the motion is early, and the amplitude factor minus 1, shape (2, r, t); NaN throughout for a
        row in which the fit fails at some time.
    """
    result = np.full((2, *position.shape), np.nan)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        guess, largest = _guess(position, velocity, of, period)
        kept = (stride > 0) & np.isfinite(position).all(axis=-1)
        kept &= np.isfinite(of.position).all(axis=-1) & np.isfinite(of.velocity).all(axis=-1)
        least = 0.0
        for most, rounds in th.ROUNDS:
            rows = np.flatnonzero(kept & (largest >= least) & (largest < most))
            least = most
            for r, at in _pieces(rows, position.shape[-1]):
                part = QuinticInterpolant(
                    of.position[r], of.velocity[r], of.spacing[r], of.coefficients[:, r]
                )
                rows_of = position[r], guess[r], part, period[r], stride[r]
                result[:, r[:, None], at] = _fit_windows(*rows_of, at, rounds)
        result[:, ~np.isfinite(result).all(axis=(0, 2))] = np.nan
    return result


def _pieces(rows: Integers, points: int) -> Iterator[tuple[Integers, Integers]]:
    """Yield rows and samples that are processed together."""
    step = max(SAMPLES_AT_A_TIME // points, 1)
    for first in range(0, len(rows), step):
        for start in range(0, points, SAMPLES_AT_A_TIME):
            stop = min(start + SAMPLES_AT_A_TIME, points)
            yield rows[first : first + step], np.arange(start, stop)


def _fit_windows(
    position: Floats,
    guess: Floats,
    of: QuinticInterpolant,
    period: Floats,
    stride: Integers,
    at: Integers,
    rounds: int,
) -> Floats:
    """Return shift and factor at the samples `at`, shape (2, r, len(at)); windows are along the first dimension."""
    last, half = position.shape[-1] - 1, th.HALF_WINDOW
    # windows are moved so that their shifted samples stay within the template
    moved = np.arange(last + 1) + guess / of.spacing[:, None]
    inside = (moved >= 0) & (moved <= last)
    low = np.argmax(inside, axis=-1)
    high = np.maximum(last - np.argmax(inside[:, ::-1], axis=-1) - 2 * half * stride, low)
    first = np.clip(at - half * stride[:, None], low[:, None], high[:, None])
    centre = first + half * stride[:, None]
    places = first + stride[:, None] * np.arange(th.WINDOW_POINTS)[:, None, None]
    rows = np.arange(len(position))[:, None]
    u, speed = position[rows, places], of.velocity[rows, places]
    # a motion that does not turn within the window does not oscillate
    turns = (np.min(speed, axis=0) < 0) & (np.max(speed, axis=0) > 0)
    s = ((np.arange(th.WINDOW_POINTS) - half) / half)[:, None, None]
    radian, h = period[:, None] / (2 * math.pi), of.spacing[:, None]
    phi, slope = guess[rows, centre], np.zeros(centre.shape)
    rise, offset = (np.zeros(centre.shape) for _ in range(2))
    alpha = 0.5 * on_arrays.log(_spread(u) / _spread(of.position[rows, places]))
    moves = np.full(centre.shape, np.inf)
    for _ in range(rounds):
        where = places + (phi + slope * s) / h
        there, speed = of.at(where)
        beyond = np.maximum(-where, where - last)
        weight = np.clip((th.BEYOND_THE_ENDS - beyond) / (0.5 * th.BEYOND_THE_ENDS), 0.0, 1.0)
        residual = (u - offset) * on_arrays.exp(-alpha - rise * s) - there
        speed = speed * radian
        basis = [np.ones(u.shape), there, s * there, speed, s * speed]
        by = _least_squares(basis, residual, weight)
        # the factor is not linearised: log1p takes its whole change
        gain = np.maximum(by[1], -0.9)
        offset = offset + by[0] * on_arrays.exp(alpha)
        alpha, rise = alpha + on_arrays.log1p(gain), rise + by[2] / (1.0 + gain)
        phi, slope = phi + by[3] * radian, slope + by[4] * radian
        moves = np.maximum(np.abs(by[1]) + np.abs(by[2]), np.abs(by[3]) + np.abs(by[4]))
    away = (at - centre) / (half * stride[:, None])
    fit = np.stack([phi + slope * away, on_arrays.expm1(alpha + rise * away)])
    return np.where(turns & (moves < th.LAST_ROUND_MOVES), fit, np.nan)


def _spread(values: Floats) -> Floats:
    """Return the sum of squares around the mean over a window, shape (r, t)."""
    centred = values - _sum(values) / th.WINDOW_POINTS
    return _sum(centred * centred)


def _sum(values: Floats) -> Floats:
    """Return the sum over a window, shape (r, t)."""
    return total(np.moveaxis(values, 0, -1))


def _least_squares(basis: list[Floats], target: Floats, weight: Floats) -> list[Floats]:
    """Return the weighted least-squares coefficients of `target` in the basis, each of shape (r, t).

    Gaussian elimination of the normal equations, so that the bits do not depend on a library.
    """
    n = len(basis)
    weighted = [weight * row for row in basis]
    a: list[list[Floats]] = [[] for _ in basis]
    for i in range(n):
        a[i] = [a[j][i] if j < i else _sum(weighted[i] * basis[j]) for j in range(n)]
    b = [_sum(row * target) for row in weighted]
    for k in range(n):
        for i in range(k + 1, n):
            ratio = a[i][k] / a[k][k]
            a[i] = [x - ratio * y for x, y in zip(a[i], a[k], strict=True)]
            b[i] = b[i] - ratio * b[k]
    x = [b[0]] * n
    for k in reversed(range(n)):
        numerator = b[k]
        for j in range(k + 1, n):
            numerator = numerator - a[k][j] * x[j]
        x[k] = numerator / a[k][k]
    return x


def _guess(
    position: Floats, velocity: Floats, of: QuinticInterpolant, period: Floats
) -> tuple[Floats, Floats]:
    """Return an initial guess of the shift from the phase plane, shape (r, t), and the largest in radians, shape (r,).

    The guess is 0 for rows whose shifts are all small.
    """
    w = 2 * math.pi / period[:, None]
    middle = 0.5 * (np.max(of.position, axis=-1) + np.min(of.position, axis=-1))[:, None]
    turned, target = (
        np.unwrap(on_arrays.atan2(-v, w * (u - middle)), axis=-1)
        for u, v in ((position, velocity), (of.position, of.velocity))
    )
    guess = np.zeros(position.shape)
    largest = np.nan_to_num(np.max(np.abs(turned - target), axis=-1))
    monotone = np.min(np.diff(target, axis=-1), axis=-1) > 0
    for row in np.flatnonzero((largest > th.LARGE_SHIFT) & monotone).tolist():
        times = of.spacing[row] * np.arange(position.shape[-1])
        late = np.maximum(turned[row] - target[row, -1], 0.0) / w[row]
        guess[row] = np.interp(turned[row], target[row], times) + late - times
    return guess, largest
