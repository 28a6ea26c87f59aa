"""Read matrices and vectors from Matrix Market, NumPy or CSV files.

A CSV file contains rows of numbers without a header or, with the header ``row,column,value``, the nonzero entries with
indices from 1; those of a symmetric matrix on both sides of the diagonal.
"""

from __future__ import annotations

import hashlib
import io
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np

from vibsim.core import guarded
from vibsim.core.array_types import Floats
from vibsim.experiment.tables import csv_text
from vibsim.experiment.tables.content import TableError, bytes_of
from vibsim.models.shared.matrices import Matrix
from vibsim.models.structure import MOST_DOFS

ENDINGS = (".mtx", ".npy", ".csv")
SPARSE_HEADER = "row,column,value"
MOST_DENSE = 2048  # largest number of rows of a dense matrix


def read(path: Path) -> tuple[Any, str]:
    """Return the matrix or vector in the file at `path`, and the SHA-256 of its bytes.

    It is a one- or two-dimensional array, or a sparse array of SciPy. Raises `TableError` for anything else.
    """
    content = bytes_of(path, ENDINGS, "matrix")
    of_kind = {".mtx": _from_matrix_market, ".npy": _from_numpy, ".csv": _from_text}
    found = of_kind[path.suffix.lower()](content)
    if np.iscomplexobj(found):
        raise TableError("must hold real numbers, holds complex ones")
    numbers = found if isinstance(found, np.ndarray) else found.data
    if not np.isfinite(numbers).all():
        raise TableError("must hold finite numbers")
    return found, hashlib.sha256(content).hexdigest()


def _check_counts(*counts: int) -> None:
    if max(counts) > MOST_DOFS:
        rule = f"must not have more than {MOST_DOFS} rows and columns, has {max(counts)}"
        raise TableError(rule)


def _from_matrix_market(content: bytes) -> Any:
    from scipy.io import mminfo, mmread

    try:
        rows, columns, _, form, field, _ = mminfo(io.BytesIO(content))
        if field == "pattern":
            raise TableError("holds only the pattern of the matrix, without numbers")
        _check_counts(rows, columns)  # before anything of that size is allocated
        if form == "array" and rows * columns > MOST_DENSE**2:
            raise TableError(
                f"a matrix of more than {MOST_DENSE} rows must be in coordinate format"
            )
        if problem := guarded.problem(lambda: mmread(io.BytesIO(content)), len(content)):
            raise ValueError(problem)
        found = mmread(io.BytesIO(content), spmatrix=False)
    except TableError:
        raise
    except (ValueError, TypeError, OverflowError, RuntimeError, EOFError) as error:
        raise TableError(f"is not a Matrix Market file ({_first_line(error)})") from None
    return np.asarray(found, dtype=float) if isinstance(found, np.ndarray) else found


def _from_numpy(content: bytes) -> Any:
    try:
        found = np.load(io.BytesIO(content), allow_pickle=False)
    except (ValueError, OSError, EOFError, MemoryError, SyntaxError, TokenError) as error:
        raise TableError(f"is not a NumPy array ({_first_line(error)})") from None
    is_array = isinstance(found, np.ndarray)
    if not is_array or found.dtype.kind not in "fiuc" or found.ndim not in (1, 2):
        raise TableError("must hold one array of numbers, of one or two dimensions")
    _check_counts(*found.shape, 1)
    return found if found.dtype.kind == "c" else found.astype(float)


def _from_text(content: bytes) -> Any:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise TableError("must be UTF-8 text") from None
    lines = [(i, line.strip()) for i, line in enumerate(text.splitlines(), 1)]
    lines = [(i, line) for i, line in lines if line and not line.startswith("#")]
    if not lines:
        raise TableError("holds no numbers")
    is_sparse = lines[0][1].replace(" ", "").lower() == SPARSE_HEADER
    rows, width = [], 0
    for i, line in lines[is_sparse:]:
        try:
            row = [float(cell) for cell in line.rstrip(",").split(",")]
        except ValueError:
            shown = f"'{line[:40]}'" if csv_text.is_shown(line[:40]) else "the line"
            hint = f"or begin with the line {SPARSE_HEADER}"
            rule = f"line {i}: {shown} must hold numbers between commas"
            raise TableError(rule, hint) from None
        width = width or len(row)
        if len(row) != width:
            raise TableError(f"line {i}: has {len(row)} numbers, the lines before have {width}")
        rows.append(row)
    _check_counts(0 if is_sparse else len(rows), width)
    if is_sparse:
        return _from_entries(np.array(rows).reshape(-1, 3) if width in (0, 3) else None)
    found = np.array(rows)
    return found[:, 0] if width == 1 and len(rows) > 1 else found


def _from_entries(entries: Floats | None) -> Any:
    """Return the sparse matrix with `entries` (row, column, value), shape (entry, 3)."""
    from scipy.sparse import coo_array

    if entries is None or not len(entries):
        raise TableError(f"must have three numbers on each line below {SPARSE_HEADER}")
    places = entries[:, :2]
    if not np.all((places >= 1.0) & (places <= MOST_DOFS) & (places == np.floor(places))):
        raise TableError(f"rows and columns must be whole numbers from 1 to {MOST_DOFS}")
    rows, columns = (places - 1.0).astype(np.int64).T
    if len(np.unique(rows * MOST_DOFS + columns)) < len(rows):
        raise TableError("an entry must not be given twice")
    size = int(max(rows.max(), columns.max())) + 1
    return coo_array((entries[:, 2], (rows, columns)), shape=(size, size))


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:80]


def square(found: Any) -> Matrix:
    """Return a square matrix; for a single row or column the diagonal matrix. Raises `TableError` if not square."""
    if isinstance(found, np.ndarray) and (found.ndim == 1 or 1 in found.shape):
        found = np.diag(np.ravel(found))
    rows, columns = found.shape
    if rows != columns:
        raise TableError(f"must be square, has {rows} rows and {columns} columns")
    return Matrix.of(found)


def vector(found: Any) -> Floats:
    """Return a single row or column as a vector; raise `TableError` for anything else."""
    dense = found if isinstance(found, np.ndarray) else found.toarray()
    if dense.ndim == 2 and 1 not in dense.shape:
        raise TableError(f"must be one column, has the shape {dense.shape[0]} x {dense.shape[1]}")
    return np.ravel(dense)
