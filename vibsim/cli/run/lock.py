"""One run at a time in a results folder.

The lock belongs to open descriptors and so vanishes with the last process that holds it, however it ends.
A run hands its descriptor to Snakemake: should the run alone be killed, its orphan still holds the folder.
"""

from __future__ import annotations

import errno
import fcntl
import os
import sys
from pathlib import Path

from vibsim.cli.run import supervise
from vibsim.core import regular_files
from vibsim.core.errors import VibsimError

_INHERITED = "VIBSIM_LOCK"
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)


def hold(results: Path) -> int:
    """Wait until no other run works in `results`, and keep others out until this process ends.

    Returns
    -------
    int
        The descriptor that holds the lock.

    Raises
    ------
    VibsimError
        Where the folder cannot be written, or its file system has no locks: two runs would spoil each other's work.
    """
    try:
        return _hold(results)
    except OSError as error:
        if error.errno in _NO_LOCKS:
            rule = "its file system has no file locks (flock), which keep two runs apart"
            text = f"{results}: {rule}; choose a folder on another one with --results"
        else:
            text = f"{results}: cannot be written ({error.strerror})"
        raise VibsimError(text) from error


def _hold(results: Path) -> int:
    path = results / ".vibsim/lock"
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor = regular_files.descriptor(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW)
    if os.environ.get(_INHERITED) == _identity(descriptor):
        return descriptor
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        holder = os.pread(descriptor, 32, 0).decode().strip() or "unknown"
        text = f"vibsim: waiting for another run in {results} (process {holder})"
        print(text, file=sys.stderr, flush=True)
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    # with a second name it may be another file elsewhere, too
    if os.fstat(descriptor).st_nlink == 1:
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"{supervise.known_pid()}\n".encode(), 0)
    return descriptor


def inherited(descriptor: int) -> dict[str, str]:
    """Return the environment that tells a child that it holds the lock with its parent."""
    return {_INHERITED: _identity(descriptor)}


def _identity(descriptor: int) -> str:
    status = os.fstat(descriptor)
    return f"{status.st_dev}:{status.st_ino}"
