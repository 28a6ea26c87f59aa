"""The record of what was made: size, time, inode and digest of every file of an experiment.

A job adds its files when it has made them; a run compares them with the folder (`vibsim.cli.run.changes`). The record
is data: a line of another form counts as not there, and the names in it are those that vibsim itself gives.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from vibsim.core import regular_files
from vibsim.store import seal
from vibsim.store.atomic import write_text

INDEX = ""
"""Key of the files over all experiments."""
BESIDE = ("figures", "tables")
"""Folders of a report, whose files only the report knows."""
_NAME = re.compile(
    r"level_\d{2,}\.nc|level_\d{2,}/shard_\d{4,}\.nc|convergence\.nc|best\.nc|summary\.(?:json|csv)"
    r"|(?:report|index)\.html|(?:figures|tables)/[^/\0.][^/\0]*"
)
_DIGEST = re.compile(r"[0-9a-f]{64}")


class Entry(NamedTuple):
    """A file as it was made."""

    size: int
    time: int
    """Of the last change, in nanoseconds."""
    inode: int
    digest: str
    """SHA-256 of its content; of a sealed file that of its seal."""

    def fits(self, status: os.stat_result) -> bool:
        """Tell whether a file has the size, the time and the inode that it had when it was made."""
        return (status.st_size, status.st_mtime_ns, status.st_ino) == self[:3]


def add(results: Path, key: str, names: Iterable[str]) -> None:
    """Add files that a job has just made; a report comes with all that it consists of.

    Parameters
    ----------
    results
        The results folder.
    key
        Folder of the experiment within it, or `INDEX`.
    names
        Paths of the files within that folder.
    """
    entries = {name: _made(results / key / name) for name in names}
    path = _path(results, key)
    # One write in append mode: jobs at the same time do not mix, and a line that a kill cut short ends here.
    line = f"\n{_text(entries)}\n".encode()
    # What is not on record is compared with its seal, or made again.
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = regular_files.own(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
        try:
            os.write(descriptor, line)
        finally:
            os.close(descriptor)


def load(results: Path, key: str) -> dict[str, Entry]:
    """Return what is on record, the newest of each file; of figures and tables those of the newest report."""
    found: dict[str, Entry] = {}
    try:
        lines = _path(results, key).read_bytes().splitlines()
    except OSError:
        return found
    for entries in map(_read, lines):
        if "report.html" in entries:
            found = {name: e for name, e in found.items() if not name.startswith(BESIDE)}
        found |= entries
    return found


def replace(results: Path, key: str, entries: Mapping[str, Entry]) -> None:
    """Write the whole record anew."""
    with suppress(OSError):
        write_text(_path(results, key), f"{_text(entries)}\n")


def content(path: Path) -> str:
    """Return the digest of a file, worked out from its bytes.

    Raises
    ------
    DamagedFileError
        When it should be sealed and is not as it was sealed.
    """
    if path.suffix == ".nc":
        seal.check(path)
        return seal.stored_digest(path)
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _made(path: Path) -> Entry:
    digest = seal.stored_digest(path) if path.suffix == ".nc" else content(path)
    return entry(path.lstat(), digest)


def entry(status: os.stat_result, digest: str) -> Entry:
    """Return the entry of a file with this status."""
    return Entry(status.st_size, status.st_mtime_ns, status.st_ino, digest)


def _path(results: Path, key: str) -> Path:
    return results / ".vibsim/made" / f"{key.replace('/', '.') or 'index'}.jsonl"


def _text(entries: Mapping[str, Entry]) -> str:
    return json.dumps(entries, separators=(",", ":"))


def _read(line: bytes) -> dict[str, Entry]:
    try:
        data = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    if not isinstance(data, dict) or not all(map(_is_entry, data, data.values())):
        return {}
    return {name: Entry(*values) for name, values in data.items()}


def _is_entry(name: str, values: Any) -> bool:
    return (
        isinstance(values, list)
        and len(values) == len(Entry._fields)
        and all(type(value) is int and 0 <= value < 2**63 for value in values[:3])
        and isinstance(values[3], str)
        and _DIGEST.fullmatch(values[3]) is not None
        and _NAME.fullmatch(name) is not None
    )
