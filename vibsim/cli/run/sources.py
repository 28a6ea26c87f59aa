"""Where the results of a file come from: two files of one name cannot have the same results folder.

A file is the same under every spelling of its path, and where it was moved or copied together with the results. One
that is no longer at its place gives its name to another.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from vibsim.core.errors import Fault, InputError
from vibsim.experiment.collection import ADHOC
from vibsim.plan import Plan
from vibsim.store.atomic import write_text

Source = tuple[str, str]
"""The file by its real path, and by its path from the results folder; one member of a sweep with its number."""


def claim(plans: Sequence[Plan], results: Path, *, dry_run: bool = False) -> None:
    """Refuse the results of other files; put down whose the results are from now on, unless in a dry run.

    Raises
    ------
    InputError
        With both files of every name that is taken.
    """
    known = _load(results)
    own = {plan.key: _source(plan, results) for plan in plans if plan.collection == ADHOC}
    faults = []
    for plan in plans:
        first = known.get(plan.key)
        if plan.key not in own or first is None or set(first) & set(own[plan.key]):
            continue
        if Path(_file(first[0])).exists():
            rule = f"{results / plan.key} has the results of another file of this name, {first[0]}"
            hint = "rename one of the two files, or choose another folder with --results"
            faults.append(Fault(plan.file, 0, "", "", rule, hint))
    if faults:
        raise InputError(faults)
    now = known | own
    if now != known and not dry_run:
        # Results on a read-only medium keep what they have.
        with suppress(OSError):
            write_text(_path(results), json.dumps(now, indent=1) + "\n")


def _source(plan: Plan, results: Path) -> Source:
    file = os.path.realpath(_file(plan.file))
    member = plan.file.removeprefix(_file(plan.file))
    return file + member, os.path.relpath(file, os.path.realpath(results)) + member


def _file(word: str) -> str:
    """Return the file in a word that may name one member of it."""
    name, at, case = word.rpartition("@")
    return name if at and case.isdigit() else word


def _path(results: Path) -> Path:
    return results / ".vibsim/sources.json"


def _load(results: Path) -> dict[str, Source]:
    try:
        data: Any = json.loads(_path(results).read_bytes())
    except (OSError, ValueError, RecursionError):
        return {}
    pairs = data.items() if isinstance(data, dict) else ()
    return {key: (found[0], found[1]) for key, found in pairs if _is_source(found)}


def _is_source(found: Any) -> bool:
    return (
        isinstance(found, list) and len(found) == 2 and all(isinstance(x, str) and x for x in found)
    )
