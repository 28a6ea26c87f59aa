"""``vibsim run``: from experiment files to verdicts, again and again until nothing is left to do."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from vibsim.cli import deleted, lock, outcome, room, workflow
from vibsim.cli.common import results_folder
from vibsim.cli.plans import plans_of
from vibsim.cli.progress import Progress, describe
from vibsim.cli.simulate import is_made
from vibsim.errors import VibsimError
from vibsim.plan import Plan, checkout

_STAGES = 4
"""How often the workflow is started at most: once, and once for each kind of file found bad."""


def run(options: Namespace) -> int:
    """Run the chosen experiments and show every verdict."""
    root, results = checkout(), results_folder(options)
    # Everything is validated before anything is written but the cache of plans.
    plans = plans_of(options.experiments, results if results.is_dir() else None)
    room.check(plans, results)
    arguments = ["--cores", str(options.cores or len(os.sched_getaffinity(0)))]
    arguments += ["--resources", f"mem_mb={room.megabytes(plans)}"]
    if options.dry_run:
        return _dry_run(plans, results, root, arguments, options.json)
    _prepare(results)
    held = lock.hold(results)
    progress = Progress()
    deleted.take(results)
    jobs: list[workflow.Job] = []
    for _ in range(_STAGES):
        ended = workflow.run(plans, results, root, held, arguments, progress)
        findings = outcome.collect(plans, results)
        progress.clear()
        jobs.extend(ended.jobs)
        notes = deleted.take(results)
        for note in notes:
            print(f"vibsim: deleted, to be made again: {note}", file=sys.stderr)
        if not notes:
            break
    return _show(options, findings, ended, results, bool(jobs))


def _dry_run(
    plans: Sequence[Plan], results: Path, root: Path, arguments: list[str], as_json: bool
) -> int:
    """Show the jobs; a results folder that does not exist yet is not made for that."""
    with ExitStack() as stack:
        if not results.exists():
            results = Path(stack.enter_context(TemporaryDirectory(prefix="vibsim-")))
        _prepare(results)
        held = lock.hold(results)
        return _show_jobs(plans, results, root, held, [*arguments, "--dry-run"], as_json)


def _prepare(results: Path) -> None:
    try:
        (results / ".vibsim").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise VibsimError(f"{results}: cannot be written ({error.strerror})") from error


def _show_jobs(
    plans: Sequence[Plan], results: Path, root: Path, held: int, arguments: list[str], as_json: bool
) -> int:
    ended = workflow.run(plans, results, root, held, arguments, lambda *_: None)
    _check(ended)
    jobs = list(_one_by_one(ended.jobs, plans, results))
    if as_json:
        entries = [{"job": describe(job), "rule": job.rule, "reason": job.reason} for job in jobs]
        print(json.dumps({"jobs": entries}, indent=1))
        return 0
    for job in jobs:
        print(f"{describe(job)}: {job.reason}")
    if not jobs:
        print("nothing to do")
    return 0


def _one_by_one(
    jobs: Sequence[workflow.Job], plans: Sequence[Plan], results: Path
) -> Iterator[workflow.Job]:
    """Yield what a run would make, file by file: a job keeps those of its files that are up to date."""
    shards = {shard.path: shard for plan in plans for shard in plan.shards}
    for job in jobs:
        if not job.simulates:
            yield job
            continue
        for path in job.outputs:
            if not is_made(results / path, shards[path]):
                yield replace(job, rule="simulate", output=path)


def _check(ended: workflow.Outcome) -> None:
    """Refuse to go on where Snakemake itself broke down, rather than one of its jobs."""
    if ended.status and not ended.failed:
        raise VibsimError(f"the workflow broke down:\n{ended.text}")


def _show(
    options: Namespace,
    findings: list[outcome.Finding],
    ended: workflow.Outcome,
    results: Path,
    worked: bool,
) -> int:
    _check(ended)
    failures = [
        outcome.Failure(describe(job), str(results / job.log), outcome.tail(results / job.log))
        for job in ended.failed
    ]
    if failures:
        # The index waits for every report; after a failure it is written from what there is.
        command = [sys.executable, "-P", "-m", "vibsim", "report", "--results", str(results)]
        subprocess.run(command, check=False)
    if options.json:
        print(outcome.as_json(findings, failures, results))
    else:
        if not worked:
            print("nothing to do: all results are up to date\n")
        for line in outcome.as_text(findings, failures, _columns()):
            print(line)
        print(f"report: {results / 'index.html'}")
    return 0 if outcome.passed(findings, failures) else 1


def _columns() -> int:
    """Return the width of the terminal; what goes to a file is not cut."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else 10_000
