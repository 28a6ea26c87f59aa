"""Files that appear whole: a hidden temporary file beside the target, flushed, then renamed.

A reader sees the old file or the new one and nothing between, also after a crash or a power cut.
What a killed writer leaves behind is removed by the next one with the same target, or by a run that has no such target
any more.
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
"""Bytes that are written at a time, and in all, to find out whether a disk is full."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path to write to; rename it to `path`, whose folder is made, when the block ends well.

    It is a name of its own in the same folder, so that writers of one target do not meet.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    for left, target in abandoned(path.parent):
        if target == path:
            left.unlink(missing_ok=True)
    pid = os.getpid()
    owner = f"{pid}-{started(pid)}-{secrets.token_hex(4)}"
    temporary = path.with_name(f".{path.name}.{owner}{_SUFFIX}")
    try:
        yield temporary
        _flush(temporary)
        temporary.replace(path)
    except OSError as error:
        # what a full disk raises names no file, and the temporary one is no news
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
    """Write `text` to `path` in one step, as UTF-8 with the line ends it has."""
    write_bytes(path, text.encode())


def check_room(path: Path, size: int) -> None:
    """Raise what the system says to a file of `size` bytes that could not be written; nothing where it could be.

    Libraries keep the cause to themselves. It is found by writing: at the end that the file was to have, which shows a
    limit of its size, and some more behind what there is, which shows a full disk. The file is of no use afterwards.
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
    """Give each temporary file in `folder` whose writer has ended, and its target."""
    for entry in os.scandir(folder):
        found = _TEMPORARY.fullmatch(entry.name)
        if found and started(int(found["pid"])) != found["started"]:
            yield Path(entry.path), folder / found["target"]
