"""Files that were deleted because they must not be used, told from a job to the run that started it."""

from __future__ import annotations

import os
from pathlib import Path

from vibsim.errors import FileError, VibsimError

_NOTE = ".vibsim/deleted.txt"


def delete(error: FileError, results: Path) -> None:
    """Delete the file that `error` names and leave a note, so that the run makes it again.

    Raises
    ------
    VibsimError
        Where a folder with something in it has the place of the file: that is not ours to delete.
    """
    try:
        if error.path.is_dir() and not error.path.is_symlink():
            error.path.rmdir()
        else:
            error.path.unlink(missing_ok=True)
    except OSError as reason:
        text = f"{error.path}: cannot be deleted ({reason.strerror}); move it away"
        raise VibsimError(text) from None
    note = results / _NOTE
    note.parent.mkdir(parents=True, exist_ok=True)
    line = f"{error}\n".encode()
    # One write of a line in append mode: jobs that note at the same time do not mix.
    descriptor = os.open(note, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
    try:
        os.write(descriptor, line)
    finally:
        os.close(descriptor)


def take(results: Path) -> list[str]:
    """Return what was deleted since the last time, and why."""
    note = results / _NOTE
    try:
        lines = note.read_text().splitlines()
    except FileNotFoundError:
        return []
    note.unlink()
    return lines
