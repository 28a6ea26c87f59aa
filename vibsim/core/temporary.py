"""Temporary folders that are always removed, even if a signal interrupts the removal."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import mkdtemp


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Yield a new folder that only this user can read, and remove it when the context ends."""
    folder = Path(mkdtemp(prefix="vibsim-"))
    try:
        yield folder
    finally:
        try:
            shutil.rmtree(folder, ignore_errors=True)
        finally:
            # `Interrupted` is raised only once, possibly during the first removal
            shutil.rmtree(folder, ignore_errors=True)
