"""The command ``vibsim``. Each subcommand imports its modules only when it runs, so that quick commands stay quick."""

from __future__ import annotations

import atexit
import gc
import sys
from collections.abc import Sequence

LEAST_BYTES = 600 * 10**6
"""Address space that a run needs. Measured on 2 cores: 450 MB are sometimes too little, 500 MB were enough."""
_YOUNG_OBJECTS = 50_000
"""Threshold of Python's garbage collector (generation 0). With the default of 700, collections take a tenth of the time
of a report, mostly during imports; with 50 000 a report takes 2 MB more."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status.

    Parameters
    ----------
    arguments
        Arguments of the command. None stands for those of the command line; the command then runs under supervision,
        and a signal ends it with all processes that it has started.

    Returns
    -------
    int
        0 if all went well and every check passed, 1 if a check did not pass or something failed, 2 if input was
        refused, and 129, 130 or 143 if SIGHUP, SIGINT or SIGTERM ended the command.
    """
    if arguments is not None:
        return _perform(arguments)
    collect_seldom()
    try:
        _check_limits()
        from vibsim.cli.supervise import supervised

        return supervised(lambda: _perform(sys.argv[1:]))
    except Exception as error:
        return _failed(error)


def collect_seldom() -> None:
    """Make Python's garbage collector run seldom, and not when this process ends, which would take a tenth of a job."""
    gc.set_threshold(_YOUNG_OBJECTS)
    atexit.register(gc.freeze)


def _check_limits() -> None:
    """Refuse to start with too little address space, where libraries fail in many ways, some without a message."""
    import resource

    from vibsim.core.errors import VibsimError

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < LEAST_BYTES:
        available, needed = limit // 10**6, LEAST_BYTES // 10**6
        text = f"not enough memory: the limit is {available} MB (ulimit -v), {needed} MB are needed"
        raise VibsimError(text)


def _perform(arguments: Sequence[str]) -> int:
    try:
        from vibsim.cli.arguments import parsed

        try:
            options = parsed(arguments)
            status: int = options.command(options)
        finally:
            sys.stdout.flush()
    except Exception as error:
        return _failed(error)
    return status


def _failed(error: Exception) -> int:
    from vibsim.cli.failure import report

    return report(error)
