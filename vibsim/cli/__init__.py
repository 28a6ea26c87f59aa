"""The command ``vibsim``. Each command imports what it needs when it runs: a quick one stays quick."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from vibsim.cli.arguments import parser
from vibsim.errors import InputError, VibsimError

PASSED, FAILED, REFUSED, INTERRUPTED = 0, 1, 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status.

    Returns
    -------
    int
        0 when all went well and every check passed, 1 when a check did not pass or a job failed, 2 when
        input was refused, 130 when interrupted.
    """
    options = parser().parse_args(arguments)
    try:
        status: int = options.command(options)
        sys.stdout.flush()
    except InputError as error:
        print(error, file=sys.stderr)
        return REFUSED
    except VibsimError as error:
        print(f"vibsim: {error}", file=sys.stderr)
        return FAILED
    except BrokenPipeError:
        # The reader of a pipe has gone (``vibsim list | head``); nobody is left to tell.
        sys.stderr.close()
        return FAILED
    except KeyboardInterrupt:
        print("vibsim: interrupted; the same command goes on from here", file=sys.stderr)
        return INTERRUPTED
    return status
