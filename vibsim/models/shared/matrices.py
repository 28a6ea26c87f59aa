r"""Matrices of a linear structure, its natural modes, and the motion of one mode under constant and harmonic loads.

A mode with the shape x, ``K x = w^2 M x`` and ``x' M x = 1``, moves like ``q'' + 2 d q' + w^2 q = f(t)``. With the
roots r_1, r_2 of ``r^2 + 2 d r + w^2 = 0`` and the divided differences ``D[g] = (g(r_1) - g(r_2))/(r_1 - r_2)``, the
motion from (q_0, v_0) under the load ``Re(A e^(i W t))`` is

    q(t)  = q_0 e^(r_1 t) + (v_0 - r_1 q_0) D[e^(r t)] + Re(A D[g]),      g(r) = (e^(i W t) - e^(r t))/(i W - r),

for any damping and at resonance too: where a difference would cancel, its integral form is summed, and g by its series.

Modes. A solver of dense eigenvalue problems has errors relative to the highest frequency, which of a beam is a million
times the lowest. They are refined in extended precision, T. Ogita and K. Aishima, Iterative refinement for symmetric
eigenvalue decomposition, Japan J. Indust. Appl. Math. 35 (2018), with M in place of the identity.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from vibsim.core.array_types import Complexes, Floats, Integers
from vibsim.elementary import on_arrays

SERIES_BELOW = 1.0
"""Size of z below which ``(e^z - 1)/z`` and the like are summed as series."""
TERMS = 20
"""Of these series: the first that is left out is below ``1/21! = 2e-20``."""
HIGHEST_TOLERANCE = 1e-4
"""Of the square of the highest frequency of a sparse structure, which says whether steps are stable."""
NEAR = 1.0
"""Size of ``(r_1 - r_2) t`` below which a divided difference is the integral of the derivative."""
NODES, WEIGHTS = (row.copy() for row in np.polynomial.legendre.leggauss(10))
"""For that integral: its error is far below rounding."""
REFINEMENTS = 3
"""Of modes; each squares their errors."""


@dataclass(frozen=True)
class Matrix:
    """A square matrix by its entries; two of the same entries are equal."""

    size: int
    rows: Integers = field(compare=False, repr=False)
    """Rows of the entries that are not 0, from 0, in the order of rows and then columns."""
    columns: Integers = field(compare=False, repr=False)
    entries: Floats = field(compare=False, repr=False)
    digest: str = field(init=False)
    """SHA-256 of all of them."""

    def __post_init__(self) -> None:
        digest = hashlib.sha256(str(self.size).encode())
        for array, kind in ((self.rows, "<i8"), (self.columns, "<i8"), (self.entries, "<f8")):
            digest.update(np.ascontiguousarray(array, dtype=kind).tobytes())
        object.__setattr__(self, "digest", digest.hexdigest())

    @classmethod
    def of(cls, matrix: Any) -> Matrix:
        """Return the entries of a square array, or of a sparse one of SciPy."""
        if isinstance(matrix, np.ndarray):
            rows, columns = np.nonzero(matrix)
            return cls(len(matrix), rows, columns, matrix[rows, columns].astype(float))
        found = matrix.tocsr()
        found.sum_duplicates()
        found.eliminate_zeros()
        found.sort_indices()
        found = found.tocoo()
        rows, columns = found.row.astype(np.int64), found.col.astype(np.int64)
        return cls(found.shape[0], rows, columns, found.data.astype(float))

    @cached_property
    def sparse(self) -> Any:
        """The matrix as a sparse array of SciPy, by columns."""
        from scipy.sparse import csc_array

        shape = (self.size, self.size)
        return csc_array((self.entries, (self.rows, self.columns)), shape=shape)

    @property
    def dense(self) -> Floats:
        """The matrix as an array."""
        found = np.zeros((self.size, self.size))
        found[self.rows, self.columns] = self.entries
        return found

    @property
    def asymmetry(self) -> tuple[float, int, int]:
        """The largest ``|a_ij - a_ji|`` over the largest ``|a_ij|``, and its place, from 0."""
        difference = abs(self.sparse - self.sparse.T).tocoo()
        if not difference.nnz:
            return 0.0, 0, 0
        at = int(np.argmax(difference.data))
        largest = float(difference.data[at] / np.max(np.abs(self.entries)))
        return largest, int(difference.row[at]), int(difference.col[at])


def factored(matrix: Any) -> Any:
    """Return SciPy's factors of a symmetric sparse matrix; None where it is not positive definite.

    Rows and columns are exchanged alike, so that the pivots have the signs of the eigenvalues (Sylvester's law).
    """
    from scipy.sparse.linalg import splu

    settings: dict[str, Any] = {"SymmetricMode": True}
    try:
        found = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=settings)
    except RuntimeError:
        # a pivot is exactly 0
        return None
    is_symmetric = np.array_equal(found.perm_r, found.perm_c)
    pivots = found.U.diagonal()
    largest = float(np.max(np.abs(matrix.diagonal()), initial=0.0))
    is_definite = is_symmetric and bool(
        np.all(pivots > matrix.shape[0] * 2.0**-52 * largest * 1e-8)
    )
    return found if is_definite else None


@dataclass(frozen=True)
class Modes:
    """Natural modes."""

    frequencies: Floats
    """Angular frequencies, increasing, shape (mode,); 0 of a motion as a rigid body, NaN where it is pushed away."""
    shapes: Floats
    """Shape (dof, mode), with ``x' M x = 1``."""


def all_modes(mass: Floats, stiffness: Floats) -> Modes:
    """Return every mode of a structure with these symmetric matrices, the mass positive definite."""
    from scipy.linalg import eigh

    _, start = eigh(stiffness, mass)
    m, k, x = (np.asarray(array, dtype=np.longdouble) for array in (mass, stiffness, start))
    squares = np.zeros(len(k))
    for _ in range(REFINEMENTS):
        gap, s = np.eye(len(k)) - x.T @ (m @ x), x.T @ (k @ x)
        squares = np.diag(s) / (1.0 - np.diag(gap))
        gaps = squares[None, :] - squares[:, None]
        # modes of one frequency stay as they are, but for their lengths and angles
        limit = 2.0 * (
            np.linalg.norm(np.asarray(s - np.diag(squares), dtype=float))
            + float(np.max(np.abs(squares))) * np.linalg.norm(np.asarray(gap, dtype=float))
        )
        is_distinct = np.abs(gaps) > limit
        turned = (s + squares[None, :] * gap) / np.where(is_distinct, gaps, 1.0)
        x = x + x @ np.where(is_distinct, turned, 0.5 * gap)
    order = np.argsort(squares)
    squares = np.where(np.abs(squares) < RIGID * np.max(np.abs(squares)), 0.0, squares)
    with np.errstate(invalid="ignore"):
        frequencies = np.asarray(np.sqrt(squares[order]), float)
    return Modes(frequencies, np.asarray(x[:, order], float))


RIGID = 1e-15
"""Below this part of the highest one, the square of a frequency is rounding."""


def lowest_modes(mass: Any, stiffness: Any, count: int) -> Modes:
    """Return the `count` lowest modes, of sparse matrices that are both positive definite."""
    from scipy.sparse.linalg import eigsh

    begin = np.ones(mass.shape[0])
    squares, shapes = eigsh(stiffness, k=count, M=mass, sigma=0.0, v0=begin)
    order = np.argsort(squares)
    return Modes(np.sqrt(squares[order]), shapes[:, order])


def highest_frequency(mass: Any, stiffness: Any) -> float:
    """Return the highest angular frequency to five digits, of sparse matrices, the mass positive definite."""
    from scipy.sparse.linalg import LinearOperator, eigsh

    inverse = LinearOperator(mass.shape, factored(mass).solve)
    begin = on_arrays.cos(np.arange(mass.shape[0]))
    # the highest ones lie close together: ten digits take a hundred times as long
    options = {"which": "LM", "v0": begin, "return_eigenvectors": False, "tol": HIGHEST_TOLERANCE}
    (square,) = eigsh(stiffness, k=1, M=mass, Minv=inverse, **options)
    return float(np.sqrt(max(square, 0.0)))


def _series(z: Complexes, order: int) -> Complexes:
    """Return ``sum z^k/(k + order)!``."""
    total, term = np.zeros_like(z), np.ones_like(z)
    for k in range(order):
        term = term / (k + 1.0)
    for k in range(TERMS):
        total = total + term
        term = term * z / (k + order + 1.0)
    return total


def _driven(r: Complexes, drive: complex, t: Complexes) -> tuple[Complexes, Complexes]:
    """Return ``g(r) = (e^(i W t) - e^(r t))/(i W - r)`` with ``drive = i W``, and its derivative by r."""
    z = (drive - r) * t
    decay, swing = on_arrays.complex_exp(r * t), on_arrays.complex_exp(drive * t)
    is_small = np.abs(z) < SERIES_BELOW
    safe, small = np.where(is_small, 1.0, z), np.where(is_small, z, 0.0)
    first = np.where(is_small, decay * _series(small, 1), (swing - decay) / safe)
    far = ((swing - decay) / safe - decay) / safe
    second = np.where(is_small, decay * _series(small, 2), far)
    return t * first, t * t * second


def mode_motion(
    t: Floats,
    frequency: Floats,
    decay: Floats,
    start: tuple[Floats, Floats],
    loads: list[tuple[Complexes, float]],
) -> tuple[Floats, Floats]:
    """Return positions and velocities of modes, shape (mode, time).

    Parameters
    ----------
    t
        Times, shape (time,).
    frequency, decay
        w and d of every mode, shape (mode,).
    start
        Initial positions and velocities of the modes.
    loads
        Pairs of A, shape (mode,), and W.
    """
    w, d = frequency[:, None].astype(complex), decay[:, None].astype(complex)
    s = np.sqrt(d * d - w * w)
    # the two real roots of strong damping without cancellation
    second = -d - s
    is_real = (np.abs(d) > np.abs(w)) & (second != 0.0)
    first = np.where(is_real, w * w / np.where(is_real, second, 1.0), -d + s)
    difference, time = first - second, t[None, :].astype(complex)
    is_near = np.abs(difference) * np.abs(time) < NEAR
    gap = np.where(difference == 0.0, 1.0, difference)
    middle = 0.5 * (first + second)
    # those that are near lie within so small a distance that the other ones may be put in the middle
    half = np.where(is_near, 0.5 * difference, 0.0)

    def divided(at_first: Complexes, at_second: Complexes, slope: Any) -> Complexes:
        found: Complexes = (at_first - at_second) / gap
        if is_near.any():
            near = np.zeros_like(time)
            for x, weight in zip(NODES, WEIGHTS, strict=True):
                near = near + 0.5 * weight * slope(middle + x * half)
            found = np.where(is_near, near, found)
        return found

    def decaying(r: Complexes) -> Complexes:
        found: Complexes = on_arrays.complex_exp(r * time)
        return found

    one = decaying(first)
    both = divided(one, decaying(second), lambda r: time * decaying(r))
    q_0, v_0 = (row[:, None] for row in start)
    rest = v_0 - first * q_0
    q, v = q_0 * one + rest * both, v_0 * one + second * rest * both
    for amplitude, angular in loads:
        drive = 1j * angular
        pushed, _ = _driven(first, drive, time)
        other, _ = _driven(second, drive, time)
        answer = divided(pushed, other, lambda r, drive=drive: _driven(r, drive, time)[1])
        q = q + (amplitude[:, None] * answer).real
        v = v + (amplitude[:, None] * (pushed + second * answer)).real
    return np.asarray(q.real), np.asarray(v.real)
