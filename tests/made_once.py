"""Results that many tests look at: one process of a test run makes them, and all others wait for it."""

from __future__ import annotations

import fcntl
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest


def made_once(
    factory: pytest.TempPathFactory, worker_id: str, name: str, make: Callable[[Path], None]
) -> Path:
    """Return the folder `name` that all workers share, which `make` fills for the first one that asks."""
    base = factory.getbasetemp()
    shared = base if worker_id == "master" else base.parent
    folder, done = shared / name, shared / f"{name}.done"
    with (shared / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not done.exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            make(folder)
            done.touch()
    return folder


def change(file: Path, old: str, new: str) -> None:
    """Replace a part of a text, which must be there."""
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
