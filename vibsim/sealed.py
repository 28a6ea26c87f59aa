"""Files of a cache: written aside and put into their place whole, sealed, and made by one of the jobs that want them.

A sealed file is its content and behind it the SHA-256 of a label and the content, so that a damaged one is told from
one that is as it was written. With its own name for a label a file is none under another name.
"""

from __future__ import annotations

import fcntl
import hashlib
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

SEAL = 32
"""Bytes of the SHA-256 behind the content."""


def read(path: Path, label: bytes = b"") -> bytes | None:
    """Return the content of a sealed file; None where there is none, or it is not as it was written.

    Parameters
    ----------
    label
        What was sealed before the content.

    Raises
    ------
    OSError
        Where there is a file that cannot be read.
    """
    try:
        whole = path.read_bytes()
    except FileNotFoundError:
        return None
    content, seal = whole[:-SEAL], whole[-SEAL:]
    return content if content and _seal(content, label) == seal else None


def write(path: Path, content: bytes, label: bytes = b"") -> None:
    """Write a sealed file, of which jobs see nothing or all.

    Raises
    ------
    OSError
        Where the folder cannot be written.
    """
    put(path, content + _seal(content, label))


def put(path: Path, content: bytes) -> None:
    """Write a file without a seal in the same way, which raises the same."""
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".tmp", delete=False) as file:
        file.write(content)
    Path(file.name).replace(path)


@contextmanager
def held(lock: TextIO) -> Iterator[None]:
    """Hold an open lock file; it goes with the process, so that a killed job leaves nothing locked."""
    fcntl.flock(lock, fcntl.LOCK_EX)
    try:
        yield
    finally:
        fcntl.flock(lock, fcntl.LOCK_UN)


def _seal(content: bytes, label: bytes) -> bytes:
    digest = hashlib.sha256(label)
    digest.update(content)
    return digest.digest()
