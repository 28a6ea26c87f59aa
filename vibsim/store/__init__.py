"""Everything that vibsim writes to disk and reads back: whole, as it was written, or not at all.

Every file appears under its name in one step, carries a digest of its own bytes and the digest of
the job that made it. The netCDF library is imported only when such a file is opened (`vibsim.core.netcdf`);
reading a summary imports not even numpy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import loader

if TYPE_CHECKING:
    from vibsim.store.atomic import replacing, write_bytes, write_text
    from vibsim.store.level import Level, open_level
    from vibsim.store.reading import check, read
    from vibsim.store.shards import join
    from vibsim.store.summary import read_json, write_json
    from vibsim.store.writing import write, write_parts

_HOME = {
    "Level": "level",
    "check": "reading",
    "join": "shards",
    "open_level": "level",
    "read": "reading",
    "read_json": "summary",
    "replacing": "atomic",
    "write": "writing",
    "write_bytes": "atomic",
    "write_json": "summary",
    "write_parts": "writing",
    "write_text": "atomic",
}

__all__ = [
    "Level",
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


__getattr__ = loader(__name__, {name: f"vibsim.store.{home}" for name, home in _HOME.items()})
