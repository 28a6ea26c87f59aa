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

    `key` is the folder of the experiment in `results`, or `INDEX`; `names` are paths within that folder.
    """
    entries = {}
    for name in names:
        file = results / key / name
        digest = seal.stored_digest(file) if file.suffix == ".nc" else content(file)
        entries[name] = entry(file.lstat(), digest)
    # A line that a kill cut short ends here. What is not on record is compared with its seal, or made again.
    with suppress(OSError):
        regular_files.append(_path(results, key), f"\n{_text(entries)}\n".encode())


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
    match values:
        case [*numbers, str(digest)] if len(numbers) == len(Entry._fields) - 1:
            known = all(type(number) is int and 0 <= number < 2**63 for number in numbers)
            return bool(known and _DIGEST.fullmatch(digest) and _NAME.fullmatch(name))
    return False
