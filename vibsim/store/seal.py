"""Seals of binary result files, and the check that a file belongs to the expected job.

The seal is the SHA-256 of all bytes of the file, appended at its end. HDF5 ignores bytes after the end that its
superblock states, so every netCDF program opens a sealed file. The library's own checksums (fletcher32) detect damaged
data but not damaged metadata; the seal covers every bit, and it is checked before the library reads the file.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from vibsim.core import regular_files
from vibsim.core.errors import DamagedFileError, StaleFileError
from vibsim.core.vocabulary import FORMAT

_MARK = b"\nvibsim-sha256:"
LENGTH = len(_MARK) + 64 + 1
"""Size of the seal in bytes."""
_BLOCK = 1 << 20
_UNSEALED = "it does not end with a seal: truncated, or not vibsim's"


def _seal(path: Path, size: int) -> bytes:
    digest = hashlib.sha256()
    with regular_files.reading(path) as file:
        while size > 0 and (block := file.read(min(_BLOCK, size))):
            digest.update(block)
            size -= len(block)
    return _MARK + digest.hexdigest().encode() + b"\n"


def attach(path: Path) -> None:
    """Append the seal to the finished file `path`."""
    seal = _seal(path, path.stat().st_size)
    with path.open("ab") as file:
        file.write(seal)


def stored_digest(path: Path) -> str:
    """Return the digest in the seal of `path`, without comparing it with the content.

    Raises
    ------
    DamagedFileError
        Where the file has no seal.
    """
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - LENGTH, 0))
        seal = file.read()
    if not seal.startswith(_MARK):
        raise DamagedFileError(path, _UNSEALED)
    return seal[len(_MARK) :].decode().rstrip("\n")


def check(path: Path) -> None:
    """Compare `path` with its seal.

    Raises
    ------
    DamagedFileError
        Where the file or its seal is missing, or a single bit differs from what was sealed.
    """
    try:
        size = path.stat().st_size - LENGTH
        with regular_files.reading(path) as file:
            file.seek(max(size, 0))
            seal = file.read(LENGTH + 1)
        expected = _seal(path, size)
    except OSError as error:
        raise DamagedFileError(path, f"cannot be read: {error.strerror}") from error
    if seal == expected:
        return
    if seal.startswith(_MARK):
        raise DamagedFileError(path, "its bytes are not those that were written")
    raise DamagedFileError(path, _UNSEALED)


def check_job(path: Path, form: Any, digest: str, wanted: str | None) -> None:
    """Check the format `form` and the job `digest` that an intact file states; a `wanted` digest of None accepts any.

    Raises
    ------
    StaleFileError
        Where the file has another format, or another job made it.
    """
    if form != FORMAT:
        raise StaleFileError(path, f"it is not in vibsim format {FORMAT}")
    if wanted is not None and digest != wanted:
        raise StaleFileError(path, f"it belongs to job {digest[:12]}, wanted is {wanted[:12]}")
