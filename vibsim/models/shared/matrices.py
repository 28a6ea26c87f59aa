r"""Matrices of a linear structure, its natural modes, and the motion of one mode under constant and harmonic loads.

A mode of shape x, ``K x = w^2 M x`` and ``x^T M x = 1``, satisfies ``q'' + 2 d q' + w^2 q = f(t)``. With the roots r_1,
r_2 of ``r^2 + 2 d r + w^2 = 0`` and the divided differences ``D[g] = (g(r_1) - g(r_2))/(r_1 - r_2)``, the motion from
(q_0, v_0) under the load ``Re(A e^(i W t))`` is

    q(t)  = q_0 e^(r_1 t) + (v_0 - r_1 q_0) D[e^(r t)] + Re(A D[g]),      g(r) = (e^(i W t) - e^(r t))/(i W - r),

for any damping, including resonance: where a difference would cancel, D is computed from its integral form and g from
its series.

Modes. A solver of dense eigenvalue problems has errors relative to the highest frequency, which for a beam is a million
times the lowest. The modes are refined in extended precision, T. Ogita and K. Aishima, Iterative refinement for
symmetric eigenvalue decomposition, Japan J. Indust. Appl. Math. 35 (2018), with M in place of the identity.
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
"""Values of |z| below which ``(e^z - 1)/z`` and similar functions are summed as series."""
TERMS = 20
"""Number of terms of these series: the first omitted term is below ``1/21! = 2e-20``."""
HIGHEST_TOLERANCE = 1e-4
"""Relative tolerance of the square of the highest frequency of a sparse structure, which decides on stability."""
NEAR = 1.0
"""Values of ``|r_1 - r_2| t`` below which a divided difference is computed as the integral of the derivative."""
NODES, WEIGHTS = (row.copy() for row in np.polynomial.legendre.leggauss(10))
"""Gauss quadrature for that integral; its error is far below rounding."""
REFINEMENTS = 3
"""Refinement iterations of modes; each squares the error."""


@dataclass(frozen=True)
class Matrix:
    """A square matrix in coordinate format; equal entries make equal objects."""

    size: int
    rows: Integers = field(compare=False, repr=False)
    """Row indices of the nonzero entries, sorted by row and then column."""
    columns: Integers = field(compare=False, repr=False)
    entries: Floats = field(compare=False, repr=False)
    digest: str = field(init=False)
    """SHA-256 of size, indices and entries."""

    def __post_init__(self) -> None:
        digest = hashlib.sha256(str(self.size).encode())
        for array, kind in ((self.rows, "<i8"), (self.columns, "<i8"), (self.entries, "<f8")):
            digest.update(np.ascontiguousarray(array, dtype=kind).tobytes())
        object.__setattr__(self, "digest", digest.hexdigest())

    @classmethod
    def of(cls, matrix: Any) -> Matrix:
        """Return the matrix of a square array or a sparse SciPy array."""
        if isinstance(matrix, np.ndarray):
            rows, columns = np.nonzero(matrix)
            return cls(len(matrix), rows, columns, matrix[rows, columns].astype(float))
        sparse = matrix.tocsr()
        sparse.sum_duplicates()
        sparse.eliminate_zeros()
        sparse.sort_indices()
        sparse = sparse.tocoo()
        rows, columns = sparse.row.astype(np.int64), sparse.col.astype(np.int64)
        return cls(sparse.shape[0], rows, columns, sparse.data.astype(float))

    @cached_property
    def sparse(self) -> Any:
        """The matrix as a SciPy array in CSC format."""
        from scipy.sparse import csc_array

        shape = (self.size, self.size)
        return csc_array((self.entries, (self.rows, self.columns)), shape=shape)

    @property
    def dense(self) -> Floats:
        """The matrix as an array."""
        dense = np.zeros((self.size, self.size))
        dense[self.rows, self.columns] = self.entries
        return dense

    @property
    def asymmetry(self) -> tuple[float, int, int]:
        """The largest ``|a_ij - a_ji|`` over the largest ``|a_ij|``, and its indices."""
        difference = abs(self.sparse - self.sparse.T).tocoo()
        if not difference.nnz:
            return 0.0, 0, 0
        at = int(np.argmax(difference.data))
        largest = float(difference.data[at] / np.max(np.abs(self.entries)))
        return largest, int(difference.row[at]), int(difference.col[at])


def factored(matrix: Any) -> Any:
    """Return SciPy's LU factors of a symmetric sparse matrix; None if it is not positive definite.

    Rows and columns are permuted alike, so the pivots have the signs of the eigenvalues (Sylvester's law of inertia).
    """
    from scipy.sparse.linalg import splu

    settings: dict[str, Any] = {"SymmetricMode": True}
    try:
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=settings)
    except RuntimeError:
        # a pivot is exactly 0
        return None
    is_symmetric = np.array_equal(factors.perm_r, factors.perm_c)
    pivots = factors.U.diagonal()
    largest = float(np.max(np.abs(matrix.diagonal()), initial=0.0))
    is_definite = is_symmetric and bool(
        np.all(pivots > matrix.shape[0] * 2.0**-52 * largest * 1e-8)
    )
    return factors if is_definite else None


@dataclass(frozen=True)
class Modes:
    """Natural modes."""

    frequencies: Floats
    """Angular frequencies, increasing, shape (mode,); 0 for rigid-body modes, NaN for unstable ones."""
    shapes: Floats
    """Mode shapes, shape (dof, mode), with ``x^T M x = 1``."""


def all_modes(mass: Floats, stiffness: Floats) -> Modes:
    """Return all modes for symmetric matrices, the mass positive definite."""
    from scipy.linalg import eigh

    _, start = eigh(stiffness, mass)
    m, k, x = (np.asarray(array, dtype=np.longdouble) for array in (mass, stiffness, start))
    squares = np.zeros(len(k))
    for _ in range(REFINEMENTS):
        gap, s = np.eye(len(k)) - x.T @ (m @ x), x.T @ (k @ x)
        squares = np.diag(s) / (1.0 - np.diag(gap))
        gaps = squares[None, :] - squares[:, None]
        # modes of equal frequency are only made orthonormal
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
"""Squares of frequencies below this fraction of the highest square are rounding errors."""


def lowest_modes(mass: Any, stiffness: Any, count: int) -> Modes:
    """Return the `count` lowest modes for sparse, positive definite matrices."""
    from scipy.sparse.linalg import eigsh

    begin = np.ones(mass.shape[0])
    squares, shapes = eigsh(stiffness, k=count, M=mass, sigma=0.0, v0=begin)
    order = np.argsort(squares)
    return Modes(np.sqrt(squares[order]), shapes[:, order])


def highest_frequency(mass: Any, stiffness: Any) -> float:
    """Return the highest angular frequency to five digits for sparse matrices, the mass positive definite."""
    from scipy.sparse.linalg import LinearOperator, eigsh

    inverse = LinearOperator(mass.shape, factored(mass).solve)
    begin = on_arrays.cos(np.arange(mass.shape[0]))
    # the highest frequencies are close together: ten digits would take a hundred times as long
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
    """Return ``g(r) = (e^(i W t) - e^(r t))/(i W - r)`` with ``drive = i W``, and its derivative with respect to r."""
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
        Pairs of amplitude A, shape (mode,), and angular frequency W.
    """
    w, d = frequency[:, None].astype(complex), decay[:, None].astype(complex)
    s = np.sqrt(d * d - w * w)
    # real roots (strong damping) without cancellation
    second = -d - s
    is_real = (np.abs(d) > np.abs(w)) & (second != 0.0)
    first = np.where(is_real, w * w / np.where(is_real, second, 1.0), -d + s)
    difference, time = first - second, t[None, :].astype(complex)
    is_near = np.abs(difference) * np.abs(time) < NEAR
    gap = np.where(difference == 0.0, 1.0, difference)
    middle = 0.5 * (first + second)
    # the integral is not used for roots that are far apart: 0 keeps their exponentials finite
    half = np.where(is_near, 0.5 * difference, 0.0)

    def divided(at_first: Complexes, at_second: Complexes, slope: Any) -> Complexes:
        quotient: Complexes = (at_first - at_second) / gap
        if is_near.any():
            near = np.zeros_like(time)
            for x, weight in zip(NODES, WEIGHTS, strict=True):
                near = near + 0.5 * weight * slope(middle + x * half)
            quotient = np.where(is_near, near, quotient)
        return quotient

    def decaying(r: Complexes) -> Complexes:
        value: Complexes = on_arrays.complex_exp(r * time)
        return value

    e_1 = decaying(first)
    free = divided(e_1, decaying(second), lambda r: time * decaying(r))
    q_0, v_0 = (row[:, None] for row in start)
    excess = v_0 - first * q_0
    q, v = q_0 * e_1 + excess * free, v_0 * e_1 + second * excess * free
    for amplitude, angular in loads:
        drive = 1j * angular
        g_1, _ = _driven(first, drive, time)
        g_2, _ = _driven(second, drive, time)
        response = divided(g_1, g_2, lambda r, drive=drive: _driven(r, drive, time)[1])
        q = q + (amplitude[:, None] * response).real
        v = v + (amplitude[:, None] * (g_1 + second * response)).real
    return np.asarray(q.real), np.asarray(v.real)
