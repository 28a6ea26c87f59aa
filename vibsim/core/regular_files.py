"""Files opened without waiting, and only where they are regular ones: never a pipe, a device or a folder."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO


def descriptor(path: Path | str, flags: int, *, folder: int | None = None) -> int:
    """Return the descriptor of a regular file.

    Parameters
    ----------
    path
        The file.
    flags
        As for `os.open`. A file that is made can be read by everybody and written by its owner alone.
    folder
        Descriptor of the folder that `path` is relative to.

    Raises
    ------
    OSError
        Where it cannot be opened, or is no regular file.
    """
    # without O_NONBLOCK, opening a pipe waits for its other end
    found = os.open(path, flags | os.O_NONBLOCK | os.O_CLOEXEC, 0o644, dir_fd=folder)
    if not stat.S_ISREG(os.fstat(found).st_mode):
        os.close(found)
        raise OSError(errno.EINVAL, "not a regular file")
    return found


def own(path: Path, flags: int) -> int:
    """Return the descriptor of a file that is to be written where it stands.

    Raises
    ------
    OSError
        Also where it is a link, or has another name: what is written would be written elsewhere.
    """
    found = descriptor(path, flags | os.O_NOFOLLOW)
    if os.fstat(found).st_nlink > 1:
        os.close(found)
        raise OSError(errno.EMLINK, "a file with several names")
    return found


def reading(path: Path) -> BinaryIO:
    """Open a file to be read; see `descriptor`."""
    return os.fdopen(descriptor(path, os.O_RDONLY), "rb")
