"""Files that were deleted because they must not be used, told from a job to the run that started it."""

from __future__ import annotations

import os
from pathlib import Path

from vibsim.core import regular_files
from vibsim.core.errors import FileError, VibsimError

_NOTE = ".vibsim/deleted.txt"


def delete(error: FileError, results: Path) -> None:
    """Delete the file that `error` names and leave a note, so that the run makes it again.

    Raises
    ------
    VibsimError
        Where a folder with something in it has the place of the file, which is not ours to delete, or the note cannot
        be written.
    """
    try:
        if error.path.is_dir() and not error.path.is_symlink():
            error.path.rmdir()
        else:
            error.path.unlink(missing_ok=True)
    except OSError as reason:
        text = f"{error.path}: cannot be deleted ({reason.strerror}); move it away"
        raise VibsimError(text) from None
    try:
        _tell(f"{error}\n".encode(), results / _NOTE)
    except OSError as reason:
        raise VibsimError(f"{results / _NOTE}: cannot be written ({reason.strerror})") from None


def _tell(line: bytes, note: Path) -> None:
    note.parent.mkdir(parents=True, exist_ok=True)
    # One write of a line in append mode: jobs that note at the same time do not mix.
    descriptor = regular_files.own(note, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    try:
        os.write(descriptor, line)
    finally:
        os.close(descriptor)


def take(results: Path) -> list[str]:
    """Return what was deleted since the last time, and why."""
    note = results / _NOTE
    try:
        with regular_files.reading(note) as file:
            lines = file.read().decode(errors="replace").splitlines()
    except FileNotFoundError:
        return []
    note.unlink()
    return lines
