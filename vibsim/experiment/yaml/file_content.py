"""The bytes of a user's files, never more of them than are allowed; imports no reader of YAML."""

from __future__ import annotations

from pathlib import Path

from vibsim.core import regular_files
from vibsim.core.errors import Fault, InputError

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
        When it cannot be read, or is no regular file.
    """
    with regular_files.reading(path) as stream:
        return stream.read(most + 1)


def _refusal(path: Path, rule: str) -> InputError:
    return InputError([Fault(str(path), 0, "", "", rule)])
