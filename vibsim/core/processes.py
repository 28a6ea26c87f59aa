"""What the system says of processes, and does for one that ends, or whose parent does.

Linux does it all in the kernel (``prctl``, ``/proc``). Elsewhere (macOS) a thread looks five times a second whether
the parent is still there, and psutil says when a process started.
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
"""Seconds between two looks where the kernel cannot be asked to tell."""


def usable_cores() -> int:
    """Return how many cores this process may use."""
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed else os.cpu_count() or 1


def started(pid: int) -> str:
    """Return when process `pid` started; empty when it is dead, even if nobody took notice.

    The number tells a living process from a later one that was given the same id. On Linux it counts ticks since
    boot, which no change of the clock can move.
    """
    if not _ON_LINUX:
        return _started_elsewhere(pid)
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return ""
    return "" if fields[0] in {"X", "Z"} else fields[19]


def end_with(parent: int) -> None:
    """Have this process killed when `parent`, which started it, has ended.

    Raises
    ------
    VibsimError
        When it has ended already.
    """
    if _ON_LINUX:
        _control(_SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)
    if os.getppid() != parent:
        raise VibsimError("the run that started this job has ended")
    if not _ON_LINUX:
        threading.Thread(target=_outlive, args=(parent,), daemon=True).start()


def heeded() -> set[signal.Signals]:
    """Return the signals that end this process: those that it was started to ignore (``nohup``) stay ignored."""
    return {number for number in ENDS if signal.getsignal(number) is not signal.SIG_IGN}


def as_worker_of(parent: int) -> None:
    """Have this process end with `parent`, which started it, and on the spot by a signal that asks to end.

    Raises
    ------
    VibsimError
        As `end_with`.
    """
    ends = heeded()
    for number in ends:
        signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ends)
    end_with(parent)


def adopt_orphans() -> None:
    """Have processes whose parents end become children of this one, where the kernel can do that."""
    if _ON_LINUX:
        _control(_SET_CHILD_SUBREAPER, 1)


def wait_for_signal(numbers: Set[signal.Signals], seconds: float) -> int:
    """Return one of the blocked signals `numbers` as soon as it comes, or 0 after `seconds` at the latest."""
    if _ON_LINUX:
        found = signal.sigtimedwait(numbers, seconds)
        return found.si_signo if found else 0
    time.sleep(min(seconds, _PAUSE))
    pending = signal.sigpending() & numbers
    return signal.sigwait(pending) if pending else 0


def _started_elsewhere(pid: int) -> str:
    import psutil  # 10 ms, which no job on Linux pays

    try:
        process = psutil.Process(pid)
        is_dead = process.status() == psutil.STATUS_ZOMBIE
        return "" if is_dead else f"{process.create_time():.0f}"
    except psutil.Error:
        return ""


def _outlive(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_PAUSE)
    os.kill(os.getpid(), signal.SIGKILL)


def _control(option: int, value: int) -> None:
    library = ctypes.CDLL(None, use_errno=True)
    if library.prctl(option, value, 0, 0, 0):
        number = ctypes.get_errno()
        raise OSError(number, f"prctl: {os.strerror(number)}")
