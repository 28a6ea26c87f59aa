r"""The roots of a scheme: growth of the amplitude, numerical frequency and phase error.

On ``u'' + w^2 u = 0`` a solution of the discrete equations is a sum of powers of the eigenvalues of the matrix of a
step. Two of them, the principal ones, tend to ``exp(+-i w dt)`` as dt vanishes; the others are parasitic. The
principal ones are the roots of ``x^2 - T x + D``: as long as they are complex, ``D^(1/2)`` is the growth per step and
``arccos(T/(2 D^(1/2)))`` the angle ``w~ dt``. T and D are real and smooth, also where the two roots meet, so they are
what is worked out: from the eigenvalues first, then by Bairstow's method on the characteristic polynomial in twice the
precision, so that a growth of 1e-20 per step is seen.

Source: vibration text (B), equations (18) and (43)-(44) for two schemes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibsim.schemes.base import Stepper
from vibsim.theory.amplification import step_matrix
from vibsim.theory.division import by_quadratic
from vibsim.theory.doubled import Doubled, doubled, matmul, root

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

GRID = np.concatenate([0.02 * np.arange(1, 401), np.geomspace(8.0, 1000.0, 61)[1:]])
"""Where the principal roots are followed, p = w dt: close enough for each pair to lie next to the one before."""

_REFINEMENTS = 3
_LARGER = 1e-6
"""Growth per period by which a parasitic root outgrows the principal pair."""


@dataclass(frozen=True)
class Roots:
    """The roots for each ``p = w dt``; every array has the shape of p."""

    log_growth: Floats
    """Logarithm of the larger one of the principal pair, exact to rounding also where the growth is 1 to rounding."""
    angle: Floats
    """``w~ dt`` from 0 to pi: angle of the principal root, as points on the mesh show it."""
    is_complex: NDArray[np.bool_]
    """Whether the principal roots are complex, so that the solution oscillates with any period."""
    parasitic: Floats
    """Largest absolute value of the other roots; 0 where there are none."""
    parasitic_angle: Floats
    """Angle of that root, from 0 to pi; 0 where there are none."""


def growth(stepper: Stepper, p: ArrayLike) -> Floats:
    """Return the factor by which the amplitude grows in a step.

    Parameters
    ----------
    p
        ``w dt``, of any shape, as everywhere in this module.
    """
    return np.asarray(np.exp(roots(stepper, p).log_growth))


def log_growth(stepper: Stepper, p: ArrayLike) -> Floats:
    """Return the logarithm of `growth`."""
    return roots(stepper, p).log_growth


def growth_per_period(stepper: Stepper, p: ArrayLike) -> Floats:
    """Return the factor by which the amplitude grows in a natural period, ``2 pi/w``."""
    with np.errstate(over="ignore"):
        return np.asarray(
            np.exp(log_growth(stepper, p) * (2.0 * np.pi / np.asarray(p, dtype=float)))
        )


def spectral_radius(stepper: Stepper, p: ArrayLike) -> Floats:
    """Return the largest absolute value of all roots, parasitic ones as well."""
    found = roots(stepper, p)
    return np.asarray(np.maximum(np.exp(found.log_growth), found.parasitic))


def dominant(stepper: Stepper, p: ArrayLike) -> tuple[Floats, Floats]:
    """Return growth per natural period and angle of the root that a long run is left with.

    It is the larger one of the principal pair, or a parasitic root that is larger by more than its rounding.
    """
    found, steps = roots(stepper, p), np.asarray(p, dtype=float)
    with np.errstate(divide="ignore", over="ignore"):
        other = np.log(found.parasitic)
        # parasitic roots are found to a few digits less than the principal pair
        is_other = (other - found.log_growth) * (2.0 * np.pi / steps) > _LARGER
        log_growth = np.where(is_other, other, found.log_growth)
        factor = np.exp(log_growth * (2.0 * np.pi / steps))
    return factor, np.where(is_other, found.parasitic_angle, found.angle)


def numerical_frequency(stepper: Stepper, p: ArrayLike) -> Floats:
    """Return ``w~ dt``, as points on the mesh show it: from 0 to pi."""
    return roots(stepper, p).angle


def frequency_ratio(stepper: Stepper, p: ArrayLike) -> Floats:
    """Return ``w~/w``."""
    return np.asarray(numerical_frequency(stepper, p) / np.asarray(p, dtype=float))


def phase_error_per_period(stepper: Stepper, p: ArrayLike) -> Floats:
    """Return ``(P - P~)/P``: by how much of the natural period a numerical period is too short.

    Peak number m comes m times that too early (B, exercise 2); minus infinity where nothing oscillates.
    """
    angle = numerical_frequency(stepper, p)
    with np.errstate(divide="ignore"):
        return np.asarray((angle - np.asarray(p, dtype=float)) / angle)


def roots(stepper: Stepper, p: ArrayLike) -> Roots:
    """Return what the roots of a scheme say for each ``p = w dt``."""
    steps = np.asarray(p, dtype=float)
    with np.errstate(all="ignore"):
        trace, determinant, other = _quadratic(stepper, np.atleast_1d(steps).ravel())
        excess = determinant - trace * trace * 0.25
        is_complex = excess.high > 0
        angle = np.where(
            is_complex,
            np.arctan2(root(excess).rounded, 0.5 * trace.rounded),
            np.where(trace.high < 0, np.pi, 0.0),
        )
        larger = abs(trace) * 0.5 + root(-excess)
        rate = np.where(
            is_complex,
            0.5 * np.log1p((determinant - 1.0).rounded),
            np.log1p((larger - 1.0).rounded),
        )
    shape = steps.shape
    return Roots(
        rate.reshape(shape),
        angle.reshape(shape),
        np.asarray(is_complex).reshape(shape),
        np.abs(other).reshape(shape),
        np.abs(np.angle(other)).reshape(shape),
    )


def _quadratic(stepper: Stepper, p: Floats) -> tuple[Doubled, Doubled, Complexes]:
    """Return T and D of ``x^2 - T x + D`` with the principal roots, and the largest other one, for p of shape (k,)."""
    matrix = step_matrix(stepper, doubled(p))
    if matrix.shape[-1] == 2:
        a, b, c, d = (matrix[..., i, j] for i in range(2) for j in range(2))
        return a + d, a * d - b * c, np.zeros(len(p), dtype=complex)
    below = np.searchsorted(GRID, p, side="right") - 1
    before = np.where((below < 0)[:, None], _turned(p), _followed(stepper)[below])
    pair, others = _split(_eigenvalues(matrix), before)
    trace, determinant = (doubled(x.real) for x in (pair.sum(axis=-1), pair.prod(axis=-1)))
    largest = np.argmax(np.abs(others), axis=-1)[:, None]
    parasitic = np.take_along_axis(others, largest, axis=-1)[:, 0]
    return *_refined(characteristic(matrix), trace, determinant), parasitic


def characteristic(matrix: Doubled) -> list[Doubled]:
    """Return the coefficients of the characteristic polynomial, the highest power first, by Leverrier's method."""
    size = matrix.shape[-1]
    identity = np.eye(size)
    coefficients = [doubled(np.ones(matrix.shape[:-2]))]
    product = matrix
    for k in range(1, size + 1):
        trace = product[..., 0, 0]
        for i in range(1, size):
            trace = trace + product[..., i, i]
        coefficients.append(-trace / k)
        if k < size:
            product = matmul(matrix, product + coefficients[-1][..., None, None] * identity)
    return coefficients


def _refined(
    polynomial: list[Doubled], trace: Doubled, determinant: Doubled
) -> tuple[Doubled, Doubled]:
    """Return T and D with ``x^2 - T x + D`` dividing a polynomial, by Bairstow's method."""
    for _ in range(_REFINEMENTS):
        b = by_quadratic(polynomial, trace, determinant)
        slopes = by_quadratic(b[:-1], trace, determinant)
        one, zero = b[-2], b[-1]
        c_1, c_2, c_3 = slopes[-1], slopes[-2], slopes[-3] if len(slopes) > 2 else doubled(0.0)
        bottom = c_2 * c_2 - c_1 * c_3
        d_trace = (c_3 * zero - c_2 * one) / bottom
        d_minus = (c_1 * one - c_2 * zero) / bottom
        good = np.isfinite(d_trace.high + d_minus.high)
        trace = trace + _where(good, d_trace)
        determinant = determinant - _where(good, d_minus)
    return trace, determinant


def _where(good: NDArray[np.bool_], value: Doubled) -> Doubled:
    return Doubled(np.where(good, value.high, 0.0), np.where(good, value.low, 0.0))


def _eigenvalues(matrix: Doubled) -> Complexes:
    """Return the eigenvalues; NaN where an entry is not finite."""
    values = matrix.rounded
    good = np.asarray(np.isfinite(values).all(axis=(-2, -1)))
    found = np.linalg.eigvals(np.where(good[..., None, None], values, 0.0))
    return np.where(good[..., None], found, np.nan).astype(complex)


def _turned(p: Floats) -> Complexes:
    """Return the exact pair, ``exp(+-i p)``, shape (k, 2)."""
    turn = np.exp(1j * p)
    return np.stack([turn, turn.conj()], axis=-1)


@lru_cache(maxsize=256)
def _followed(stepper: Stepper) -> Complexes:
    """Return the principal pair along `GRID`, each the nearest to the one before, shape (n_grid, 2)."""
    found = _eigenvalues(step_matrix(stepper, doubled(GRID)))
    pairs, _ = _pairs(found.shape[-1])
    one, other = _turned(GRID[:1])[0].tolist()
    followed = []
    choices = zip(found[:, pairs].tolist(), _is_pair(found).tolist(), strict=True)
    for candidates, allowed in choices:
        near = [
            (min(abs(x - one) + abs(y - other), abs(x - other) + abs(y - one)), k)
            for k, ((x, y), is_allowed) in enumerate(zip(candidates, allowed, strict=True))
            if is_allowed
        ]
        one, other = candidates[min(near)[1]] if near else (one, other)
        followed.append((one, other))
    return np.array(followed)


def _split(found: Complexes, before: Complexes) -> tuple[Complexes, Complexes]:
    """Return the two roots that are next to two others, and the rest; shapes (k, 2) and (k, s-2)."""
    pairs, rest = _pairs(found.shape[-1])
    first, second = found[:, pairs[:, 0]], found[:, pairs[:, 1]]
    a, b = before[:, :1], before[:, 1:]
    apart = np.minimum(
        np.abs(first - a) + np.abs(second - b), np.abs(first - b) + np.abs(second - a)
    )
    best = np.argmin(np.where(_is_pair(found), apart, np.inf), axis=-1)
    return (
        np.take_along_axis(found, pairs[best], axis=-1),
        np.take_along_axis(found, rest[best], axis=-1),
    )


def _is_pair(found: Complexes) -> NDArray[np.bool_]:
    """Say which pairs of eigenvalues are conjugate or both real; NaN makes none."""
    pairs, _ = _pairs(found.shape[-1])
    first, second = found[:, pairs[:, 0]], found[:, pairs[:, 1]]
    return np.asarray(np.abs((first + second).imag) <= 1e-12 * (np.abs(first) + np.abs(second)))


@cache
def _pairs(size: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the indices of every pair among `size` roots, and those of the rest."""
    pairs = list(combinations(range(size), 2))
    rest = [[i for i in range(size) if i not in pair] for pair in pairs]
    return np.array(pairs), np.array(rest)
