"""Plans kept on disk, so that a hundred experiment files do not slow the start.

An entry is keyed by the bytes of the experiment file and by the code of the whole package. An entry
that does not fit, or is damaged, is built again.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from vibsim.errors import Fault, InputError
from vibsim.plan import code
from vibsim.plan.choose import Choice
from vibsim.plan.jobs import Plan, from_json, to_json
from vibsim.plan.versions import DRAWING, NUMERICAL, versions
from vibsim.spec.content import read_bytes


def load(choice: Choice, results: Path | None = None) -> Plan:
    """Return the plan of an experiment file.

    Parameters
    ----------
    choice
        The file and its collection.
    results
        The results folder, which keeps the cache; None does without.

    Raises
    ------
    InputError
        When the file is refused.
    """
    key = _key(choice)
    entry = (
        results / ".vibsim/plans" / f"{choice.collection}.{choice.name}.json" if results else None
    )
    if entry and key and (text := _read(entry, key)):
        return from_json(text, choice.file)
    from vibsim import spec
    from vibsim.plan.build import build

    plan = build(spec.load(choice.file, collection=choice.collection))
    # A file that changed while it was read is not kept under the digest of the old bytes.
    if entry and key and key == _key(choice):
        _write(entry, key, to_json(plan))
    return plan


def load_all(choices: Iterable[Choice], results: Path | None = None) -> dict[str, Plan]:
    """Return the plans of several experiment files by their keys.

    Raises
    ------
    InputError
        With the faults of all files at once.
    """
    plans: dict[str, Plan] = {}
    faults: list[Fault] = []
    for choice in choices:
        try:
            plan = load(choice, results)
        except InputError as error:
            faults.extend(error.faults)
        else:
            plans[plan.key] = plan
    if faults:
        raise InputError(faults)
    return plans


def _key(choice: Choice) -> str:
    """Return what an entry must be made from; empty when the file cannot be read."""
    try:
        content = read_bytes(choice.file)
    except InputError:
        return ""
    libraries = versions(NUMERICAL + DRAWING)
    parts = (choice.collection, choice.name, code.everything(), repr(libraries), content)
    return _sha256(b"\0".join(p if isinstance(p, bytes) else p.encode() for p in parts))


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _read(entry: Path, key: str) -> str:
    """Return the text of an entry; empty when there is none, or it is another's, or damaged."""
    try:
        head, _, text = entry.read_bytes().partition(b"\n")
    except OSError:
        return ""
    if head != f"{key} {_sha256(text)}".encode():
        return ""
    return text.decode()


def _write(entry: Path, key: str, text: str) -> None:
    temporary = entry.with_name(f".{entry.name}.{os.getpid()}")
    # Results on a read-only medium have no cache; everything else works without one.
    with suppress(OSError):
        entry.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_text(f"{key} {_sha256(text.encode())}\n{text}")
        temporary.replace(entry)
