"""``vibsim watch``: run an experiment file again whenever it, or a table that it names, is saved."""

from __future__ import annotations

import sys
import time
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

from vibsim.cli import supervise
from vibsim.cli.chosen_plans import one_plan_of
from vibsim.cli.jobs.common import refusal, run_command
from vibsim.core.errors import VibsimError
from vibsim.experiment.collection import ENDINGS

PAUSE = 0.3  # time between two checks of the files [s]
_Saved = dict[Path, tuple[int, int, int] | None]
"""Time, size and inode of each file; None for a missing file, since some editors remove a file before they save it."""


def watch(options: Namespace) -> int:
    """Run, wait for a change, and run again, until a signal ends it.

    Raises InputError where the experiment file does not exist.
    """
    file: Path = options.file
    if file.suffix not in ENDINGS or not file.is_file():
        raise refusal("FILE", file, "must be an existing experiment file (.yaml)")
    while True:
        watched = _files(file, options.settings)
        before = _saved(watched)
        command = run_command(options, [str(file)], options.results)
        if options.detail:
            command.append({"full": "--verbose", "quiet": "--quiet"}[options.detail])
        supervise.child(command)
        print(f"watching {file}: save it to run again, Ctrl-C to end", file=sys.stderr, flush=True)
        while _saved(watched) == before or not file.exists():
            time.sleep(PAUSE)


def _files(file: Path, settings: Sequence[str]) -> list[Path]:
    """Return the experiment file, and the tables that it names if it is valid."""
    try:
        return [file, *(file.parent / name for name, _ in one_plan_of(str(file), settings).inputs)]
    except VibsimError:
        return [file]


def _saved(files: list[Path]) -> _Saved:
    states: _Saved = {}
    for file in files:
        try:
            status = file.stat()
            states[file] = status.st_mtime_ns, status.st_size, status.st_ino
        except OSError:
            states[file] = None
    return states
