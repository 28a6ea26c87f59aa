"""The bytes of a user's files, never more of them than are allowed; imports no reader of YAML."""

from __future__ import annotations

from pathlib import Path

from vibsim.core import regular_files
from vibsim.core.errors import Fault, InputError, likely

MAX_BYTES = 2**20
"""Of an experiment file."""
MOST_BYTES = 2**26
"""Of a table beside it."""


def read_bytes(path: Path, most: int = MAX_BYTES) -> bytes:
    """Return the content of the file at `path`, by default an experiment file.

    InputError when it cannot be read, is no regular file (a pipe, a device, a folder) or has more than `most` bytes.
    """
    size = f"{most} bytes" if most == MAX_BYTES else f"{most >> 20} MiB"
    rule, hint = f"must not be larger than {size}", ""
    try:
        content = content_of(path, most)
        if len(content) <= most:
            return content
    except (OSError, ValueError) as error:
        rule = f"cannot be read ({getattr(error, 'strerror', None) or error})"
        hint = _alike(path) if isinstance(error, FileNotFoundError) else ""
    raise InputError([Fault(str(path), 0, "", "", rule, hint)])


def _alike(path: Path) -> str:
    """Name a file of the same kind beside one that is not there, if its name is near; empty else."""
    try:
        stems = sorted(file.stem for file in path.parent.iterdir() if file.suffix == path.suffix)
    except OSError:
        return ""
    # an ending that both have makes no names alike
    hint = likely(path.stem, stems)
    return f"{hint[:-2]}{path.suffix}'?" if hint else ""


def content_of(path: Path, most: int) -> bytes:
    """Return the content of the file at `path`, of a longer one `most` bytes and one more.

    OSError where it cannot be read, or is no regular file.
    """
    with regular_files.reading(path) as stream:
        return stream.read(most + 1)
