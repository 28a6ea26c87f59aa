"""How jobs read the levels: all files are checked first, then read range by range."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from vibsim.cli.jobs.common import read_all
from vibsim.plan import Plan

if TYPE_CHECKING:
    from vibsim.core.record import Record


def check_levels(plan: Plan, options: Namespace, results: Path) -> None:
    """Refuse where a level file is damaged or another job's."""
    from vibsim import store

    checks = {shard.path: partial(store.check, digest=shard.digest) for shard in plan.shards}
    read_all(options, results, checks)


def readers(plan: Plan, results: Path, stack: ExitStack) -> dict[int, Callable[[int, int], Record]]:
    """Return what reads a range of members of each level; the files were checked before."""
    from vibsim import store

    files = {
        level.level: [(results / shard.path, shard.digest) for shard in level.shards]
        for level in plan.levels
    }
    return {
        level: stack.enter_context(store.open_level(found)).read for level, found in files.items()
    }
