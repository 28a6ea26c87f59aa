"""Small matrices, many at once: differences of levels, packed symmetric matrices, inverses with reproducible bits.

A *packed* symmetric matrix is the list of its entries (i, j) with i <= j, row by row. A *form* is a packed matrix with
doubled off-diagonal entries, so ``tr(M G)`` is the dot product of the form of M and the packed G.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from vibsim.core.array_types import Floats, Integers
from vibsim.elementary import on_arrays

LEAST_PIVOT = 1e-16
"""Lower limit of pivots, of matrices with unit diagonal: about the rounding of a pivot.

Pivots are about the square of `MISFIT`, 1e-7. Only where two powers of one shape cancel in the last row are they
smaller (1e-12 for twelve halved levels), and nothing keeps them positive there.
"""


def level_differences(levels: Floats) -> Floats:
    """Return each level minus the next finer one, along the last axis."""
    return np.asarray(levels[..., :-1] - levels[..., 1:])


def noise_of_rows(variance: Floats) -> Floats:
    """Return the covariance of the differences of levels with independent noise, shape (..., row, row)."""
    count = variance.shape[-1] - 1
    covariance = np.zeros((*variance.shape[:-1], count, count))
    index = np.arange(count)
    covariance[..., index, index] = variance[..., :-1] + variance[..., 1:]
    shared = -variance[..., 1:-1]
    covariance[..., index[1:], index[:-1]] = covariance[..., index[:-1], index[1:]] = shared
    return covariance


def outer(a: Floats, b: Floats) -> Floats:
    """Return the outer products of the vectors along the last axis."""
    return np.asarray(a[..., :, None] * b[..., None, :])


def packed(matrices: Floats) -> Floats:
    """Return the entries (i, j), i <= j, of symmetric matrices, shape (..., packed)."""
    i, j = _upper(matrices.shape[-1])
    return np.ascontiguousarray(matrices[..., i, j])


@lru_cache
def _upper(size: int) -> tuple[Integers, Integers]:
    i, j = np.triu_indices(size)
    return i, j


def form(matrices: Floats) -> Floats:
    """Return the forms of symmetric matrices M: their dot product with a packed G is ``tr(M G)``."""
    i, j = _upper(matrices.shape[-1])
    return np.where(i == j, 1.0, 2.0) * packed(matrices)


def matvec(matrices: Floats, vectors: Floats) -> Floats:
    """Return matrix-vector products, shape (..., i), summed in the order of the columns."""
    result = matrices[..., 0] * vectors[..., None, 0]
    for k in range(1, vectors.shape[-1]):
        result = result + matrices[..., k] * vectors[..., None, k]
    return np.asarray(result)


def inverse(covariance: Floats) -> tuple[Floats, Floats]:
    """Return inverses and log determinants of covariances, without LAPACK, so with the same bits on every machine."""
    # Cholesky factorisation L L^T of the matrices, scaled to unit diagonals. Each a[i, j] is an array of all matrices.
    scale = np.sqrt(np.moveaxis(np.diagonal(covariance, axis1=-2, axis2=-1), -1, 0))
    scales = outer(np.moveaxis(scale, 0, -1), np.moveaxis(scale, 0, -1))
    a = np.ascontiguousarray(np.moveaxis(covariance / scales, (-2, -1), (0, 1)))
    w = len(a)
    # row i of L^-1 is (e_i - sum_j L_ij row_j)/L_ii
    lower, inverted = np.zeros_like(a), np.zeros_like(a)
    log_det = np.zeros_like(scale[0])
    for i in range(w):
        inverted[i, i] = 1.0
        pivot = a[i, i]
        for j in range(i):
            entry = a[i, j]
            for k in range(j):
                entry = entry - lower[i, k] * lower[j, k]
            lower[i, j] = entry / lower[j, j]
            pivot = pivot - lower[i, j] ** 2
            inverted[i, : j + 1] -= lower[i, j] * inverted[j, : j + 1]
        lower[i, i] = np.sqrt(np.maximum(pivot, LEAST_PIVOT))
        inverted[i, : i + 1] /= lower[i, i]
        log_det = log_det + 2.0 * on_arrays.log(lower[i, i] * scale[i])
    precision = np.zeros_like(a)
    for i in range(w):
        row = inverted[i, : i + 1]
        precision[: i + 1, : i + 1] += row[:, None] * row[None]
    return np.moveaxis(precision, (0, 1), (-2, -1)) / scales, log_det
