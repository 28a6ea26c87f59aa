"""Explain why jobs run again: ``model.w: 2.0 -> 2.5: levels 7 to 11, analysis, report``.

Snakemake knows that a digest changed, but not which of its inputs did. The provenance in the results shows that.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from vibsim.cli.jobs.common import provenance
from vibsim.cli.run.snakemake import Job
from vibsim.cli.setting_changes import Change, differences, shown
from vibsim.core.errors import FileError
from vibsim.core.set_option import set_options
from vibsim.plan import Plan
from vibsim.plan.digests import analysed
from vibsim.store import read_json

NEW = "not made yet"
_SHOWN = 3  # number of changes that are listed
_LEVEL = re.compile(r"/level_(\d+)(?:/shard_\d+)?\.nc$")
_DONE = {"analyse": "analysis", "extrapolate": "extrapolated solution"}
"""Names of the products of jobs, where they differ from the rule name."""


def why(plan: Plan, results: Path) -> str:
    """Return what changed since the results of an experiment were made; empty if unknown."""
    if not (results / plan.key).is_dir():
        return NEW
    try:
        summary = read_json(results / plan.summary, name=plan.key)
    except FileError:
        return "not finished yet"
    if summary.get("digest") == plan.analysis:
        title = Change("title", shown(summary.get("title")), shown(plan.title))
        return "" if title.old == title.new else str(title)
    from vibsim.store.reading import read_provenance

    try:
        made = read_provenance(results / plan.convergence)
    except FileError:
        return "not finished yet"
    return _changes(plan, made)


def _changes(plan: Plan, made: Mapping[str, Any]) -> str:
    changes = differences(made["experiment"], analysed(plan.content))
    if not changes:
        changes = versions(plan, made)
    if not changes:
        before, now = (
            {set_options([text]).strip(): "given" for text in texts}
            for texts in (made.get("settings", ()), plan.settings)
        )
        changes = differences(before, now)
    if not changes:
        solver = "the solver, its inputs or " if plan.has_solver else ""
        packages = ", ".join(kind for _, kind, _ in plan.packages)
        return f"{solver}the code of {packages + ' or of ' if packages else ''}vibsim changed"
    more = [f"{len(changes) - _SHOWN} more changes"] if len(changes) > _SHOWN + 1 else []
    listed = changes[:_SHOWN] if more else changes
    return "; ".join([*map(str, listed), *more])


def versions(plan: Plan, made: Mapping[str, Any]) -> list[Change]:
    """Return the library versions that changed since a result was made, from its provenance `made`."""
    # an unknown or unrecorded version does not count as changed
    now = provenance(plan, {})["versions"]
    match made.get("versions"):
        case dict() as before:
            return differences(before, {key: now.get(key, before[key]) for key in before})
    return []


def in_words(jobs: Sequence[Job], plans: Sequence[Plan], results: Path) -> Iterator[str]:
    """Yield a line for each experiment, with the reason for its jobs and what they make, and below it the jobs."""
    known = {plan.key: plan for plan in plans}
    for folder in dict.fromkeys(job.folder for job in jobs):
        subset = [job for job in jobs if job.folder == folder]
        if folder in known:
            reason = why(known[folder], results) or "files are missing or out of date"
            yield f"{folder}: {reason}: {', '.join(products(subset))}"
        yield from (f"  {job}" for job in subset)


def products(jobs: Sequence[Job]) -> list[str]:
    """Return what the jobs of one experiment make: ``levels 7 to 11``, ``analysis``, ``report``."""
    levels = sorted(
        {
            int(match[1])
            for job in jobs
            for path in job.outputs
            if job.simulates and (match := _LEVEL.search(path))
        }
    )
    others = dict.fromkeys(_DONE.get(job.rule, job.rule) for job in jobs if not job.simulates)
    head = f"level{'s' if len(levels) > 1 else ''} {shown(levels)}"
    return [head, *others] if levels else list(others)
