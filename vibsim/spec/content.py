"""The bytes of a user's files, never more of them than are allowed; imports no reader of YAML."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from vibsim.errors import Fault, InputError

MAX_BYTES = 2**20
"""Of an experiment file."""
MOST_BYTES = 2**26
"""Of a table beside it."""


def read_bytes(path: Path) -> bytes:
    """Return the content of the file at `path`.

    Raises
    ------
    InputError
        When it cannot be read, is no regular file (a pipe, a device, a folder) or is too large.
    """
    try:
        content = content_of(path, MAX_BYTES)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise _refusal(path, f"cannot be read ({reason})") from None
    if len(content) > MAX_BYTES:
        raise _refusal(path, f"must not be larger than {MAX_BYTES} bytes")
    return content


def content_of(path: Path, most: int) -> bytes:
    """Return the content of the file at `path`, of a longer one `most` bytes and one more.

    Raises
    ------
    OSError
        When it cannot be read.
    ValueError
        When it is no regular file.
    """
    # Without O_NONBLOCK, opening a pipe waits for its writer.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise ValueError("not a regular file")
        with os.fdopen(descriptor, "rb", closefd=False) as stream:
            return stream.read(most + 1)
    finally:
        os.close(descriptor)


def _refusal(path: Path, rule: str) -> InputError:
    return InputError([Fault(str(path), 0, "", "", rule)])
