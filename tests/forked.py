"""The command ``vibsim`` in a process of its own that need not import anything: it is a fork of this one.

It goes the same way as ``python -m vibsim``, from the command line over its supervisor to its exit status. What the
test has changed in this process (`monkeypatch`) holds in it too, but nothing that only the start of an interpreter
reads (``sitecustomize.py``): where that matters, start one.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
import traceback
import warnings
from pathlib import Path
from tempfile import TemporaryFile
from typing import NoReturn

import vibsim.cli.run.command
from vibsim import Experiment, analyse, simulate, verdicts  # noqa: F401
from vibsim.cli import main

SECONDS = 300
"""A command that takes longer waits for ever."""


def vibsim(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command and return its exit status and what it wrote."""
    command = ["vibsim", *map(str, arguments)]
    with TemporaryFile() as out, TemporaryFile() as err:
        with warnings.catch_warnings():
            # from Python 3.12 on, of threads that this process has, and the new one has not
            warnings.simplefilter("ignore", DeprecationWarning)
            child = os.fork()
        if not child:
            _perform(command, out.fileno(), err.fileno(), cwd)
        status = _wait(child, command)
        texts = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read().decode())
    return subprocess.CompletedProcess(command, status, *texts)


def _wait(child: int, command: list[str]) -> int:
    deadline = time.monotonic() + SECONDS
    while time.monotonic() < deadline:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.01)
    os.kill(child, 9)
    os.waitpid(child, 0)
    raise subprocess.TimeoutExpired(command, SECONDS)


def _perform(command: list[str], out: int, err: int, cwd: Path | None) -> NoReturn:
    status = 1
    try:
        os.dup2(out, 1)
        os.dup2(err, 2)
        sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w", buffering=1)
        # those of an interpreter, not those of the tests
        warnings.resetwarnings()
        for category in (DeprecationWarning, PendingDeprecationWarning, ImportWarning):
            warnings.simplefilter("ignore", category)
        if cwd is not None:
            os.chdir(cwd)
        sys.argv = command
        status = main()
    except SystemExit as left:
        status = left.code if isinstance(left.code, int) else 1
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
