"""Process control: start times, signals, and children that end with their parents.

On Linux the kernel does this (``prctl``, ``/proc``). Elsewhere (macOS) a thread checks five times a second whether the
parent is alive, and psutil returns start times.
"""

from __future__ import annotations

import ctypes
import os
import signal
import threading
import time
from collections.abc import Set
from pathlib import Path

from vibsim.core.errors import VibsimError

ENDS = (signal.SIGHUP, signal.SIGINT, signal.SIGTERM)
"""Signals that ask a process to end."""
_SET_PARENT_DEATH_SIGNAL, _SET_CHILD_SUBREAPER = 1, 36
_ON_LINUX = os.uname().sysname == "Linux"
_PAUSE = 0.2
"""Time between two checks on systems where the kernel does not send a signal [s]."""


def usable_cores() -> int:
    """Return the number of cores that this process may use."""
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed else os.cpu_count() or 1


def started(pid: int) -> str:
    """Return the start time of process `pid` as text; empty if it has ended, even if its parent has not reaped it.

    The start time distinguishes a process from a later one with the same id. On Linux it is in ticks since boot, which
    do not depend on the clock.
    """
    if not _ON_LINUX:
        return _started_elsewhere(pid)
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return ""
    return "" if fields[0] in {"X", "Z"} else fields[19]


def end_with(parent: int) -> None:
    """Make the system kill this process when its parent process `parent` ends.

    Raises
    ------
    VibsimError
        Where the parent has already ended.
    """
    if _ON_LINUX:
        _control(_SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)
    if os.getppid() != parent:
        raise VibsimError("the run that started this job has ended")
    if not _ON_LINUX:
        threading.Thread(target=_watch_parent, args=(parent,), daemon=True).start()


def heeded() -> set[signal.Signals]:
    """Return the signals of `ENDS` that may end this process: those ignored at its start (``nohup``) stay ignored."""
    return {number for number in ENDS if signal.getsignal(number) is not signal.SIG_IGN}


def as_worker_of(parent: int) -> None:
    """Make this process end with its parent process `parent`, and at once on a signal of `ENDS`.

    Raises
    ------
    VibsimError
        Where the parent has already ended.
    """
    ends = heeded()
    for number in ends:
        signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ends)
    end_with(parent)


def adopt_orphans() -> None:
    """Make descendants whose parents have ended children of this process (on Linux only)."""
    if _ON_LINUX:
        _control(_SET_CHILD_SUBREAPER, 1)


def wait_for_signal(numbers: Set[signal.Signals], seconds: float) -> int:
    """Wait for one of the blocked signals `numbers` and return it, or 0 after at most `seconds`."""
    if _ON_LINUX:
        received = signal.sigtimedwait(numbers, seconds)
        return received.si_signo if received else 0
    time.sleep(min(seconds, _PAUSE))
    pending = signal.sigpending() & numbers
    return signal.sigwait(pending) if pending else 0


def _started_elsewhere(pid: int) -> str:
    import psutil  # imported here: it takes 10 ms, and Linux does not need it

    try:
        process = psutil.Process(pid)
        is_dead = process.status() == psutil.STATUS_ZOMBIE
        return "" if is_dead else f"{process.create_time():.0f}"
    except psutil.Error:
        return ""


def _watch_parent(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_PAUSE)
    os.kill(os.getpid(), signal.SIGKILL)


def _control(option: int, value: int) -> None:
    library = ctypes.CDLL(None, use_errno=True)
    if library.prctl(option, value, 0, 0, 0):
        number = ctypes.get_errno()
        raise OSError(number, f"prctl: {os.strerror(number)}")
