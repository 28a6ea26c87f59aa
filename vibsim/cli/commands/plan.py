"""``vibsim check`` and ``vibsim plan``: validate experiments, and estimate the cost of a run."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from vibsim.cli import resources
from vibsim.cli.chosen_plans import plans_of, tell_notes
from vibsim.cli.failure import from_here
from vibsim.cli.jobs.common import chosen_results
from vibsim.cli.resources import amount, duration, size
from vibsim.core.processes import usable_cores
from vibsim.experiment.cost import PAGE_BYTES
from vibsim.plan import Plan
from vibsim.plan.forecast import RUN_SECONDS

_WIDTHS = (7, 12, 12, 7, 14, 10, 10, 10)
CORES = usable_cores()  # number of cores that `vibsim run` uses by default
SHORT = 1.0  # time below which a reference solution is not mentioned [s]
_HEAD = ("level", "steps", "kept every", "files", "member-steps", "disk", "memory", "time")


def check(options: Namespace) -> int:
    """Validate experiment files; print a line for each valid one."""
    for item in plans_of(options.experiments, options.settings):
        levels = ", ".join(str(level.level) for level in item.levels)
        tell_notes([item])
        print(f"{from_here(str(item.file))}: valid ({_members(item)}, levels {levels})")
    return 0


def plan(options: Namespace) -> int:
    """Print members, jobs, steps, memory, disk space and time; refuse plans that do not fit on this machine."""
    results = chosen_results(options)
    plans = plans_of(options.experiments, options.settings)
    tell_notes(plans)
    if options.json:
        print(json.dumps([_entry(item) for item in plans], indent=1))
    else:
        for item in plans:
            print(*_lines(item), "", sep="\n")
        if len(plans) > 1:
            print(_sum(plans, results))
    sys.stdout.flush()
    resources.check(plans, results)
    return 0


def _entry(item: Plan) -> dict[str, Any]:
    totals = {
        "jobs": len(item.batches) + 2 + bool(item.best),
        "member_steps": _steps(item),
        "bytes": item.bytes + PAGE_BYTES,
        "memory": item.memory,
        "seconds": item.seconds,
        "cpu_seconds": RUN_SECONDS + item.cpu_seconds,
        "wall_seconds": {
            str(cores): RUN_SECONDS + item.wall_seconds(cores) for cores in sorted({1, CORES})
        },
    }
    return {**asdict(item), "total": totals}


def _steps(item: Plan) -> int:
    return sum(level.member_steps for level in item.levels)


def _members(item: Plan) -> str:
    return "1 member" if item.cases == 1 else f"{item.cases} members"


def _solver_lines(item: Plan) -> Iterator[str]:
    """Yield the plan of a user's own solver: its levels with their sizes, and the resources of a job."""
    jobs, first = len(item.batches), item.batches[0]
    sizes: Mapping[str, Sequence[float]] = item.content["sizes"]
    yield f"{item.key}: {_members(item)}, {jobs} jobs of {item.content['solver']['text']}"
    yield _row(("level", *sizes))
    for level in item.levels:
        yield _row((str(level.level), *(f"{values[level.level]:g}" for values in sizes.values())))
    minutes = f", {first.runtime} min" if first.runtime else ""
    threads = "1 thread" if first.threads == 1 else f"{first.threads} threads"
    yield f"    each: {threads}, {size(first.memory)} of memory{minutes}"


def _lines(item: Plan) -> Iterator[str]:
    if item.has_solver:
        yield from _solver_lines(item)
        return
    schemes = "scheme" if len(item.schemes) == 1 else "schemes"
    yield f"{item.key}: {_members(item)}, {schemes} {', '.join(item.schemes)}"
    yield _row(_HEAD)
    for level in item.levels:
        numbers = map(str, (level.level, level.steps, level.every, len(level.shards)))
        costs = amount(level.member_steps), size(level.bytes), size(level.memory)
        yield _row((*numbers, *costs, duration(level.seconds)))
    yield f"    analysis: about {size(item.analysis_bytes)} of disk, {size(item.analysis_memory)} of memory"
    simulate = "1 simulate job" if len(item.batches) == 1 else f"{len(item.batches)} simulate jobs"
    yield (
        f"    all: {simulate}, {amount(_steps(item))} member-steps, about {size(item.bytes + PAGE_BYTES)} of disk, "
        f"{size(item.memory)} of memory in a job, {duration(item.seconds)} of one core"
    )
    if item.reference_seconds >= SHORT:
        yield f"    reference: about {duration(item.reference_seconds)}, as no exact solution is known"
    yield f"    with analysis and page: {_times([item])}"


def _row(cells: Sequence[str]) -> str:
    widths = [*_WIDTHS, *_WIDTHS[-1:] * len(cells)]
    return "".join(cell.rjust(width) for cell, width in zip(cells, widths, strict=False))


def _sum(plans: Sequence[Plan], results: Path) -> str:
    steps = sum(map(_steps, plans))
    files = sum(item.bytes + PAGE_BYTES for item in plans)
    return (
        f"{len(plans)} experiments: {amount(steps)} member-steps, about {size(files)} of disk "
        f"({size(resources.free_bytes(results))} free), {_times(plans)}"
    )


def _times(plans: Sequence[Plan]) -> str:
    """Return the CPU time and the wall time of a run of `plans` on this machine as text, with the start of the run."""
    cpu = RUN_SECONDS + sum(item.cpu_seconds for item in plans)
    # experiments run in parallel
    wall = RUN_SECONDS + max(
        *(item.wall_seconds(CORES) for item in plans), (cpu - RUN_SECONDS) / CORES
    )
    cores = "1 core" if CORES == 1 else f"{CORES} cores"
    return f"about {duration(cpu)} of CPU time, {duration(wall)} on {cores}"
