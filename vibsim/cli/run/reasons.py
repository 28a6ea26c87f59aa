"""Why jobs run again, in words: ``model.w: 2.0 -> 2.5: levels 7 to 11, analysis, report``.

Snakemake knows that a digest changed, but not what the digest is of. The results say what they were made from.
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
_SHOWN = 3
"""So many changes are named."""
_LEVEL = re.compile(r"/level_(\d+)(?:/shard_\d+)?\.nc$")
_DONE = {"analyse": "analysis", "extrapolate": "extrapolated solution"}
"""What a job makes, where it has another name than the job."""


def why(plan: Plan, results: Path) -> str:
    """Say what changed since the results of an experiment were made; empty where that is not known."""
    if not (results / plan.key).is_dir():
        return NEW
    try:
        summary = read_json(results / plan.summary, name=plan.key)
    except FileError:
        return "not finished yet"
    if summary.get("digest") == plan.analysis:
        titles = (shown(title) for title in (summary.get("title"), plan.title))
        title = Change("title", *titles)
        return "" if title.old == title.new else str(title)
    from vibsim.store.reading import read_provenance

    try:
        made = read_provenance(results / plan.convergence)
    except FileError:
        return "not finished yet"
    return _what_differs(plan, made)


def _what_differs(plan: Plan, made: Mapping[str, Any]) -> str:
    found = differences(made["experiment"], analysed(plan.content))
    if not found:
        found = versions(plan, made)
    if not found:
        before, now = (
            {set_options([text]).strip(): "given" for text in texts}
            for texts in (made.get("settings", ()), plan.settings)
        )
        found = differences(before, now)
    if not found:
        solver = "the solver, its inputs or " if plan.has_solver else ""
        own = ", ".join(kind for _, kind, _ in plan.packages)
        return f"{solver}the code of {own + ' or of ' if own else ''}vibsim changed"
    rest = [f"{len(found) - _SHOWN} more changes"] if len(found) > _SHOWN + 1 else []
    named = found[:_SHOWN] if rest else found
    return "; ".join([*map(str, named), *rest])


def versions(plan: Plan, made: Mapping[str, Any]) -> list[Change]:
    """Return the versions that are others now than those that a result was made with (its provenance)."""
    # an unknown version says nothing, and no record of it is no change
    now = provenance(plan, {})["versions"]
    match made.get("versions"):
        case dict() as before:
            return differences(before, {key: now.get(key, before[key]) for key in before})
    return []


def in_words(jobs: Sequence[Job], plans: Sequence[Plan], results: Path) -> Iterator[str]:
    """Yield a line for each experiment with jobs, why they are to run and what they make; below it the jobs."""
    known = {plan.key: plan for plan in plans}
    for folder in dict.fromkeys(job.folder for job in jobs):
        own = [job for job in jobs if job.folder == folder]
        if folder in known:
            reason = why(known[folder], results) or "files are missing or out of date"
            yield f"{folder}: {reason}: {', '.join(what(own))}"
        yield from (f"  {job}" for job in own)


def what(jobs: Sequence[Job]) -> list[str]:
    """Say what jobs of one experiment make: ``levels 7 to 11``, ``analysis``, ``report``."""
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
