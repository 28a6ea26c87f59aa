"""Files of an experiment that it no longer asks for: of levels, of members and of a solution that were left out."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from vibsim.plan import Plan

_LEVEL = re.compile(r"level_\d{2,}")
_FILE = re.compile(r"level_\d{2,}\.nc|best\.nc")
_SHARD = re.compile(r"shard_\d{4,}\.nc")


def leftovers(plan: Plan, results: Path) -> list[Path]:
    """Return the files under names that vibsim gives, and that this experiment has not; links are nobody's."""
    wanted = {results / path for path in plan.files}
    return [path for path in _found(results / plan.key) if path not in wanted]


def _found(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.iterdir()) if folder.is_dir() else ():
        if path.is_symlink():
            continue
        if path.is_file() and _FILE.fullmatch(path.name):
            yield path
        elif path.is_dir() and _LEVEL.fullmatch(path.name):
            shards = sorted(path.iterdir())
            yield from (p for p in shards if _SHARD.fullmatch(p.name) and not p.is_symlink())


def remove(path: Path) -> None:
    """Remove a file, and the folder of its level when that is empty."""
    path.unlink(missing_ok=True)
    if _LEVEL.fullmatch(path.parent.name):
        # It is not empty while there is anything else in it.
        with suppress(OSError):
            path.parent.rmdir()
