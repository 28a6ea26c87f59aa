"""Run a command in two processes: a worker, and a supervisor that can end it on a signal, however busy it is.

The supervisor receives signals only while it waits for them, so that none interrupts other code. It sends the worker
SIGTERM, and kills it if it does not end in time. Each process of a run ends with the one that started it
(`vibsim.core.processes`): whichever is killed, no process goes on, and the lock of the results folder is free.
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

from vibsim.core import processes

_GRACE = 3.0  # time that a worker has to end by itself [s], and after that its children
_PARENT = "VIBSIM_PARENT"

Work = Callable[[], int]


class Interrupted(KeyboardInterrupt):
    """A request to end, by signal `number`."""

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(number)


def supervised(work: Work) -> int:
    """Run `work` in a second process and return its exit status; `work` ends with this process, or on its signals.

    The status is the one that `work` returns, or 128 plus the number of the signal that ended it.
    """
    if parent := os.environ.pop(_PARENT, ""):
        # a job of a run needs no supervisor: a signal may end it at any time, since files are written in one step
        processes.as_worker_of(int(parent))
        return work()
    ends = processes.heeded()
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ends | {signal.SIGCHLD})
    processes.adopt_orphans()
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
    """Make all commands that this process starts from now on end with it."""
    os.environ.update(environment())


def environment() -> dict[str, str]:
    """Return the environment variable that makes a command end with this process, its parent."""
    return {_PARENT: str(os.getpid())}


def child(words: Sequence[str], *, is_heard: bool = True) -> int:
    """Run another command of vibsim, which ends with this process, and return its exit status.

    Its stderr is shown, its stdout only with `is_heard`.
    """
    import subprocess

    command = [sys.executable, "-P", "-m", "vibsim", *words]
    output = None if is_heard else subprocess.DEVNULL
    ended = subprocess.run(command, env=os.environ | environment(), stdout=output, check=False)
    return ended.returncode


def end_at_once() -> None:
    """Make the first signal end this process at once, whatever handlers are set later."""
    _on_signal(lambda number: os._exit(128 + number))


def end_in_order() -> None:
    """Make the first signal raise KeyboardInterrupt in the main thread.

    Snakemake then cancels its submitted jobs, undisturbed by further signals.
    """
    signal.signal(signal.SIGUSR1, signal.default_int_handler)
    main = threading.main_thread().ident or 0
    _on_signal(lambda _: signal.pthread_kill(main, signal.SIGUSR1))


def _on_signal(act: Callable[[int], None]) -> None:
    """Call `act` once, in a separate thread, when a signal asks this process to end.

    The signals are blocked in all threads, and this thread waits for them: a handler would interrupt the main thread at
    any point, with locks held.
    """
    ends = processes.heeded()
    signal.pthread_sigmask(signal.SIG_BLOCK, ends)
    threading.Thread(target=lambda: act(signal.sigwait(ends)), daemon=True).start()


def take_time(seconds: float) -> None:
    """Ask the supervisor for more time to end [s]."""
    _grace[0] = seconds


def ended_by(status: int) -> int:
    """Return the signal of `ENDS` that ended a process, from its exit status as `subprocess` returns it; else 0."""
    number = -status if status < 0 else status - 128
    return number if number in processes.ENDS else 0


def check_interrupted() -> None:
    """Raise `Interrupted` again if a signal has arrived: a library may have swallowed the first one."""
    if _request:
        raise Interrupted(_request)


def known_pid() -> int:
    """Return the id of the process that a user knows as this command: the supervisor, if there is one."""
    return _supervisor or os.getpid()


_grace = memoryview(mmap.mmap(-1, mmap.PAGESIZE)).cast("d")
"""Time that the worker requests to end [s], in memory shared with the supervisor; 0 without a request."""
_supervisor = 0
_request = 0


def _work(
    supervisor: int, ends: set[signal.Signals], mask: set[int], work: Work, end: int
) -> NoReturn:
    """Run `work` in the worker process and exit; a byte in the pipe `end` shows that it was not killed."""
    global _supervisor
    _supervisor = supervisor
    status = 1
    try:
        for number in ends:
            signal.signal(number, _interrupt)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        processes.end_with(supervisor)
        status = work()
    except Interrupted as request:
        status = 128 + request.number
    except SystemExit as ended:
        status = int(ended.code or 0)
    finally:
        os.write(end, b".")
        os._exit(status)  # do not wait for other threads


def _interrupt(number: int, _: object) -> None:
    """Raise `Interrupted`, once; errors in destructors on the way out are not shown."""
    global _request
    _request = number
    for other in processes.ENDS:
        signal.signal(other, signal.SIG_IGN)
    sys.unraisablehook = lambda _: None
    raise Interrupted(number)


def _watch(worker: int, ends: set[signal.Signals]) -> tuple[int, int]:
    """Return the wait status of the worker, and the signal that asked it to end, 0 if none did."""
    signalled, deadline = 0, 0.0
    while True:
        timeout = max(deadline - time.monotonic(), 0) if signalled else 3600.0
        received = processes.wait_for_signal(ends | {signal.SIGCHLD}, timeout)
        if (status := _ended(worker)) is not None:
            return status, signalled
        if received == signal.SIGCHLD:
            continue
        if received and not signalled:
            signalled, deadline = received, time.monotonic() + max(_GRACE, _grace[0])
            os.kill(worker, signal.SIGTERM)
        elif signalled and (received or time.monotonic() >= deadline):
            os.kill(worker, signal.SIGKILL)  # out of time, or a second signal


def _ended(worker: int) -> int | None:
    """Return the wait status of the worker if it has ended, else None, and reap orphans that have ended."""
    while True:
        process, status = os.waitpid(-1, os.WNOHANG)
        if process == worker:
            return status
        if not process:
            return None


def _wait_for_children() -> None:
    """Wait until all processes that the worker started have ended: the kernel kills them, this process reaps them."""
    deadline = time.monotonic() + _GRACE
    with suppress(ChildProcessError):
        while time.monotonic() < deadline:
            if not os.waitpid(-1, os.WNOHANG)[0]:
                time.sleep(0.01)


def _exit_status(status: int, signalled: int, orderly: bool) -> int:
    """Print how the worker ended, unless it ended in order, and return the exit status."""
    code = os.waitstatus_to_exitcode(status)
    if number := signalled or ended_by(code):
        _say("interrupted; run the same command again to continue")
        return 128 + number
    if not orderly:
        # killed by the system, or a library that could not allocate memory called exit
        how = f"killed by {signal.Signals(-code).name}" if code < 0 else "ended by a library"
        _say(f"{how}, perhaps for lack of memory; run the same command again to continue")
        return 1
    return code


def _say(text: str) -> None:
    # overwrite a line of progress; the terminal may be gone
    with suppress(OSError):
        start = "\r\033[K" if sys.stderr.isatty() else ""
        print(f"{start}vibsim: {text}", file=sys.stderr, flush=True)
