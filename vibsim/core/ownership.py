"""Folders and files that nobody but the user, and root, can write to, replace or have written.

A folder that others can write to is refused and not changed: closing it afterwards would leave what they put there. A
folder of ours that others can only read is closed to them.
"""

from __future__ import annotations

import errno
import os
import stat
from contextlib import suppress
from pathlib import Path

from vibsim.core import regular_files

_FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
_MODE = 0o700
_MOST_LINKS = 40
"""Links that a path may lead through, as for the system."""


def inside(place: Path, name: str) -> int:
    """Return the descriptor of folder `name` inside of `place`; both are made where they are missing.

    Parameters
    ----------
    place
        An absolute path.

    Raises
    ------
    OSError
        Where it cannot be made or opened, or others can write to it, or could put another in its place.
    """
    check(place)
    outer = os.open(place, _FOLDER)
    try:
        with suppress(FileExistsError):
            os.mkdir(name, _MODE, dir_fd=outer)
        found = _opened(place / name, outer)
    finally:
        os.close(outer)
    return found


def check(place: Path) -> None:
    """Make a folder where it is missing, and refuse one that others can write to, or could put another in its place.

    Raises
    ------
    OSError
        With the path and the reason.
    """
    for folder in (*reversed(place.parents), place):
        with suppress(FileExistsError):
            folder.mkdir(_MODE)
    _check_way(place.parent)
    os.close(_opened(place))


def _check_way(path: Path, links: int = 0) -> None:
    """Refuse where one of the folders that lead to `path`, or a link among them, is another user's."""
    for folder in (*reversed(path.parents), path):
        about = folder.lstat()
        if about.st_uid not in (0, os.geteuid()):
            raise _refusal(folder, "belongs to another user")
        if stat.S_ISLNK(about.st_mode):
            if links == _MOST_LINKS:
                raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
            there = folder.parent / folder.readlink() / path.relative_to(folder)
            return _check_way(there, links + 1)
        # in a sticky folder nobody renames what is another's
        if about.st_mode & _OTHERS_WRITE and not about.st_mode & stat.S_ISVTX:
            raise _refusal(folder, "others can write to it")
    return None


def _opened(path: Path, outer: int | None = None) -> int:
    """Open a folder of ours, relative to the descriptor `outer` where there is one, and close it to others there."""
    try:
        found = os.open(path.name if outer is not None else path, _FOLDER, dir_fd=outer)
    except OSError as error:
        reason = "is a link" if path.is_symlink() else error.strerror
        raise OSError(error.errno, reason, str(path)) from None
    about = os.fstat(found)
    try:
        if about.st_uid != os.geteuid():
            raise _refusal(path, "belongs to another user")
        if about.st_mode & _OTHERS_WRITE:
            raise _refusal(path, "others can write to it")
        # what others can read is no danger, and the folder that a user names keeps its mode
        if outer is not None and stat.S_IMODE(about.st_mode) != _MODE:
            os.fchmod(found, _MODE)
    except OSError:
        os.close(found)
        raise
    return found


def check_writable(folder: Path) -> None:
    """Raise OSError where files cannot be made in a folder."""
    if not os.access(folder, os.W_OK | os.X_OK):
        raise _refusal(folder, "cannot be written")


def file(name: str, flags: int, folder: int) -> int:
    """Return the descriptor of a file of ours in an opened folder.

    Raises
    ------
    OSError
        Also where it is a link or no regular file, is another user's, has another name, or others can write to it.
    """
    found = regular_files.descriptor(name, flags | os.O_NOFOLLOW, folder=folder)
    about = os.fstat(found)
    if about.st_uid == os.geteuid() and about.st_nlink == 1 and not about.st_mode & _OTHERS_WRITE:
        return found
    os.close(found)
    raise _refusal(Path(name), "is not ours alone")


def _refusal(path: Path, reason: str) -> OSError:
    return OSError(errno.EPERM, reason, str(path))
