r"""The step of a scheme as a matrix, and its roots: growth, numerical frequency, phase error, and stability limit.

On ``u'' + w^2 u = 0`` the step is a matrix acting on the carried state (the companion form of a multistep method), and
a solution of the discrete equations is a sum of powers of its eigenvalues. Two of them, the principal roots, tend to
``exp(+-i w dt)`` as dt vanishes; the others are parasitic. The principal roots are those of ``x^2 - T x + D``: if they
are complex, ``D^(1/2)`` is the growth per step and ``arccos(T/(2 D^(1/2)))`` the angle ``w~ dt``. T and D are real and
smooth, even where the two roots meet, so these are computed: first from the eigenvalues, then by Bairstow's method on
the characteristic polynomial in double-double precision, which resolves a growth of 1e-20 per step.

Source: vibration text (B), sections 4.1, 4.5 and 5.6, equations (18), (23) and (43)-(44), which treat two schemes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibsim.core.array_types import Complexes, Flags, Floats
from vibsim.elementary import on_arrays
from vibsim.schemes.base import Options, Scheme, Stepper
from vibsim.theory.arithmetic import bairstow, characteristic
from vibsim.theory.basis import UnitSteps, decimal, unit_steps, where_it_ends
from vibsim.theory.doubled import Doubled, doubled, root, stacked

GRID = np.concatenate([0.02 * np.arange(1, 401), np.geomspace(8.0, 1000.0, 61)[1:]])
"""Values of p = w dt at which the principal roots are tracked: so dense that each pair is closest to the previous."""

_REFINEMENTS = 3
_LARGER = 1e-6
"""Excess of growth per period above which a parasitic root dominates the principal pair."""
_FEW = 64
"""Largest number of values of p whose results are cached: all levels and parts of a sweep need the same ones."""
_PARTS = 65
_ROUNDS = 9
_FAR = np.geomspace(GRID[-1], 1e8, 101)[1:]
"""Further values of p for implicit schemes: the limit of Newmark's scheme tends to infinity as beta tends to 1/4."""
_PARASITIC = 1e-9
"""Growth of a parasitic root above which it is not rounding."""
_UNSEEN = 1e-11
"""Growth per step that decides nothing: what an iteration in a step leaves, a factor of 1.01 in 10^9 steps."""
_BESIDE = 1e-6
"""Relative distance from a limit within which a root that crosses the unit circle does so."""
_CROSSED = 1e-8
"""Least growth and decay at the ends of that interval for a crossing, as opposed to a root that stays on the circle."""

_TINY = 1e-3
"""A value of p that stands for the limit of vanishing steps."""
_BELOW = np.array([0.75, 0.9])
"""Parts of the limit where growth that only sinks below `_UNSEEN` is still seen in double-double."""


@dataclass(frozen=True)
class Amplification:
    """One step for each ``p = w dt``, in double-double, with velocities times dt; a state has s entries."""

    matrix: Doubled
    """``state^(n+1) = matrix state^n``, the position first, shape (..., s, s)."""
    start: Doubled
    """``state^1 = start (u_0, v_0 dt)``, shape (..., s, 2)."""
    velocity: Doubled
    """The scheme's own velocity, ``v^n dt = velocity . state^n``, shape (..., s)."""
    backward: Doubled | None
    """One-sided velocity times dt, shape (..., s), if the scheme ends with it; otherwise None."""


def amplification(stepper: Stepper, p: ArrayLike | Doubled) -> Amplification:
    """Return the step, the start and the velocities as matrices, for ``p = w dt`` of any shape."""
    steps = doubled(p)
    units = _units(stepper, steps)
    return Amplification(
        _matrix(units.step, steps.shape),
        _matrix(units.start, steps.shape),
        stacked(units.velocity, steps.shape),
        None if units.backward is None else stacked(units.backward, steps.shape),
    )


def _units(stepper: Stepper, p: Doubled, *, with_start: bool = True) -> UnitSteps:
    zero = doubled(np.zeros(p.shape))

    def run(p: Doubled, most: int) -> UnitSteps:
        return unit_steps(
            stepper, p, zero, lambda f: doubled(decimal(f)), with_start=with_start, most=most
        )

    with np.errstate(all="ignore"):
        return where_it_ends(run, stepper, p)


def _matrix(columns: Sequence[Sequence[Any]], shape: tuple[int, ...]) -> Doubled:
    """Return the matrix with these columns, lists of numbers that broadcast to `shape`."""
    parts = [stacked(column, shape) for column in columns]
    return stacked(parts, parts[0].shape)


@dataclass(frozen=True)
class Roots:
    """The roots for each ``p = w dt``; every array has the shape of p."""

    log_growth: Floats
    """Logarithm of the modulus of the larger principal root, accurate to rounding even if it is near 0."""
    angle: Floats
    """``w~ dt`` from 0 to pi: angle of the principal root, as seen on the mesh."""
    is_complex: Flags
    """Whether the principal roots are complex, so that the solution oscillates with any period."""
    parasitic: Floats
    """Largest modulus of the other roots; 0 if there are none."""
    parasitic_angle: Floats
    """Angle of that root, from 0 to pi; 0 if there are none."""


def dominant(stepper: Stepper, p: ArrayLike) -> tuple[Floats, Floats]:
    """Return growth per natural period and angle of the root that dominates a long run.

    It is the larger principal root, or a parasitic root that is larger by more than its rounding.
    """
    found, steps = roots(stepper, p), np.asarray(p, dtype=float)
    with np.errstate(divide="ignore", over="ignore"):
        parasitic = on_arrays.log(found.parasitic)
        # parasitic roots have a few digits less than the principal pair
        is_parasitic = (parasitic - found.log_growth) * (2.0 * np.pi / steps) > _LARGER
        log_growth = np.where(is_parasitic, parasitic, found.log_growth)
        factor = on_arrays.exp(log_growth * (2.0 * np.pi / steps))
    return factor, np.where(is_parasitic, found.parasitic_angle, found.angle)


def phase_error_per_period(stepper: Stepper, p: ArrayLike) -> Floats:
    """Return ``(P - P~)/P``, the relative error of the numerical period.

    Peak m comes m times that too early (B, exercise 2). Minus infinity if nothing oscillates.
    """
    angle = roots(stepper, p).angle
    with np.errstate(divide="ignore"):
        return np.asarray((angle - np.asarray(p, dtype=float)) / angle)


def roots(stepper: Stepper, p: ArrayLike) -> Roots:
    """Return the roots of a scheme for each ``p = w dt``; the arrays are read-only."""
    steps = np.asarray(p, dtype=float)
    function = _cached_columns if steps.size <= _FEW else _columns
    columns = function(stepper, steps.tobytes())
    return Roots(*(column.reshape(steps.shape) for column in columns))


def _columns(stepper: Stepper, p: bytes) -> tuple[NDArray[Any], ...]:
    """Return the columns of `Roots` for the floats in `p`, each of shape (k,)."""
    with np.errstate(all="ignore"):
        trace, determinant, parasitic = _quadratic(stepper, np.frombuffer(p))
        excess = determinant - trace * trace * 0.25
        is_complex = excess.high > 0
        angle = np.where(
            is_complex,
            on_arrays.atan2(root(excess).rounded, 0.5 * trace.rounded),
            np.where(trace.high < 0, np.pi, 0.0),
        )
        larger = abs(trace) * 0.5 + root(-excess)
        rate = np.where(
            is_complex,
            0.5 * on_arrays.log1p((determinant - 1.0).rounded),
            on_arrays.log1p((larger - 1.0).rounded),
        )
    size = on_arrays.complex_size(parasitic)
    parasitic_angle = on_arrays.atan2(np.abs(parasitic.imag), parasitic.real)
    columns = (rate, angle, is_complex, size, parasitic_angle)
    for column in columns:
        column.flags.writeable = False
    return columns


_cached_columns = lru_cache(maxsize=1024)(_columns)


def _quadratic(stepper: Stepper, p: Floats) -> tuple[Doubled, Doubled, Complexes]:
    """Return T and D of ``x^2 - T x + D`` with the principal roots, and the largest parasitic root; p of shape (k,)."""
    matrix = _step_matrix(stepper, p)
    if matrix.shape[-1] == 2:
        a, b, c, d = (matrix[..., i, j] for i in range(2) for j in range(2))
        return a + d, a * d - b * c, np.zeros(len(p), dtype=complex)
    below = np.searchsorted(GRID, p, side="right") - 1
    before = np.where((below < 0)[:, None], _exact_pair(p), _followed(stepper)[below])
    pair, others = _split(_eigenvalues(matrix), before)
    trace, determinant = (doubled(x.real) for x in (pair.sum(axis=-1), pair.prod(axis=-1)))
    largest = np.argmax(np.abs(others), axis=-1)[:, None]
    polynomial = characteristic(matrix)
    for _ in range(_REFINEMENTS):
        up, down = bairstow(polynomial, trace, determinant)
        good = np.isfinite(up.high + down.high)
        trace, determinant = trace + _where(good, up), determinant - _where(good, down)
    return trace, determinant, np.take_along_axis(others, largest, axis=-1)[:, 0]


def _where(good: Flags, value: Doubled) -> Doubled:
    return value.mapped(lambda part: np.where(good, part, 0.0))


def _step_matrix(stepper: Stepper, p: Floats) -> Doubled:
    return _matrix(_units(stepper, doubled(p), with_start=False).step, p.shape)


def _eigenvalues(matrix: Doubled) -> Complexes:
    """Return the eigenvalues; NaN if an entry is not finite."""
    values = matrix.rounded
    good = np.asarray(np.isfinite(values).all(axis=(-2, -1)))
    eigenvalues = np.linalg.eigvals(np.where(good[..., None, None], values, 0.0))
    return np.where(good[..., None], eigenvalues, np.nan).astype(complex)


def _exact_pair(p: Floats) -> Complexes:
    """Return ``exp(+-i p)``, shape (k, 2)."""
    return np.asarray(on_arrays.complex_exp(1j * np.stack([p, -p], axis=-1)))


@lru_cache(maxsize=256)
def _followed(stepper: Stepper) -> Complexes:
    """Return the principal pair along `GRID`, each the closest to the previous one, shape (n_grid, 2)."""
    followed = [_exact_pair(GRID[:1])]
    for row in _eigenvalues(_step_matrix(stepper, GRID)):
        pair, _ = _split(row[None], followed[-1])
        followed.append(pair if np.isfinite(pair).all() else followed[-1])
    return np.concatenate(followed[1:])


def _split(values: Complexes, before: Complexes) -> tuple[Complexes, Complexes]:
    """Return the pair of eigenvalues that is closest to the pair `before`, and the others; shapes (k, 2) and (k, s-2).

    A pair is two conjugate or two real eigenvalues; NaN makes none.
    """
    pairs, others = _pairs(values.shape[-1])
    first, second = values[:, pairs[:, 0]], values[:, pairs[:, 1]]
    a, b = before[:, :1], before[:, 1:]
    distance = np.minimum(
        np.abs(first - a) + np.abs(second - b), np.abs(first - b) + np.abs(second - a)
    )
    is_pair = np.abs((first + second).imag) <= 1e-12 * (np.abs(first) + np.abs(second))
    best = np.argmin(np.where(is_pair, distance, np.inf), axis=-1)
    return (
        np.take_along_axis(values, pairs[best], axis=-1),
        np.take_along_axis(values, others[best], axis=-1),
    )


@cache
def _pairs(size: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the indices of every pair among `size` roots, and those of the other roots."""
    pairs = list(combinations(range(size), 2))
    others = [[i for i in range(size) if i not in pair] for pair in pairs]
    return np.array(pairs), np.array(others)


def stability_limit(scheme: Scheme, options: Options) -> float:
    """Return the largest stable ``w dt``: infinite for no limit, 0 if every step is unstable.

    Below the limit no root is outside the unit circle. At the limit itself the amplitude may grow linearly, if two
    roots meet. If there are several intervals of stability, it is the end of the first. Adaptive schemes have none.
    A growth per step below 1e-11 is none, as an iteration leaves it. A growth that sinks below it with w dt, and does
    not turn into decay, is one at every step.
    """
    if scheme.adaptive:
        return float(np.inf)
    return _limit(scheme.stepper(options))


@lru_cache(maxsize=1024)
def is_zero_stable(stepper: Stepper) -> bool:
    """Tell whether the growth per step vanishes with dt; otherwise shorter steps overflow sooner.

    A consistent step without parasitic roots outside the unit circle grows by ``O(p^2)``.
    """
    return not bool(_largest(stepper, np.array([_TINY]))[0] > _TINY)


@lru_cache(maxsize=1024)
def _limit(stepper: Stepper) -> float:
    grid = np.concatenate([GRID, _FAR])
    growing = np.flatnonzero(_grows(stepper, grid))
    if not len(growing):
        return float(np.inf)
    if growing[0] == 0:
        return 0.0
    limit = _first(partial(_grows, stepper), grid[growing[0] - 1], grid[growing[0]])
    low, high = limit * (1.0 - _BESIDE), limit * (1.0 + _BESIDE)
    below, above = _largest(stepper, np.array([low, high]))
    if _UNSEEN < above <= _CROSSED and np.all(_largest(stepper, limit * _BELOW) > 0.0):
        return 0.0
    if not (below < -_CROSSED and above > _CROSSED):
        return limit
    return _first(lambda p: ~(_largest(stepper, p) <= 0.0), low, high)


def _first(grows: Callable[[Floats], Flags], low: float, high: float) -> float:
    """Return the last point before growth begins, between `low` without and `high` with growth."""
    for _ in range(_ROUNDS):
        points = np.linspace(low, high, _PARTS)
        first = int(np.argmax(grows(points)[1:])) + 1
        low, high = points[first - 1], points[first]
    return float(low)


def _largest(stepper: Stepper, p: Floats) -> Floats:
    """Return the logarithm of the modulus of the largest root, without the tolerance of `_grows`."""
    found = roots(stepper, p)
    with np.errstate(divide="ignore"):
        return np.asarray(np.maximum(found.log_growth, on_arrays.log(found.parasitic)))


def _grows(stepper: Stepper, p: Floats) -> Flags:
    """Tell for which p a root is outside the unit circle by more than rounding, of a run or in double-double."""
    found = roots(stepper, p)
    rounding = 1e-28 * (1.0 + p * p)
    # near a double root, rounding enters with its square root
    least = np.where(found.is_complex, np.maximum(rounding, _UNSEEN), np.sqrt(rounding))
    is_principal = ~(found.log_growth <= least)
    return is_principal | ~(found.parasitic <= 1.0 + _PARASITIC)
