"""What a stored file says of its making: the settings and the versions that its job used."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from vibsim.core import netcdf
from vibsim.core.errors import DamagedFileError
from vibsim.store import seal


def read_provenance(path: Path) -> dict[str, Any]:
    """Return the attribute ``provenance`` of a file that vibsim wrote.

    Raises
    ------
    DamagedFileError
        When a single bit differs from what was written, or it says nothing of its making.
    """
    seal.check(path)
    try:
        with netcdf.opened(path) as dataset:
            found = json.loads(dataset.getncattr("provenance"))
    except (OSError, AttributeError, ValueError, RecursionError) as error:
        raise DamagedFileError(path, "it does not say what it was made from") from error
    if not isinstance(found, dict) or not isinstance(found.get("experiment"), dict):
        raise DamagedFileError(path, "it does not say what it was made from")
    return found
