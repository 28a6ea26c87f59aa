"""Check that memory and disk suffice for the plans; format quantities with units."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import psutil

from vibsim.core.errors import Fault, InputError
from vibsim.plan import Plan
from vibsim.store.atomic import check_room


def check(plans: Sequence[Plan], results: Path) -> None:
    """Refuse plans that need more memory or disk than the machine has."""
    needed, free = _missing_bytes(plans, results), free_bytes(results)
    total = psutil.virtual_memory().total
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
    """Return the estimated size of the files that do not exist yet."""
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
    """Return a message that says why nothing can be written in `results`; empty if writing works."""
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
    """Return the memory for all concurrent jobs [MB]: the free memory, or the largest job's need if that is more."""
    largest = max((plan.memory for plan in plans), default=0)
    available: int = psutil.virtual_memory().available
    return max(available, largest) // 10**6 + 1


def size(number: float) -> str:
    """Return bytes as text: ``1.2 GB``."""
    for unit in ("B", "kB", "MB", "GB"):
        if number < 999.5:
            return f"{number:.3g} {unit}"
        number /= 1000.0
    return f"{number:.3g} TB"


def amount(number: float) -> str:
    """Return a count as text: ``960``, ``1.3e+06``."""
    return f"{number:.0f}" if number < 1e5 else f"{number:.2g}"


def duration(seconds: float) -> str:
    """Return seconds as text: ``0.4 s``, ``3.1 min``, ``2.5 h``."""
    for limit, factor, unit in ((100.0, 1.0, "s"), (6000.0, 60.0, "min"), (172800.0, 3600.0, "h")):
        if seconds < limit:
            return f"{seconds / factor:.1f} {unit}"
    return f"{seconds / 86400.0:.1f} d"
