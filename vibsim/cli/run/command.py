"""``vibsim run``: from experiment files to verdicts, again and again until nothing is left to do."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from vibsim.cli import failure, outcome_text, results_folder, supervise, terminal
from vibsim.cli.chosen_plans import plans_of, tell_notes
from vibsim.cli.jobs.common import chosen_results, refusal
from vibsim.cli.jobs.simulate import is_made
from vibsim.cli.jobs.solve import check_allowed
from vibsim.cli.run import changes, executor, junit, lock, outcome, reasons, snakemake
from vibsim.cli.run.executor import Executor
from vibsim.cli.run.snakemake import Job, Progress
from vibsim.core import private_cache
from vibsim.core.errors import FileError, VibsimError
from vibsim.core.temporary import temporary_folder
from vibsim.plan import Plan

_STAGES = 4
"""How often the workflow is started at most: once, and once for each kind of file found bad."""
_PAGES = 5
"""Up to so many experiments, the report of each is named."""
_NAMED = 5
"""Up to so many experiments are named that run again for the same reason."""


def run(options: Namespace) -> int:
    """Run the chosen experiments and show every verdict."""
    with private_cache.provided() as problem:
        if problem:
            text = f"the cache is not used ({problem}); this run has one of its own until it ends"
            print(f"vibsim: {text}", file=sys.stderr, flush=True)
        return _run(options)


def _run(options: Namespace) -> int:
    results = chosen_results(options)
    # Everything is validated before anything is written but the cache of plans.
    plans = plans_of(options.experiments, options.settings, cached=True)
    check_allowed(plans, options.allow_commands)
    results_folder.check(results, [plan.key for plan in plans])
    where = executor.chosen(options, plans, results)
    # on the command line: a profile has its own, and that programs may run is not heard from a file
    config = [f"{key}={value}" for key, value in where.config.items()]
    config += ["allow_commands=true"] * options.allow_commands
    if config:
        where = replace(where, arguments=["--config", *config, *where.arguments])
    is_quiet = options.detail == "quiet"
    if not is_quiet:
        tell_notes(plans)
    if options.dry_run and options.junit:
        raise refusal("--junit", options.junit, "a dry run has no verdicts to write")
    if options.dry_run:
        return _dry_run(plans, results, where, options)
    if options.junit:
        junit.check_place(options.junit)
    held = lock.hold(results)
    lock.claim(plans, results)
    results_folder.deleted(results)
    _clear(plans, results, options)
    if not is_quiet:
        _tell_changes(plans, results)
    progress = None if is_quiet else Progress()
    jobs: list[Job] = []
    for _ in range(_STAGES):
        ended = _workflow(plans, results, held, where, progress)
        if ended.jobs:
            _refuse_edited(plans, options)
        summaries = [outcome.collect(plan, results) for plan in plans]
        if progress:
            progress.clear()
        jobs.extend(ended.jobs)
        changes.settle(plans, results, (path for job in ended.jobs for path in job.outputs))
        for error in () if ended.status else changes.stale(plans, results):
            results_folder.delete(error, results)
        if not _tell_deleted(results):
            break
    return _show(options, plans, summaries, ended, results, bool(jobs))


def _workflow(
    plans: Sequence[Plan],
    results: Path,
    held: int,
    where: Executor,
    progress: Progress | None = None,
) -> snakemake.Outcome:
    """Run Snakemake, once more where its own records end it: what they say, the manifest says as well."""
    ended = snakemake.run(plans, results, held, where, progress)
    if ended.broke and results_folder.forget(results):
        return snakemake.run(plans, results, held, where, progress)
    return ended


def _clear(plans: Sequence[Plan], results: Path, options: Namespace) -> None:
    """Delete what is no longer as it was made, and remove what no experiment asks for any more."""
    for error in changes.changed(plans, results, every=options.verify):
        results_folder.delete(error, results)
    _tell_deleted(results)
    for path in changes.leftovers(plans, results):
        changes.remove(path)
        if options.detail != "quiet":
            print(f"vibsim: removed, no longer asked for: {path}", file=sys.stderr)


def _tell_changes(plans: Sequence[Plan], results: Path) -> None:
    """Say why experiments run again that have results already; once for many with the same reason."""
    found: dict[str, list[str]] = {}
    for plan in plans:
        found.setdefault(reasons.why(plan, results), []).append(plan.key)
    for reason, keys in found.items():
        if reason not in ("", reasons.NEW):
            who = [f"{len(keys)} experiments"] if len(keys) > _NAMED else keys
            for name in who:
                print(f"{name}: {reason}", file=sys.stderr, flush=True)


def _tell_deleted(results: Path) -> bool:
    """Say what was deleted; tell whether anything was."""
    notes = results_folder.deleted(results)
    for note in notes:
        print(f"vibsim: deleted, to be made again: {note}", file=sys.stderr)
    return bool(notes)


def _refuse_edited(plans: Sequence[Plan], options: Namespace) -> None:
    """Refuse to go on with plans of files that say something else now: their results would be those of neither."""
    now = plans_of(options.experiments, options.settings, cached=True)
    files = dict.fromkeys(plan.file for plan in plans if plan not in now)
    if files:
        rule = "was edited while it was run; run it again"
        raise VibsimError("\n".join(f"{file}: {rule}" for file in files))


def _dry_run(plans: Sequence[Plan], results: Path, where: Executor, options: Namespace) -> int:
    """Show the jobs; a results folder that does not exist yet is not made for that."""
    with ExitStack() as stack:
        if not results.exists():
            results = stack.enter_context(temporary_folder())
        held = lock.hold(results)
        lock.claim(plans, results, dry_run=True)
        bad = changes.changed(plans, results, every=options.verify)
        for error in bad:
            print(f"vibsim: would be deleted and made again: {error}", file=sys.stderr)
        for path in changes.leftovers(plans, results):
            print(f"vibsim: would be removed, no longer asked for: {path}", file=sys.stderr)
        ended = _shown(plans, results, held, where, bad)
        known = {results / path for job in ended.jobs for path in job.outputs}
        if missed := [e for e in changes.stale(plans, results) if e.path not in known]:
            ended = _shown(plans, results, held, where, [*bad, *missed])
        jobs = list(_one_by_one(ended.jobs, plans, results))
        words = list(reasons.in_words(jobs, plans, results))
    if options.json:
        entries = [{"job": str(job), "rule": job.rule, "reason": job.reason} for job in jobs]
        print(json.dumps({"jobs": entries}, indent=1))
    elif options.detail == "full":
        print(*[f"{job}: {job.reason}" for job in jobs] or ["nothing to do"], sep="\n")
    elif options.detail != "quiet":
        print(*words or ["nothing to do"], sep="\n")
    return 0


def _shown(
    plans: Sequence[Plan], results: Path, held: int, where: Executor, bad: Sequence[FileError]
) -> snakemake.Outcome:
    """Ask Snakemake what it would do, if these files were not there."""
    arguments = [*where.arguments, "--dry-run"]
    if bad:
        paths = dict.fromkeys(error.path.relative_to(results).as_posix() for error in bad)
        arguments += ["--forcerun", *paths]
    ended = _workflow(plans, results, held, replace(where, arguments=arguments))
    _check(ended)
    return ended


def _one_by_one(jobs: Sequence[Job], plans: Sequence[Plan], results: Path) -> Iterator[Job]:
    """Yield what a run would make, file by file: a job keeps those of its files that are up to date."""
    shards = {shard.path: shard for plan in plans for shard in plan.shards}
    for job in jobs:
        if not job.simulates:
            yield job
            continue
        for path in job.outputs:
            if not is_made(results / path, shards[path]):
                yield replace(job, rule="simulate", outputs=(path,))


def _check(ended: snakemake.Outcome) -> None:
    """Refuse to go on where Snakemake itself failed, rather than one of its jobs."""
    if ended.broke:
        raise VibsimError(f"the workflow failed: {ended.cause} {failure.save_text(ended.text)}")


def _show(
    options: Namespace,
    plans: Sequence[Plan],
    summaries: list[outcome_text.Entry],
    ended: snakemake.Outcome,
    results: Path,
    worked: bool,
) -> int:
    _check(ended)
    failures = outcome.failed_jobs(ended.failed, plans, results)
    # the index waits for every report: after a failure it is written from what there is
    index = ["report", "--results", str(results)]
    has_index = not failures or supervise.child(index) == 0
    status = outcome.status(summaries, failures)
    if options.junit:
        junit.write(options.junit, summaries, failures)
    if options.json:
        print(outcome.as_json(summaries, failures, results))
    elif options.detail == "quiet":
        errors = [entry for entry in summaries if "error" in entry]
        lines = [*outcome_text.in_full(errors, terminal.UNCUT), *outcome_text.of_failures(failures)]
        print(*lines, sep="\n", end="\n" * bool(lines), file=sys.stderr)
    else:
        if not worked:
            print("nothing to do: all results are up to date\n")
        tell = outcome_text.in_full if options.detail == "full" else outcome_text.in_lines
        print(*tell(summaries, terminal.columns()), sep="\n")
        for line in outcome_text.of_failures(failures):
            print(line)
        print(f"\n{outcome_text.count(summaries, status)}")
        # the index links to those of many experiments
        pages = [results / plan.page for plan in plans] if len(plans) <= _PAGES else []
        for page in filter(Path.is_file, pages):
            print(f"report: {page}")
        if has_index:
            print(f"all results: {results / 'index.html'}")
    return 0 if status == "PASS" else 1
