"""A command in two processes: one works, and the other ends it when it is told to, however busy it is.

The first process takes signals only where it waits for them, so that none arrives at a wrong moment. It asks the
worker to end, and kills it when it does not. Each process of a run ends with the one that started it, as
`vibsim.core.processes` says: whoever is killed, nothing works on, and the lock of the results
folder is free.
"""

from __future__ import annotations

import mmap
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NoReturn

from vibsim.core.processes import (
    ENDS,
    adopt_orphans,
    as_worker_of,
    end_with,
    heeded,
    wait_for_signal,
)

_GRACE = 3.0
"""Seconds that a worker has to end by itself, and then its children."""
_PARENT = "VIBSIM_PARENT"

Work = Callable[[], int]


class Interrupted(KeyboardInterrupt):
    """A request to end, by signal `number`."""

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(number)


def supervised(work: Work) -> int:
    """Return the exit status of `work`, which ends when this process is told to, or is killed.

    It is that of the command, which may raise `Interrupted`, or 128 and the number of the signal that ended it.
    """
    if parent := os.environ.pop(_PARENT, ""):
        # a job of a run, which a signal ends on the spot: its files appear whole or not at all
        as_worker_of(int(parent))
        return work()
    ends = heeded()
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ends | {signal.SIGCHLD})
    adopt_orphans()
    supervisor = os.getpid()
    reading, writing = os.pipe()
    worker = os.fork()
    if not worker:
        _work(supervisor, ends, before, work, writing)
    os.close(writing)
    status, number = _watch(worker, ends)
    _wait_for_children()
    return _exit_status(status, number, orderly=os.read(reading, 1) != b"")


def children_end_with_this() -> None:
    """Have the commands that this process starts from now on end with it."""
    os.environ.update(environment())


def environment() -> dict[str, str]:
    """Return what tells a command to end with this process, which starts it."""
    return {_PARENT: str(os.getpid())}


def child(words: Sequence[str], *, is_heard: bool = True) -> int:
    """Run another command of vibsim, which ends with this process, and return its exit status.

    Where it is not heard, what it prints goes nowhere; its messages are shown.
    """
    import subprocess

    command = [sys.executable, "-P", "-m", "vibsim", *words]
    output = None if is_heard else subprocess.DEVNULL
    ended = subprocess.run(command, env=os.environ | environment(), stdout=output, check=False)
    return ended.returncode


def end_at_once() -> None:
    """End this process as soon as it is told to, whatever handlers are set later."""
    _on_signal(lambda number: os._exit(128 + number))


def end_in_order() -> None:
    """Raise KeyboardInterrupt in the main thread as soon as this process is told to end, once.

    Snakemake then cancels what it has submitted. Further requests must not disturb that.
    """
    signal.signal(signal.SIGUSR1, signal.default_int_handler)
    main = threading.main_thread().ident or 0
    _on_signal(lambda _: signal.pthread_kill(main, signal.SIGUSR1))


def _on_signal(act: Callable[[int], None]) -> None:
    """Act once, in a thread of its own, when this process is told to end.

    The signals are blocked in every thread but that one, which does nothing else than wait for them: a handler would
    run in the middle of whatever the main thread does, locks held.
    """
    ends = heeded()
    signal.pthread_sigmask(signal.SIG_BLOCK, ends)
    threading.Thread(target=lambda: act(signal.sigwait(ends)), daemon=True).start()


def take_time(seconds: float) -> None:
    """Ask the process that supervises this one for more time to end, from now on."""
    _grace[0] = seconds


def ended_by(status: int) -> int:
    """Return the signal of `ENDS` that ended a process with exit status `status`, as `subprocess` tells it; else 0."""
    number = -status if status < 0 else status - 128
    return number if number in ENDS else 0


def check_interrupted() -> None:
    """Raise the request to end once more, if there was one: where it was first raised, it may have been swallowed."""
    if _request:
        raise Interrupted(_request)


def known_pid() -> int:
    """Return the process that a user knows as this command, and may send a signal to."""
    return _supervisor or os.getpid()


_grace = memoryview(mmap.mmap(-1, mmap.PAGESIZE)).cast("d")
"""Seconds that the worker asks for to end, in memory that it shares with its supervisor; 0 where it does not."""
_supervisor = 0
_request = 0


def _work(
    supervisor: int, ends: set[signal.Signals], mask: set[int], work: Work, end: int
) -> NoReturn:
    """Work in the second process and leave it for good; a byte in the pipe `end` tells that it has come to its end."""
    global _supervisor
    _supervisor = supervisor
    status = 1
    try:
        for number in ends:
            signal.signal(number, _interrupt)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        end_with(supervisor)
        status = work()
    except Interrupted as request:
        status = 128 + request.number
    except SystemExit as left:
        status = int(left.code or 0)
    finally:
        os.write(end, b".")
        # Threads that compute are not waited for.
        os._exit(status)


def _interrupt(number: int, _: object) -> None:
    """Unwind the stack, once; what falls on the way out is no news."""
    global _request
    _request = number
    for other in ENDS:
        signal.signal(other, signal.SIG_IGN)
    sys.unraisablehook = lambda _: None
    raise Interrupted(number)


def _watch(worker: int, ends: set[signal.Signals]) -> tuple[int, int]:
    """Return the wait status of the worker, and the signal by which it was to end, 0 without one."""
    signalled, deadline = 0, 0.0
    while True:
        left = max(deadline - time.monotonic(), 0) if signalled else 3600.0
        found = wait_for_signal(ends | {signal.SIGCHLD}, left)
        if (status := _ended(worker)) is not None:
            return status, signalled
        if found == signal.SIGCHLD:
            continue
        if found and not signalled:
            signalled, deadline = found, time.monotonic() + max(_GRACE, _grace[0])
            os.kill(worker, signal.SIGTERM)
        elif signalled and (found or time.monotonic() >= deadline):
            # out of time, or asked again
            os.kill(worker, signal.SIGKILL)


def _ended(worker: int) -> int | None:
    """Return the wait status of the worker when it has ended, and let go of orphans that have."""
    while True:
        process, status = os.waitpid(-1, os.WNOHANG)
        if process == worker:
            return status
        if not process:
            return None


def _wait_for_children() -> None:
    """Wait until everything is gone that the worker started: the kernel kills it, and gives it to this process."""
    deadline = time.monotonic() + _GRACE
    with suppress(ChildProcessError):
        while time.monotonic() < deadline:
            if not os.waitpid(-1, os.WNOHANG)[0]:
                time.sleep(0.01)


def _exit_status(status: int, signalled: int, orderly: bool) -> int:
    """Say how the worker ended, unless it has said so itself; return the exit status."""
    code = os.waitstatus_to_exitcode(status)
    if number := signalled or ended_by(code):
        _say("interrupted; run the same command again to continue")
        return 128 + number
    if not orderly:
        # killed by the system, or left by a library that was given no memory
        how = f"killed by {signal.Signals(-code).name}" if code < 0 else "ended by a library"
        _say(f"{how}, perhaps for lack of memory; run the same command again to continue")
        return 1
    return code


def _say(text: str) -> None:
    # a line of progress may stand there; and where the terminal has gone, nobody is left to tell
    with suppress(OSError):
        start = "\r\033[K" if sys.stderr.isatty() else ""
        print(f"{start}vibsim: {text}", file=sys.stderr, flush=True)
