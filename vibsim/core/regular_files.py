"""Files opened without waiting, and only where they are regular ones: never a pipe, a device or a folder."""

from __future__ import annotations

import errno
import hashlib
import os
import stat
from io import BufferedReader
from pathlib import Path


def descriptor(path: Path | str, flags: int, *, folder: int | None = None) -> int:
    """Return the descriptor of a regular file, relative to the descriptor of a folder where there is one.

    A file that is made can be read by everybody and written by its owner alone. OSError where it cannot be opened with
    the `flags` of `os.open`, or is no regular file.
    """
    # without O_NONBLOCK, opening a pipe waits for its other end
    found = os.open(path, flags | os.O_NONBLOCK | os.O_CLOEXEC, 0o644, dir_fd=folder)
    if not stat.S_ISREG(os.fstat(found).st_mode):
        os.close(found)
        raise OSError(errno.EINVAL, "not a regular file")
    return found


def append(path: Path, line: bytes) -> None:
    """Add a line to a file, in one write: processes that do so at the same time do not mix.

    Raises
    ------
    OSError
        Also where it is a link, or has another name: what is written would be written elsewhere.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    found = descriptor(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW)
    try:
        if os.fstat(found).st_nlink > 1:
            raise OSError(errno.EMLINK, "a file with several names")
        os.write(found, line)
    finally:
        os.close(found)


def digest(path: Path) -> str:
    """Return the SHA-256 of the content of a file of any size; OSError where it cannot be read."""
    with reading(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def reading(path: Path) -> BufferedReader:
    """Open a file to be read; see `descriptor`."""
    return os.fdopen(descriptor(path, os.O_RDONLY), "rb")
