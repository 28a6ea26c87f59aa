"""The one door to the netCDF library, which nothing else imports; it is imported when a file is opened.

Behind it stand the files that vibsim writes and reads back (`vibsim.store`), and tables that a user brings along
(`vibsim.experiment.tables.file`).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from vibsim.core import guarded


def create(path: Path) -> Any:
    """Return a new dataset in the file `path`, to be closed by who asked for it."""
    from netCDF4 import Dataset

    return Dataset(path, "w", format="NETCDF4")


def is_from_library(error: Exception) -> bool:
    """Tell whether an exception is one of the library, which keeps the system's reason to itself."""
    return "NetCDF: " in str(error)


def opened(path: Path) -> Any:
    """Return the dataset of a file that is to be read; OSError where the library cannot read it."""
    from netCDF4 import Dataset

    return Dataset(path, "r")


def variables(dataset: Any) -> Iterator[tuple[str, Any, str]]:
    """Yield every variable of a file with its name and its group, those of the root first."""
    for name, variable in dataset.variables.items():
        yield name, variable, ""
    for group, inner in dataset.groups.items():
        for name, variable in inner.variables.items():
            yield name, variable, group


def foreign(source: Path | bytes) -> Any:
    """Return the dataset of a user's file, or of its bytes; OSError where the library cannot read it."""
    from netCDF4 import Dataset

    def opened() -> Any:
        if isinstance(source, bytes):
            return Dataset("table.nc", memory=source)
        return Dataset(source, "r")

    def look() -> None:
        with opened() as dataset:
            for _, variable, _ in variables(dataset):
                variable.ncattrs()

    size = len(source) if isinstance(source, bytes) else source.stat().st_size
    if problem := guarded.problem(look, size):
        raise OSError(problem)
    return opened()
