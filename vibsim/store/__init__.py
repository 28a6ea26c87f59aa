"""Write and read result files: a file is read exactly as it was written, or not at all.

Every file is written in one step, and holds a digest of its own bytes and the digest of the job that made it. The
netCDF library is imported only when a netCDF file is opened (`vibsim.core.netcdf`); reading a summary does not even
import numpy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import lazy

if TYPE_CHECKING:
    from vibsim.store.atomic import replacing, write_bytes, write_text
    from vibsim.store.reading import check, join, open_level, read
    from vibsim.store.summary import read_json, write_json
    from vibsim.store.writing import write, write_parts

__all__ = [
    "check",
    "join",
    "open_level",
    "read",
    "read_json",
    "replacing",
    "write",
    "write_bytes",
    "write_json",
    "write_parts",
    "write_text",
]

__getattr__, __dir__ = lazy(
    __name__,
    {
        ".atomic": ("replacing", "write_bytes", "write_text"),
        ".reading": ("check", "join", "open_level", "read"),
        ".summary": ("read_json", "write_json"),
        ".writing": ("write", "write_parts"),
    },
)
