"""The manifest of a results folder: size, time, inode and digest of every file of an experiment, and what made it.

A job adds its files when it has made them, and a run that ends writes the whole anew, in order. A run compares it with
the folder (`vibsim.cli.run.changes`), and so does ``vibsim verify``. The manifest is data: a line begins with a digest
of itself and of the experiment's key, one of another form or of another experiment counts as not there, and the names
in it are those that vibsim itself gives.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from vibsim.core import regular_files
from vibsim.plan.jobs import DIGEST
from vibsim.store import seal
from vibsim.store.atomic import write_text

INDEX = ""
"""Key of the files over all experiments."""
OVER_ALL = ("index.html", "summary.csv")
"""Files of the index."""
BESIDE = ("figures", "tables")
"""Folders of a report, whose files only the report knows."""
_NAME = re.compile(
    r"level_\d{2,}\.nc|level_\d{2,}/shard_\d{4,}\.nc|convergence\.nc|best\.nc|summary\.(?:json|csv)"
    r"|(?:report|index)\.html|(?:figures|tables)/[^/\0.][^/\0]*"
)
_MACHINE = re.compile(r"[\x20-\x7e]{0,200}")
CHANGED = "its bytes are not those that were written"


class Entry(NamedTuple):
    """A file as it was made."""

    size: int
    time: int
    """Of the last change, in nanoseconds."""
    inode: int
    digest: str
    """SHA-256 of its content; of a sealed file that of its seal."""
    job: str
    """Digest of the job that made it; empty of the index."""
    machine: str
    """Where it was made: `machine`."""

    def fits(self, status: os.stat_result) -> bool:
        """Tell whether a file has the size, the time and the inode that it had when it was made."""
        return (status.st_size, status.st_mtime_ns, status.st_ino) == self[:3]


@cache
def machine() -> str:
    """Name this machine: its architecture, its processor and a digest of all that the processor says it can do."""
    found: dict[str, str] = {}
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            key, _, value = line.partition(":")
            found.setdefault(key.strip(), value.strip())
    name = found.get("model name") or found.get("CPU part", "unknown processor")
    features = found.get("flags") or found.get("Features", "")
    digest = hashlib.sha256(" ".join(sorted(features.split())).encode()).hexdigest()[:8]
    return f"{os.uname().machine}, {ascii(name)[1:-1][:100]}, features {digest}"


def add(results: Path, key: str, names: Iterable[str], job: str = "") -> None:
    """Add files that a job has just made; a report comes with all that it consists of.

    `key` is the folder of the experiment in `results`, or `INDEX`; `names` are paths within that folder; `job` is the
    digest of the job.
    """
    entries = {}
    for name in _whole(results / key, names):
        file = results / key / name
        digest = seal.stored_digest(file) if file.suffix == ".nc" else content(file)
        entries[name] = entry(file.lstat(), digest, job, machine())
    _append(results, key, entries)


def _whole(folder: Path, names: Iterable[str]) -> Iterator[str]:
    """Yield files, and behind a report those of its folders, which it has to itself."""
    for name in names:
        yield name
        if name == "report.html":
            beside = (path for part in BESIDE for path in sorted((folder / part).glob("[!.]*")))
            yield from (path.relative_to(folder).as_posix() for path in beside if path.is_file())


def withdraw(results: Path, key: str, names: Iterable[str]) -> None:
    """Take files off the record that a job is about to write; a job that is killed then leaves none that seems changed.

    With a report goes all that it consists of.
    """
    _append(results, key, dict.fromkeys(names))


def _append(results: Path, key: str, entries: Mapping[str, Entry | None]) -> None:
    # A line that a kill cut short ends here. What is not on record is compared with its seal, or made again.
    with suppress(OSError):
        regular_files.append(path(results, key), f"\n{_line(key, entries)}\n".encode())


def load(results: Path, key: str) -> dict[str, Entry]:
    """Return what is on record, the newest of each file; of figures and tables those of the newest report."""
    return read(results, key)[0]


def read(results: Path, key: str) -> tuple[dict[str, Entry], bool]:
    """Return what is on record, and whether every line is as it was written."""
    found: dict[str, Entry] = {}
    try:
        lines = path(results, key).read_bytes().split(b"\n")
    except OSError:
        return found, False
    is_whole = True
    for line in filter(None, lines):
        data = _data(key, line)
        if data is None:
            is_whole = False
            continue
        if "report.html" in data:
            found = {name: e for name, e in found.items() if not name.startswith(BESIDE)}
        for name, entry in data.items():
            if entry is None:
                found.pop(name, None)
            else:
                found[name] = entry
    return found, is_whole


def _data(key: str, line: bytes) -> dict[str, Entry | None] | None:
    """Return the entries of a line, None of what is withdrawn; None where it is not as it was written for this key."""
    digest, _, text = line.partition(b" ")
    if _digest(key, text) != digest:
        return None
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not (isinstance(data, dict) and all(map(_is_entry, data, data.values()))):
        return None
    return {name: Entry(*values) if values else None for name, values in data.items()}


def replace(results: Path, key: str, entries: Mapping[str, Entry]) -> None:
    """Write the whole record anew, in one line and in order, where it is not so already."""
    file, text = path(results, key), f"{_line(key, entries)}\n"
    with suppress(OSError):
        if file.read_bytes() != text.encode() if file.exists() else entries:
            write_text(file, text)


def content(file: Path) -> str:
    """Return the digest of a file, worked out from its bytes.

    Raises
    ------
    DamagedFileError
        When it should be sealed and is not as it was sealed.
    """
    if file.suffix == ".nc":
        seal.check(file)
        return seal.stored_digest(file)
    return regular_files.digest(file)


def entry(status: os.stat_result, digest: str, job: str = "", machine: str = "") -> Entry:
    """Return the entry of a file with this status; job and machine are empty where nobody knows them."""
    return Entry(status.st_size, status.st_mtime_ns, status.st_ino, digest, job, machine)


def path(results: Path, key: str) -> Path:
    """Return the file of a manifest."""
    return results / ".vibsim/made" / f"{key.replace('/', '.') or 'index'}.jsonl"


def _line(key: str, entries: Mapping[str, Entry | None]) -> str:
    text = json.dumps(dict(sorted(entries.items())), separators=(",", ":"))
    return f"{_digest(key, text.encode()).decode()} {text}"


def _digest(key: str, text: bytes) -> bytes:
    return hashlib.sha256(b"%b %b" % (key.encode(), text)).hexdigest().encode()


def _is_entry(name: str, values: Any) -> bool:
    match values:
        case None:
            return _NAME.fullmatch(name) is not None
        case [int(), int(), int(), str(digest), str(job), str(machine)]:
            known = all(type(number) is int and 0 <= number < 2**63 for number in values[:3])
            texts = DIGEST.fullmatch(digest) and (not job or DIGEST.fullmatch(job))
            return bool(known and texts and _MACHINE.fullmatch(machine) and _NAME.fullmatch(name))
    return False
