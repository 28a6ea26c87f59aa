"""Atomic writes: write to a hidden temporary file beside the target, flush it, then rename it.

A reader sees the old file or the new one and nothing in between, even after a crash or a power cut. A killed writer
leaves its temporary file; the next writer of the same target removes it, or a run that no longer has this target.
"""

from __future__ import annotations

import os
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vibsim.core.processes import started

_SUFFIX = ".part"
_TEMPORARY = re.compile(rf"\.(?P<target>.+)\.(?P<pid>\d+)-(?P<started>[^-]*)-[^-]+\{_SUFFIX}")
_BLOCK, _MARGIN = 2**16, 2**22
"""Bytes written at a time, and in total, to find out whether the disk is full."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path to write to, and rename it to `path` if the block ends without an exception.

    The folder is made if necessary. The temporary name is unique, so that several writers of one target do not collide.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    for leftover, target in abandoned(path.parent):
        if target == path:
            leftover.unlink(missing_ok=True)
    pid = os.getpid()
    owner = f"{pid}-{started(pid)}-{secrets.token_hex(4)}"
    temporary = path.with_name(f".{path.name}.{owner}{_SUFFIX}")
    try:
        yield temporary
        _flush(temporary)
        temporary.replace(path)
    except OSError as error:
        # the error of a full disk names no file, and the temporary name means nothing to the user
        if error.filename is None or str(temporary) == str(error.filename):
            error.filename = str(path)
        raise
    finally:
        temporary.unlink(missing_ok=True)
    _flush(path.parent)


def write_bytes(path: Path, content: bytes) -> None:
    """Write `content` to `path` in one step."""
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def write_text(path: Path, text: str) -> None:
    """Write `text` to `path` in one step, as UTF-8 and with its own line ends."""
    write_bytes(path, text.encode())


def check_room(path: Path, size: int) -> None:
    """Raise the OSError that explains why a file of `size` bytes could not be written, if the cause persists.

    The netCDF library hides the cause, so this function writes to the file itself: one byte at offset `size`, which
    shows a limit on file sizes, and some bytes at the end, which show a full disk. This destroys the file.
    """
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT, 0o644)
    try:
        os.pwrite(descriptor, b"\0", size)
        os.lseek(descriptor, 0, os.SEEK_END)
        for _ in range(_MARGIN // _BLOCK):
            os.write(descriptor, bytes(_BLOCK))
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _flush(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def abandoned(folder: Path) -> Iterator[tuple[Path, Path]]:
    """Yield each temporary file in `folder` whose writer has ended, with its target."""
    for entry in os.scandir(folder):
        name = _TEMPORARY.fullmatch(entry.name)
        if name and started(int(name["pid"])) != name["started"]:
            yield Path(entry.path), folder / name["target"]
