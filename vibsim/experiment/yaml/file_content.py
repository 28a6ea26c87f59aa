"""The bytes of a user's files, never more of them than are allowed; imports no reader of YAML."""

from __future__ import annotations

from pathlib import Path

from vibsim.core import regular_files
from vibsim.core.errors import Fault, InputError

MAX_BYTES = 2**20
"""Of an experiment file."""
MOST_BYTES = 2**26
"""Of a table beside it."""


def read_bytes(path: Path, most: int = MAX_BYTES) -> bytes:
    """Return the content of the file at `path`, by default an experiment file.

    InputError when it cannot be read, is no regular file (a pipe, a device, a folder) or has more than `most` bytes.
    """
    size = f"{most} bytes" if most == MAX_BYTES else f"{most >> 20} MiB"
    rule = f"must not be larger than {size}"
    try:
        content = content_of(path, most)
        if len(content) <= most:
            return content
    except (OSError, ValueError) as error:
        rule = f"cannot be read ({getattr(error, 'strerror', None) or error})"
    raise InputError([Fault(str(path), 0, "", "", rule)])


def content_of(path: Path, most: int) -> bytes:
    """Return the content of the file at `path`, of a longer one `most` bytes and one more.

    OSError where it cannot be read, or is no regular file.
    """
    with regular_files.reading(path) as stream:
        return stream.read(most + 1)
