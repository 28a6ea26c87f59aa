"""The command ``vibsim``. Each command imports what it needs when it runs: a quick one stays quick."""

from __future__ import annotations

import gc
import sys
from collections.abc import Sequence

LEAST_BYTES = 600 * 10**6
"""Address space that a run needs. Measured with 2 cores: 450 MB are sometimes too little, 500 MB were enough."""
YOUNG_OBJECTS = 50_000
"""So many new objects before Python looks for circles among them. With its own 700 that takes a tenth of a report's
time, most of it in imports; with 50 000 a page takes 2 MB more."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status.

    Parameters
    ----------
    arguments
        Those of the command. Without them this is the command itself: it takes those of the command line, and
        it ends when it is told to, with everything that it has started.

    Returns
    -------
    int
        0 when all went well and every check passed, 1 when a check did not pass or something failed, 2 when
        input was refused, 129, 130 or 143 when ended by SIGHUP, SIGINT or SIGTERM.
    """
    if arguments is not None:
        return _perform(arguments)
    gc.set_threshold(YOUNG_OBJECTS)
    try:
        _check_limits()
        from vibsim.cli.supervise import supervised

        return supervised(lambda: _perform(sys.argv[1:]))
    except Exception as error:
        return _failed(error)


def _check_limits() -> None:
    """Refuse to start with too little address space: libraries fail in many ways then, and some without a word."""
    import resource

    from vibsim.core.errors import VibsimError

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < LEAST_BYTES:
        found, needed = limit // 10**6, LEAST_BYTES // 10**6
        text = f"not enough memory: the limit is {found} MB (ulimit -v), {needed} MB are needed"
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
