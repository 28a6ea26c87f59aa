"""The only module that imports the netCDF library, and only when a file is opened.

It serves the files of vibsim itself (`vibsim.store`) and the tables of users (`vibsim.experiment.tables.file`).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from vibsim.core import guarded


def create(path: Path) -> Any:
    """Create the file `path` and return its dataset, which the caller closes."""
    from netCDF4 import Dataset

    return Dataset(path, "w", format="NETCDF4")


def is_from_library(error: Exception) -> bool:
    """Tell whether an exception comes from the netCDF library, which hides the system's reason."""
    return "NetCDF: " in str(error)


def opened(path: Path) -> Any:
    """Open a file of vibsim for reading; raises OSError where the library cannot read it."""
    from netCDF4 import Dataset

    return Dataset(path, "r")


def variables(dataset: Any) -> Iterator[tuple[str, Any, str]]:
    """Yield name, variable and group of every variable of a file, the root group first."""
    for name, variable in dataset.variables.items():
        yield name, variable, ""
    for group, inner in dataset.groups.items():
        for name, variable in inner.variables.items():
            yield name, variable, group


def foreign(source: Path | bytes) -> Any:
    """Open an untrusted file, or its bytes, for reading; raises OSError where the library cannot read it."""
    from netCDF4 import Dataset

    def opened() -> Any:
        if isinstance(source, bytes):
            return Dataset("table.nc", memory=source)
        return Dataset(source, "r")

    def try_to_read() -> None:
        with opened() as dataset:
            for _, variable, _ in variables(dataset):
                variable.ncattrs()

    size = len(source) if isinstance(source, bytes) else source.stat().st_size
    if problem := guarded.problem(try_to_read, size):
        raise OSError(problem)
    return opened()
