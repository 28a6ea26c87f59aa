"""How jobs read the levels: all files are checked first, then read range by range."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from vibsim.cli.jobs.common import read_all
from vibsim.plan import Plan

if TYPE_CHECKING:
    from vibsim.core.record import Record


@contextmanager
def open_levels(
    plan: Plan, options: Namespace, results: Path
) -> Iterator[dict[int, Callable[[int, int], Record]]]:
    """Open all level files; yield what reads a range of members of each level.

    Raises
    ------
    VibsimError
        Where files are damaged or another job's.
    """
    from vibsim import store

    checks = {shard.path: partial(store.check, digest=shard.digest) for shard in plan.shards}
    read_all(options, results, checks)
    with ExitStack() as stack:
        yield {
            level.level: stack.enter_context(
                store.open_level([(results / shard.path, shard.digest) for shard in level.shards])
            ).read
            for level in plan.levels
        }
