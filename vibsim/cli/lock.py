"""One run at a time in a results folder.

The lock belongs to open descriptors and so vanishes with the last process that holds it, however it ends.
A run hands its descriptor to Snakemake: should the run alone be killed, its orphan still holds the folder.
"""

from __future__ import annotations

import fcntl
import os
import sys
from pathlib import Path

_INHERITED = "VIBSIM_LOCK"


def hold(results: Path) -> int:
    """Wait until no other run works in `results`, and keep others out until this process ends.

    Returns
    -------
    int
        The descriptor that holds the lock.
    """
    path = results / ".vibsim/lock"
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    if os.environ.get(_INHERITED) == _identity(descriptor):
        return descriptor
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        holder = os.pread(descriptor, 32, 0).decode().strip() or "unknown"
        text = f"vibsim: waiting for another run in {results} (process {holder})"
        print(text, file=sys.stderr, flush=True)
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    os.ftruncate(descriptor, 0)
    os.pwrite(descriptor, f"{os.getpid()}\n".encode(), 0)
    return descriptor


def inherited(descriptor: int) -> dict[str, str]:
    """Return the environment that tells a child that it holds the lock with its parent."""
    return {_INHERITED: _identity(descriptor)}


def _identity(descriptor: int) -> str:
    status = os.fstat(descriptor)
    return f"{status.st_dev}:{status.st_ino}"
