"""Ownership of a results folder: one run at a time, and one experiment file for each name.

The lock belongs to an open descriptor, so it vanishes with the last process that holds it, however that ends. Snakemake
inherits the descriptor: if only the run is killed, the orphaned Snakemake still holds the folder.

Two files of the same name cannot share results. A file is the same under every spelling of its path, and after it was
moved or copied together with the results. If a file no longer exists, another one may take its name.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import json
import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from vibsim.cli import supervise
from vibsim.core import regular_files
from vibsim.core.errors import Fault, InputError, VibsimError
from vibsim.experiment.collection import ADHOC
from vibsim.plan import Plan
from vibsim.store.atomic import write_text

Source = tuple[str, str]
"""Real path of an experiment file, and its path relative to the results folder; a single member adds ``@`` and its
number."""

_INHERITED = "VIBSIM_LOCK"
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)


def hold(results: Path) -> int:
    """Wait until no other run works in `results`, lock it until this process ends, and return the lock's descriptor.

    Raises VibsimError where the folder cannot be written, or its file system has no locks, so that runs could not be
    kept apart.
    """
    try:
        return _hold(results)
    except OSError as error:
        if error.errno in _NO_LOCKS:
            rule = "its file system has no file locks (flock), which keep two runs apart"
            text = f"{results}: {rule}; choose a folder on another one with --results"
        else:
            text = f"{results}: cannot be written ({error.strerror})"
        raise VibsimError(text) from error


def _hold(results: Path) -> int:
    path = results / ".vibsim/lock"
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor = regular_files.descriptor(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW)
    if os.environ.get(_INHERITED) == _identity(descriptor):
        return descriptor
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        holder = os.pread(descriptor, 32, 0).decode().strip() or "unknown"
        text = f"vibsim: waiting for another run in {results} (process {holder})"
        print(text, file=sys.stderr, flush=True)
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    # never write to a file with another hard link: it may be any file of the user
    if os.fstat(descriptor).st_nlink == 1:
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"{supervise.known_pid()}\n".encode(), 0)
    return descriptor


def inherited(descriptor: int) -> dict[str, str]:
    """Return the environment variable that tells a child that it has inherited the lock."""
    return {_INHERITED: _identity(descriptor)}


def _identity(descriptor: int) -> str:
    status = os.fstat(descriptor)
    return f"{status.st_dev}:{status.st_ino}"


def claim(plans: Sequence[Plan], results: Path, *, dry_run: bool = False) -> None:
    """Refuse all names that belong to other files, and record the files of these plans, except in a dry run."""
    record = results / ".vibsim/sources.json"
    known = _load(record)
    sources = {plan.key: _source(plan, results) for plan in plans if plan.collection == ADHOC}
    faults = []
    for plan in plans:
        first = known.get(plan.key)
        if plan.key not in sources or first is None or set(first) & set(sources[plan.key]):
            continue
        if Path(_file(first[0])).exists():
            rule = f"{results / plan.key} has the results of another file of this name, {first[0]}"
            hint = "rename one of the two files, or choose another folder with --results"
            faults.append(Fault(plan.file, 0, "", "", rule, hint))
    if faults:
        raise InputError(faults)
    now = known | sources
    if now != known and not dry_run:
        # a read-only results folder keeps its record
        with suppress(OSError):
            write_text(record, _text(now))


def _source(plan: Plan, results: Path) -> Source:
    file = os.path.realpath(_file(plan.file))
    member = plan.file.removeprefix(_file(plan.file))
    return file + member, os.path.relpath(file, os.path.realpath(results)) + member


def _file(word: str) -> str:
    """Return the file named by a command-line word, without ``@`` and the number of a member."""
    name, at, case = word.rpartition("@")
    return name if at and case.isdigit() else word


def _load(record: Path) -> dict[str, Source]:
    """Return the recorded sources by plan key; none if the record is damaged."""
    try:
        text = record.read_text(encoding="utf-8")
        known = {
            key: (str(file), str(same)) for key, (file, same) in json.loads(text)["sources"].items()
        }
    except (OSError, ValueError, RecursionError, KeyError, TypeError, AttributeError):
        return {}
    return known if text == _text(known) else {}


def _text(sources: Mapping[str, Source]) -> str:
    digest = hashlib.sha256(json.dumps(sources).encode()).hexdigest()
    return json.dumps({"digest": digest, "sources": sources}, indent=1) + "\n"
