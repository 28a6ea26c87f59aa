"""The one door to the netCDF library, which nothing else imports; it is imported when a file is opened.

Behind it stand the files that vibsim writes and reads back (`vibsim.store`), and tables that a user brings along
(`vibsim.spec.table_file`).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any


def create(path: Path) -> Any:
    """Return a new dataset in the file `path`, to be closed by who asked for it."""
    from netCDF4 import Dataset

    return Dataset(path, "w", format="NETCDF4")


def opened(path: Path) -> Any:
    """Return the dataset of a file that is to be read.

    Raises
    ------
    OSError
        Where the library cannot read it.
    """
    from netCDF4 import Dataset

    return Dataset(path, "r")


def in_memory(content: bytes) -> Any:
    """Return the dataset that the bytes of a file are.

    Raises
    ------
    OSError
        Where the library cannot read it.
    """
    from netCDF4 import Dataset

    return Dataset("table.nc", memory=content)
