"""Open regular files only, without blocking: never a pipe, a device or a folder."""

from __future__ import annotations

import errno
import hashlib
import os
import stat
from io import BufferedReader
from pathlib import Path


def descriptor(path: Path | str, flags: int, *, folder: int | None = None) -> int:
    """Open a regular file with the `flags` of `os.open`, and return its descriptor.

    `path` is relative to the folder with descriptor `folder`, if given. A new file has mode 0644. Raises OSError where
    the file cannot be opened or is not a regular file.
    """
    # without O_NONBLOCK, opening a pipe waits for its other end
    file = os.open(path, flags | os.O_NONBLOCK | os.O_CLOEXEC, 0o644, dir_fd=folder)
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        raise OSError(errno.EINVAL, "not a regular file")
    return file


def append(path: Path, line: bytes) -> None:
    """Append a line to a file in one write, so that lines of concurrent processes do not mix.

    Raises
    ------
    OSError
        Also where the file is a symbolic link or has several hard links, since that would write to another place.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    file = descriptor(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW)
    try:
        if os.fstat(file).st_nlink > 1:
            raise OSError(errno.EMLINK, "a file with several names")
        os.write(file, line)
    finally:
        os.close(file)


def digest(path: Path) -> str:
    """Return the SHA-256 of the content of a file of any size; raises OSError where it cannot be read."""
    with reading(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def reading(path: Path) -> BufferedReader:
    """Open a file for reading; see `descriptor`."""
    return os.fdopen(descriptor(path, os.O_RDONLY), "rb")
