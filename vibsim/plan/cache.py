"""Plans kept on disk, so that a hundred experiment files do not slow the start.

An entry is keyed by the bytes of the experiment file and by the code of the whole package, and it knows the bytes of
every table that the file names. An entry that does not fit, or is damaged, is built again.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from vibsim.errors import Fault, InputError, VibsimError
from vibsim.plan import code
from vibsim.plan.choose import Choice
from vibsim.plan.jobs import Plan, from_json, to_json
from vibsim.plan.versions import DRAWING, NUMERICAL, versions
from vibsim.spec.content import MOST_BYTES, content_of, read_bytes

if TYPE_CHECKING:
    from vibsim.spec import Experiment

Resolver = Callable[["Experiment"], "Experiment"]
"""Fills in the levels of an experiment that names a tolerance instead; it runs a pilot, which a plan cannot."""


def load(choice: Choice, results: Path | None = None, resolve: Resolver | None = None) -> Plan:
    """Return the plan of an experiment file, or of one member of its sweep.

    Parameters
    ----------
    choice
        The file and its collection, and the member where one alone is wanted.
    results
        The results folder, which keeps the cache; None does without.
    resolve
        What chooses the levels of an experiment with a tolerance.

    Raises
    ------
    InputError
        When the file is refused.
    """
    key = _key(choice)
    entry = _entry(choice, results) if results else None
    if entry and key and (text := _read(entry, key)):
        kept = from_json(text, _word(choice))
        if _has_inputs(kept, choice):
            return kept
    from vibsim.plan.build import build

    plan = replace(build(_experiment(choice, resolve)), file=_word(choice))
    # A file that changed while it was read is not kept under the digest of the old bytes.
    if entry and key and key == _key(choice) and _has_inputs(plan, choice):
        _write(entry, key, to_json(plan))
    return plan


def _experiment(choice: Choice, resolve: Resolver | None) -> Experiment:
    from vibsim import spec

    experiment = spec.load(choice.file, collection=choice.collection)
    wanted = experiment if choice.case is None else experiment.alone(choice.case)
    if experiment.levels:
        return wanted
    if resolve is None:
        raise VibsimError(f"{choice.file}: nothing is there to choose levels for a tolerance")
    # The ladder is that of the whole sweep, so that a member alone has the numbers that it has there.
    return wanted.with_levels(resolve(experiment).levels)


def load_all(
    choices: Iterable[Choice], results: Path | None = None, resolve: Resolver | None = None
) -> dict[str, Plan]:
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
            plan = load(choice, results, resolve)
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
    parts = (
        choice.collection,
        choice.name,
        str(choice.case),
        code.everything(),
        repr(libraries),
        content,
    )
    return _sha256(b"\0".join(p if isinstance(p, bytes) else p.encode() for p in parts))


def _has_inputs(plan: Plan, choice: Choice) -> bool:
    """Tell whether every table is the file that the plan was made from."""
    for path, digest in plan.inputs:
        try:
            content = content_of(choice.file.parent / path, MOST_BYTES)
        except (OSError, ValueError):
            return False
        if _sha256(content) != digest:
            return False
    return True


def _word(choice: Choice) -> str:
    """Return how the experiment is named on the command line of a job."""
    return str(choice.file) if choice.case is None else f"{choice.file}@{choice.case}"


def _entry(choice: Choice, results: Path) -> Path:
    member = "" if choice.case is None else f"@{choice.case}"
    return results / ".vibsim/plans" / f"{choice.collection}.{choice.name}{member}.json"


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
