"""Read Records from netCDF files, whole or by ranges of members; the seal is checked before the library sees a byte.

The files of one level, its shards, are read as if they were one file.
"""

from __future__ import annotations

import json
from bisect import bisect_right
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from vibsim.core import netcdf
from vibsim.core.errors import DamagedFileError
from vibsim.core.record import Attribute, Record, Variable
from vibsim.store import seal


def read(path: Path, *, digest: str | None = None) -> Record:
    """Read a file that `vibsim.store.write` wrote.

    Parameters
    ----------
    path
        The file.
    digest
        Expected digest of the job that made the file; None accepts any.

    Raises
    ------
    DamagedFileError
        Where a single bit differs from what was written, or the file is not vibsim's.
    StaleFileError
        Where the file is intact but another job made it.
    """
    seal.check(path)
    with _opened(path, digest) as dataset, _naming(path):
        return _record(dataset)


def check(path: Path, *, digest: str | None = None) -> None:
    """Raise the same exceptions as `read`, without loading the file into memory."""
    seal.check(path)
    with _opened(path, digest):
        pass


def read_provenance(path: Path) -> dict[str, Any]:
    """Return the provenance of a file: the settings and the versions that its job used.

    Raises
    ------
    DamagedFileError
        Where a single bit differs from what was written, or the file has no provenance.
    """
    seal.check(path)
    try:
        with netcdf.opened(path) as dataset:
            provenance = json.loads(dataset.getncattr("provenance"))
    except (OSError, AttributeError, ValueError, RecursionError):
        provenance = None
    if not isinstance(provenance, dict) or not isinstance(provenance.get("experiment"), dict):
        raise DamagedFileError(path, "it does not say what it was made from")
    return provenance


@contextmanager
def _opened(path: Path, digest: str | None) -> Iterator[Any]:
    """Open a file whose seal was checked; raises the same exceptions as `read`."""
    with _naming(path):
        dataset = netcdf.opened(path)
    try:
        with _naming(path):
            dataset.set_auto_maskandscale(False)
            dataset.set_auto_chartostring(False)
            form, job = (getattr(dataset, name, None) for name in ("vibsim_format", "digest"))
            seal.check_job(path, form, str(job), digest)
        yield dataset
    finally:
        dataset.close()


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Turn errors of the netCDF library into a DamagedFileError that names the file."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        raise DamagedFileError(path, f"the netCDF library cannot read it: {error}") from error


def _record(
    dataset: Any, cases: slice = slice(None), names: Collection[str] | None = None
) -> Record:
    """Return the Record of the members `cases` of an open file, with the data variables `names`, or all for None."""
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
    """Return the names of the auxiliary coordinates: those that are not the coordinate of their own dimension."""
    names = set(getattr(dataset, "coordinates", "").split())
    for _, variable, _ in netcdf.variables(dataset):
        names.update(getattr(variable, "coordinates", "").split())
    return names


def _read_variable(variable: Any, cases: slice, group: str) -> Variable:
    attrs = {key: _unpack(variable.getncattr(key)) for key in variable.ncattrs()}
    attrs.pop("coordinates", None)
    dims = variable.dimensions
    index = tuple(cases if dim == "case" else slice(None) for dim in dims)
    values = np.asarray(variable[index] if dims else variable[...])
    if attrs.pop("_Encoding", None):
        # the width of the string type must not depend on the members that are read
        width = values.shape[-1]
        joined = np.ascontiguousarray(values).view(f"S{width}").reshape(values.shape[:-1])
        dims, values = dims[:-1], np.char.decode(joined, "utf-8").astype(f"U{width}")
    return Variable(tuple(dims), values, attrs, group)


def _unpack(value: Any) -> Attribute:
    if isinstance(value, np.ndarray):
        numbers: list[Any] = value.tolist()
        return numbers
    plain: Attribute = value.item() if isinstance(value, np.generic) else value
    return plain


class Level:
    """The files of a level, in the order of their members; at most one is open at a time."""

    def __init__(self) -> None:
        self._files: list[tuple[Path, str | None]] = []
        self._borders = [0]
        """First member of each file, and finally the total number of members."""
        self._open = ExitStack()
        self._number = -1
        self._dataset: Any = None

    def add(self, path: Path, *, digest: str | None = None) -> None:
        """Check a file, whose members follow those of the last one; arguments and exceptions as for `read`."""
        seal.check(path)
        self._files.append((path, digest))
        dataset = self._dataset_of(len(self._files) - 1)
        if "case" not in dataset.dimensions:
            raise DamagedFileError(path, "it has no members")
        self._borders.append(self._borders[-1] + len(dataset.dimensions["case"]))

    @property
    def cases(self) -> int:
        """Number of members."""
        return self._borders[-1]

    def read(
        self, start: int = 0, stop: int | None = None, names: Collection[str] | None = None
    ) -> Record:
        """Return members start..stop-1, all by default, with the data variables `names` and all coordinates."""
        last = self.cases if stop is None else stop
        first, final = self._file_of(start), self._file_of(max(start, last - 1))
        parts = []
        for number in range(first, final + 1):
            border = self._borders[number]
            end = min(last, self._borders[number + 1])
            cases = slice(max(start, border) - border, end - border)
            with _naming(self._files[number][0]):
                parts.append(_record(self._dataset_of(number), cases, names))
        return join(parts)

    def _file_of(self, member: int) -> int:
        return min(bisect_right(self._borders, member), len(self._files)) - 1

    def _dataset_of(self, number: int) -> Any:
        if number != self._number:
            self.close()
            self._dataset = self._open.enter_context(_opened(*self._files[number]))
            self._number = number
        return self._dataset

    def close(self) -> None:
        """Close the file that is open."""
        self._open.close()
        self._number, self._dataset = -1, None


@contextmanager
def open_level(files: Iterable[tuple[Path, str | None]]) -> Iterator[Level]:
    """Check and open the files of a level.

    Parameters
    ----------
    files
        Path and digest of each file, in the order of their members; a level may be a single file.

    Raises
    ------
    DamagedFileError, StaleFileError
        Where a file cannot be read, or another job made it.
    """
    with closing(Level()) as level:
        for path, digest in files:
            level.add(path, digest=digest)
        yield level


def join(records: Sequence[Record]) -> Record:
    """Join the shards of a level, given in the order of their members, along ``case``.

    Raises
    ------
    ValueError
        Where the shards do not belong together: their variables, schemes or times differ.
    """
    if len(records) == 1:
        return records[0]
    coords = _join([record.coords for record in records])
    variables = _join([record.variables for record in records])
    return Record(coords, variables, records[0].attrs)


def _join(tables: Sequence[Mapping[str, Variable]]) -> dict[str, Variable]:
    if any(list(table) != list(tables[0]) for table in tables):
        raise ValueError("shards of one level hold different variables")
    return {name: _join_one(name, [table[name] for table in tables]) for name in tables[0]}


def _join_one(name: str, parts: Sequence[Variable]) -> Variable:
    first = parts[0]
    if any(part.dims != first.dims for part in parts):
        raise ValueError(f"{name}: shards of one level have different dimensions")
    if "case" in first.dims:
        values = np.concatenate([part.values for part in parts], axis=first.dims.index("case"))
        return Variable(first.dims, values, first.attrs)
    if any(not np.array_equal(part.values, first.values) for part in parts):
        raise ValueError(f"{name}: shards of one level differ where they must agree")
    return first
