"""The manifest of a results folder: size, time, inode, digest, job and machine of every file of an experiment.

A job appends its files when it has made them, and a run rewrites the manifest, sorted, when it ends. A run compares it
with the folder (`vibsim.cli.run.changes`), and so does ``vibsim verify``. The manifest is untrusted data: each line
begins with a digest of its text and of the experiment's key, a line that is invalid or of another experiment is
ignored, and only file names of vibsim are accepted.
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

INDEX = ""  # key of the files that cover all experiments
OVER_ALL = ("index.html", "summary.csv")  # files of the index
BESIDE = ("figures", "tables")  # folders of a report; the plan does not know the files in them
_NAME = re.compile(
    r"level_\d{2,}\.nc|level_\d{2,}/shard_\d{4,}\.nc|convergence\.nc|best\.nc|summary\.(?:json|csv)"
    r"|(?:report|index)\.html|(?:figures|tables)/[^/\0.][^/\0]*"
)
_MACHINE = re.compile(r"[\x20-\x7e]{0,200}")
CHANGED = "its bytes are not those that were written"


class Entry(NamedTuple):
    """The state of a file when it was made."""

    size: int
    time: int  # time of the last change [ns]
    inode: int
    digest: str  # SHA-256 of the content; for a sealed netCDF file the one in its seal
    job: str  # digest of the job that made the file; empty for the index
    machine: str  # the machine that made the file, as `machine` returns it

    def fits(self, status: os.stat_result) -> bool:
        """Tell whether a file still has the size, time and inode that it had when it was made."""
        return (status.st_size, status.st_mtime_ns, status.st_ino) == self[:3]


@cache
def machine() -> str:
    """Return a description of this machine: architecture, processor, and a digest of the processor's feature flags."""
    info: dict[str, str] = {}
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            key, _, value = line.partition(":")
            info.setdefault(key.strip(), value.strip())
    name = info.get("model name") or info.get("CPU part", "unknown processor")
    features = info.get("flags") or info.get("Features", "")
    digest = hashlib.sha256(" ".join(sorted(features.split())).encode()).hexdigest()[:8]
    return f"{os.uname().machine}, {ascii(name)[1:-1][:100]}, features {digest}"


def add(results: Path, key: str, names: Iterable[str], job: str = "") -> None:
    """Add files that a job has just made; with a report also its figures and tables.

    `key` is the folder of the experiment in `results`, or `INDEX`; `names` are paths within that folder; `job` is the
    digest of the job.
    """
    entries = {}
    for name in _with_report_files(results / key, names):
        file = results / key / name
        digest = seal.stored_digest(file) if file.suffix == ".nc" else content(file)
        entries[name] = entry(file.lstat(), digest, job, machine())
    _append(results, key, entries)


def _with_report_files(folder: Path, names: Iterable[str]) -> Iterator[str]:
    """Yield `names`, and after a report the files in its folders."""
    for name in names:
        yield name
        if name == "report.html":
            paths = (path for part in BESIDE for path in sorted((folder / part).glob("[!.]*")))
            yield from (path.relative_to(folder).as_posix() for path in paths if path.is_file())


def withdraw(results: Path, key: str, names: Iterable[str]) -> None:
    """Remove the entries of files that a job is about to write, so that no file of a killed job seems changed.

    With a report, the entries of its figures and tables are removed too.
    """
    _append(results, key, dict.fromkeys(names))


def _append(results: Path, key: str, entries: Mapping[str, Entry | None]) -> None:
    # The leading newline ends a line that a kill cut short. A file without an entry is checked by its seal or remade.
    with suppress(OSError):
        regular_files.append(path(results, key), f"\n{_line(key, entries)}\n".encode())


def load(results: Path, key: str) -> dict[str, Entry]:
    """Return the newest entry of each file; figures and tables only of the newest report."""
    return read(results, key)[0]


def read(results: Path, key: str) -> tuple[dict[str, Entry], bool]:
    """Return the entries (see `load`), and whether every line of the manifest is intact."""
    entries: dict[str, Entry] = {}
    try:
        lines = path(results, key).read_bytes().split(b"\n")
    except OSError:
        return entries, False
    is_intact = True
    for line in filter(None, lines):
        data = _data(key, line)
        if data is None:
            is_intact = False
            continue
        if "report.html" in data:
            entries = {name: e for name, e in entries.items() if not name.startswith(BESIDE)}
        for name, entry in data.items():
            if entry is None:
                entries.pop(name, None)
            else:
                entries[name] = entry
    return entries, is_intact


def _data(key: str, line: bytes) -> dict[str, Entry | None] | None:
    """Return the entries of a line, None for withdrawn files; return None if the line is invalid or has another key."""
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
    """Rewrite the manifest as one line, sorted by name, unless it is the same already."""
    file, text = path(results, key), f"{_line(key, entries)}\n"
    with suppress(OSError):
        if file.read_bytes() != text.encode() if file.exists() else entries:
            write_text(file, text)


def content(file: Path) -> str:
    """Return the digest of a file, computed from its bytes.

    Raises DamagedFileError where a netCDF file does not match its seal.
    """
    if file.suffix == ".nc":
        seal.check(file)
        return seal.stored_digest(file)
    return regular_files.digest(file)


def entry(status: os.stat_result, digest: str, job: str = "", machine: str = "") -> Entry:
    """Return the entry of a file with this status; job and machine are empty if unknown."""
    return Entry(status.st_size, status.st_mtime_ns, status.st_ino, digest, job, machine)


def path(results: Path, key: str) -> Path:
    """Return the path of the manifest of an experiment."""
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
