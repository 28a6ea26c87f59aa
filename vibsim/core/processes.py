"""What the kernel does for a process that ends, or whose parent does (``prctl``, Linux)."""

from __future__ import annotations

import ctypes
import os
import signal

from vibsim.core.errors import VibsimError

_SET_PARENT_DEATH_SIGNAL, _SET_CHILD_SUBREAPER = 1, 36


def end_with(parent: int) -> None:
    """Have the kernel kill this process when `parent`, which started it, has ended.

    Raises
    ------
    VibsimError
        When it has ended already.
    """
    _control(_SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)
    if os.getppid() != parent:
        raise VibsimError("the run that started this job has ended")


def adopt_orphans() -> None:
    """Have processes whose parents end become children of this one."""
    _control(_SET_CHILD_SUBREAPER, 1)


def _control(option: int, value: int) -> None:
    library = ctypes.CDLL(None, use_errno=True)
    if library.prctl(option, value, 0, 0, 0):
        number = ctypes.get_errno()
        raise OSError(number, f"prctl: {os.strerror(number)}")
