"""Temporary folders that are gone afterwards, also where a command is told to end while it removes one."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import mkdtemp


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Give a new folder that only this user can read, and remove it when the block ends."""
    folder = Path(mkdtemp(prefix="vibsim-"))
    try:
        yield folder
    finally:
        try:
            shutil.rmtree(folder, ignore_errors=True)
        finally:
            # a request to end is raised once, perhaps in the middle of the first removal
            shutil.rmtree(folder, ignore_errors=True)
