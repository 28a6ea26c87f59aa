"""Records from netCDF files: checked before the library is given a single bit, read whole or by ranges of members."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core import netcdf
from vibsim.core.errors import DamagedFileError
from vibsim.core.record import Attribute, Record, Variable
from vibsim.store import seal


def read(path: Path, *, digest: str | None = None) -> Record:
    """Read what `vibsim.store.write` wrote.

    Parameters
    ----------
    path
        The file.
    digest
        Digest of the job whose result is wanted; None takes any.

    Raises
    ------
    DamagedFileError
        When a single bit differs from what was written, or when no vibsim wrote it.
    StaleFileError
        When the file is whole but another job's.
    """
    seal.check(path)
    with opened(path, digest) as dataset, naming(path):
        return read_record(dataset)


def check(path: Path, *, digest: str | None = None) -> None:
    """Raise what `read` would, without keeping anything of the file in memory."""
    seal.check(path)
    with opened(path, digest):
        pass


@contextmanager
def opened(path: Path, digest: str | None) -> Iterator[Any]:
    """Open a file whose seal was checked.

    Raises
    ------
    DamagedFileError
        When the netCDF library cannot read it.
    StaleFileError
        When it is another job's.
    """
    with naming(path):
        dataset = netcdf.opened(path)
    try:
        with naming(path):
            dataset.set_auto_maskandscale(False)
            dataset.set_auto_chartostring(False)
            form, job = (getattr(dataset, name, None) for name in ("vibsim_format", "digest"))
            seal.check_job(path, form, str(job), digest)
        yield dataset
    finally:
        dataset.close()


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Turn errors of the netCDF library into one that names the file."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        raise DamagedFileError(path, f"the netCDF library cannot read it: {error}") from error


def read_record(
    dataset: Any, cases: slice = slice(None), names: Collection[str] | None = None
) -> Record:
    """Return what an opened file holds.

    Parameters
    ----------
    dataset
        See `opened`.
    cases
        Members wanted.
    names
        Variables wanted, None for all; coordinates are always there.
    """
    tables: tuple[dict[str, Variable], dict[str, Variable]] = ({}, {})
    auxiliary = _auxiliary(dataset)
    for name, variable, group in netcdf.variables(dataset):
        is_data = name not in auxiliary and name not in dataset.dimensions
        if not is_data or names is None or name in names:
            tables[is_data][name] = _read_variable(variable, cases, group)
    attrs = {key: _unpack(dataset.getncattr(key)) for key in dataset.ncattrs()}
    attrs.pop("coordinates", None)
    return Record(tables[False], tables[True], attrs)


def _auxiliary(dataset: Any) -> set[str]:
    """Name the coordinates that are not those of their own dimension."""
    found = set(getattr(dataset, "coordinates", "").split())
    for _, variable, _ in netcdf.variables(dataset):
        found.update(getattr(variable, "coordinates", "").split())
    return found


def _read_variable(variable: Any, cases: slice, group: str) -> Variable:
    attrs = {key: _unpack(variable.getncattr(key)) for key in variable.ncattrs()}
    attrs.pop("coordinates", None)
    dims = variable.dimensions
    wanted = tuple(cases if dim == "case" else slice(None) for dim in dims)
    values = np.asarray(variable[wanted] if dims else variable[...])
    if attrs.pop("_Encoding", None):
        dims, values = dims[:-1], _texts(values)
    return Variable(tuple(dims), values, attrs, group)


def _unpack(value: Any) -> Attribute:
    if isinstance(value, np.ndarray):
        numbers: list[Any] = value.tolist()
        return numbers
    plain: Attribute = value.item() if isinstance(value, np.generic) else value
    return plain


def _texts(values: NDArray[Any]) -> NDArray[Any]:
    """Return the texts in a type that does not depend on which of them are read."""
    width = values.shape[-1]
    joined = np.ascontiguousarray(values).view(f"S{width}").reshape(values.shape[:-1])
    return np.char.decode(joined, "utf-8").astype(f"U{width}")
