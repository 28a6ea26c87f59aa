"""Try in a child process first what may exhaust memory, never end or crash: libraries that read users' files."""

from __future__ import annotations

import faulthandler
import os
import resource
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

_SECONDS, _BYTES_A_SECOND = 2, 4_000_000
"""Limit on the CPU time of reading: seconds, plus the size of the file over a rate in bytes per second."""
_MEMORY, _MEMORY_OF_A_BYTE = 2**28, 16
"""Limit on the memory of reading: bytes, plus bytes per byte of the file."""
_MESSAGE = 4096
TOO_MUCH = "it is damaged, or asks for too much time or memory"


def problem(work: Callable[[], object], size: int) -> str:
    """Run `work` on a file of `size` bytes in a child process; return the reason why it fails, empty if it succeeds."""
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        # the warning about threads of this process: the child does not use them
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if not child:
        failed = 1
        try:
            os.close(reading)
            _limit(size)
            os.write(writing, _done(work).encode()[:_MESSAGE])
            failed = 0
        finally:
            os._exit(failed)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        message = pipe.read().decode(errors="replace")
    return TOO_MUCH if os.waitpid(child, 0)[1] else message


def _limit(size: int) -> None:
    seconds = _SECONDS + size // _BYTES_A_SECOND
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    with suppress(OSError, ValueError):
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        most = used + _MEMORY + size * _MEMORY_OF_A_BYTE
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    # silence crash messages of libraries and of Python
    faulthandler.disable()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)


def _done(work: Callable[[], object]) -> str:
    try:
        work()
    except Exception as error:
        return getattr(error, "strerror", None) or str(error) or type(error).__name__
    return ""
