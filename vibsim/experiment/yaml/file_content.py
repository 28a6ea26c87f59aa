"""Read the bytes of a user's files, up to a limit; does not import the YAML library."""

from __future__ import annotations

from pathlib import Path

from vibsim.core import regular_files
from vibsim.core.errors import Fault, InputError, likely

MAX_BYTES = 2**20  # largest size of an experiment file [bytes]
MOST_BYTES = 2**26  # largest size of a table [bytes]


def read_bytes(path: Path, most: int = MAX_BYTES) -> bytes:
    """Return the content of the file at `path`, by default an experiment file.

    Raises `InputError` if it cannot be read, is not a regular file (but a pipe, a device, a folder), or is too long.
    """
    size = f"{most} bytes" if most == MAX_BYTES else f"{most >> 20} MiB"
    rule, hint = f"must not be larger than {size}", ""
    try:
        content = content_of(path, most)
        if len(content) <= most:
            return content
    except (OSError, ValueError) as error:
        rule = f"cannot be read ({getattr(error, 'strerror', None) or error})"
        hint = _similar_name(path) if isinstance(error, FileNotFoundError) else ""
    raise InputError([Fault(str(path), 0, "", "", rule, hint)])


def _similar_name(path: Path) -> str:
    """Return a hint with a similar name of an existing file with the same ending; empty if there is none."""
    try:
        stems = sorted(file.stem for file in path.parent.iterdir() if file.suffix == path.suffix)
    except OSError:
        return ""
    # endings are left out, because a common ending would make all names similar
    hint = likely(path.stem, stems)
    return f"{hint[:-2]}{path.suffix}'?" if hint else ""


def content_of(path: Path, most: int) -> bytes:
    """Return the content of the file at `path`, at most its first `most` + 1 bytes.

    Raises `OSError` if it cannot be read, or is not a regular file.
    """
    with regular_files.reading(path) as stream:
        return stream.read(most + 1)
