"""Whether the machine has room for what is planned."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from vibsim.cli.sizes import size
from vibsim.core.errors import Fault, InputError
from vibsim.plan import Plan
from vibsim.store.atomic import check_room


def check(plans: Sequence[Plan], results: Path) -> None:
    """Refuse what does not fit.

    Raises
    ------
    InputError
        With what is needed and what is there.
    """
    needed, free, total = _missing_bytes(plans, results), free_bytes(results), _memory("MemTotal")
    problems = [
        f"{plan.key}: a job needs {size(plan.memory)} of memory, the machine has {size(total)}"
        for plan in plans
        if plan.memory > total
    ]
    if needed > free:
        problems = [f"the files need {size(needed)} of disk, {size(free)} are free"]
    if problems:
        raise InputError([Fault(str(results), 0, "", "", problems[0])])


def _missing_bytes(plans: Sequence[Plan], results: Path) -> int:
    """Return the estimated size of the files that are not there yet."""
    compared = (plan.analysis_bytes for plan in plans if not (results / plan.convergence).exists())
    return sum(compared) + sum(
        level.bytes * (shard.stop - shard.start) // plan.cases
        for plan in plans
        for level in plan.levels
        for shard in level.shards
        if not (results / shard.path).exists()
    )


def free_bytes(results: Path) -> int:
    """Return the free space of the disk of `results`, which need not exist yet."""
    folder = next(place for place in (results, *results.parents) if place.exists())
    return shutil.disk_usage(folder).free


def obstacle(results: Path) -> tuple[str, ...]:
    """Return a line that says why nothing can be written in `results`; none where something can."""
    probe = results / ".vibsim/room"
    try:
        check_room(probe, 0)
    except OSError as error:
        return (f"{results}: {error.strerror}",)
    finally:
        with suppress(OSError):
            probe.unlink()
    return ()


def megabytes(plans: Sequence[Plan]) -> int:
    """Return how much memory all jobs at once may take: what is free, but at least what the largest one needs."""
    largest = max((plan.memory for plan in plans), default=0)
    return max(_memory("MemAvailable"), largest) // 10**6 + 1


def _memory(name: str) -> int:
    """Return a number of ``/proc/meminfo`` in bytes."""
    for line in Path("/proc/meminfo").read_text().splitlines():
        key, _, value = line.partition(":")
        if key == name:
            return int(value.split()[0]) * 1024
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
