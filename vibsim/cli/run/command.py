"""``vibsim run``: run experiments, start the workflow again while results prove damaged, and show the verdicts."""

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
from vibsim.cli.outcome_text import Entry
from vibsim.cli.run import changes, executor, junit, lock, outcome, reasons, snakemake
from vibsim.cli.run.executor import Executor
from vibsim.cli.run.snakemake import Job, Progress, Work
from vibsim.core import private_cache
from vibsim.core.errors import FileError, VibsimError
from vibsim.core.temporary import temporary_folder
from vibsim.plan import Plan

_STAGES = 4  # most starts of the workflow: one, and one for each kind of file that may prove bad
_PAGES = 5  # most experiments for which the path of each report is printed
_NAMED = 5  # most experiments that run again for the same reason and are still listed by name


def run(options: Namespace) -> int:
    """Run the chosen experiments and show every verdict."""
    with private_cache.provided() as problem:
        if problem:
            text = f"the cache is not used ({problem}); this run uses a temporary one"
            print(f"vibsim: {text}", file=sys.stderr, flush=True)
        return _run(options)


def _run(options: Namespace) -> int:
    results = chosen_results(options)
    # Everything is validated before anything but the cache of plans is written.
    plans = plans_of(options.experiments, options.settings, cached=True)
    check_allowed(plans, options.allow_commands)
    results_folder.check(results, [plan.key for plan in plans])
    target = executor.chosen(options, plans, results)
    # as arguments, since they override the profile and since no file may grant permission to run programs
    config = [f"{key}={value}" for key, value in target.config.items()]
    config += ["allow_commands=true"] * options.allow_commands
    if config:
        target = replace(target, arguments=["--config", *config, *target.arguments])
    is_quiet = options.detail == "quiet"
    if not is_quiet:
        tell_notes(plans)
    if options.dry_run and options.junit:
        raise refusal("--junit", options.junit, "a dry run has no verdicts to write")
    if options.dry_run:
        return _dry_run(plans, results, target, options)
    if options.junit:
        junit.check_place(options.junit)
    lock_fd = lock.hold(results)
    lock.claim(plans, results)
    results_folder.deleted(results)
    _clear(plans, results, options)
    if not is_quiet:
        _tell_changes(plans, results)
    progress = None if is_quiet else Progress()
    jobs: list[Job] = []
    for _ in range(_STAGES):
        ended = _workflow(Work(plans, results, lock_fd, target), progress)
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
    _check(ended)
    failures = outcome.failed_jobs(ended.failed, plans, results)
    # Snakemake writes the index after all reports; after a failure it is written here, from the results that exist
    index = ["report", "--results", str(results)]
    has_index = not failures or supervise.child(index) == 0
    status = _show(options, summaries, failures, results, bool(jobs))
    if not (options.json or is_quiet):
        # for many experiments, the index links to the reports
        pages = [results / plan.page for plan in plans] if len(plans) <= _PAGES else []
        for page in filter(Path.is_file, pages):
            print(f"report: {page}")
        if has_index:
            print(f"all results: {results / 'index.html'}")
    return 0 if status == "PASS" else 1


def _workflow(work: Work, progress: Progress | None = None) -> snakemake.Outcome:
    """Run Snakemake; if it breaks on its own records, delete these, since the manifest suffices, and run it again."""
    ended = snakemake.run(work, progress)
    if ended.broke and results_folder.forget(work.results):
        return snakemake.run(work, progress)
    return ended


def _clear(plans: Sequence[Plan], results: Path, options: Namespace) -> None:
    """Delete files that were changed since they were made, and files that no experiment needs any more."""
    for error in changes.changed(plans, results, every=options.verify):
        results_folder.delete(error, results)
    _tell_deleted(results)
    for path in changes.leftovers(plans, results):
        changes.remove(path)
        if options.detail != "quiet":
            print(f"vibsim: removed, no longer asked for: {path}", file=sys.stderr)


def _tell_changes(plans: Sequence[Plan], results: Path) -> None:
    """Print why experiments with results run again; many experiments with the same reason share a line."""
    by_reason: dict[str, list[str]] = {}
    for plan in plans:
        by_reason.setdefault(reasons.why(plan, results), []).append(plan.key)
    for reason, keys in by_reason.items():
        if reason not in ("", reasons.NEW):
            names = [f"{len(keys)} experiments"] if len(keys) > _NAMED else keys
            for name in names:
                print(f"{name}: {reason}", file=sys.stderr, flush=True)


def _tell_deleted(results: Path) -> bool:
    """Print what was deleted, and tell whether anything was."""
    notes = results_folder.deleted(results)
    for note in notes:
        print(f"vibsim: deleted, to be made again: {note}", file=sys.stderr)
    return bool(notes)


def _refuse_edited(plans: Sequence[Plan], options: Namespace) -> None:
    """Refuse to go on if experiment files changed during the run: the results would belong to neither version."""
    now = plans_of(options.experiments, options.settings, cached=True)
    files = dict.fromkeys(plan.file for plan in plans if plan not in now)
    if files:
        rule = "was edited while it was run; run it again"
        raise VibsimError("\n".join(f"{file}: {rule}" for file in files))


def _dry_run(plans: Sequence[Plan], results: Path, target: Executor, options: Namespace) -> int:
    """Show the jobs that a run would start, without creating the results folder."""
    with ExitStack() as stack:
        if not results.exists():
            results = stack.enter_context(temporary_folder())
        work = Work(plans, results, lock.hold(results), target)
        lock.claim(plans, results, dry_run=True)
        bad = changes.changed(plans, results, every=options.verify)
        for error in bad:
            print(f"vibsim: would be deleted and made again: {error}", file=sys.stderr)
        for path in changes.leftovers(plans, results):
            print(f"vibsim: would be removed, no longer asked for: {path}", file=sys.stderr)
        ended = _preview(work, bad)
        outputs = {results / path for job in ended.jobs for path in job.outputs}
        if missed := [e for e in changes.stale(plans, results) if e.path not in outputs]:
            ended = _preview(work, [*bad, *missed])
        jobs = list(_by_file(ended.jobs, plans, results))
        words = list(reasons.in_words(jobs, plans, results))
    if options.json:
        entries = [{"job": str(job), "rule": job.rule, "reason": job.reason} for job in jobs]
        print(json.dumps({"jobs": entries}, indent=1))
    elif options.detail == "full":
        print(*[f"{job}: {job.reason}" for job in jobs] or ["nothing to do"], sep="\n")
    elif options.detail != "quiet":
        print(*words or ["nothing to do"], sep="\n")
    return 0


def _preview(work: Work, bad: Sequence[FileError]) -> snakemake.Outcome:
    """Ask Snakemake which jobs it would run if the files in `bad` were missing."""
    arguments = [*work.target.arguments, "--dry-run"]
    if bad:
        paths = dict.fromkeys(error.path.relative_to(work.results).as_posix() for error in bad)
        arguments += ["--forcerun", *paths]
    ended = _workflow(work._replace(target=replace(work.target, arguments=arguments)))
    _check(ended)
    return ended


def _by_file(jobs: Sequence[Job], plans: Sequence[Plan], results: Path) -> Iterator[Job]:
    """Split simulate jobs by file, and drop the files that are up to date, which a job would keep."""
    shards = {shard.path: shard for plan in plans for shard in plan.shards}
    for job in jobs:
        if not job.simulates:
            yield job
            continue
        for path in job.outputs:
            if not is_made(results / path, shards[path]):
                yield replace(job, rule="simulate", outputs=(path,))


def _check(ended: snakemake.Outcome) -> None:
    """Raise an error if Snakemake itself failed, rather than one of its jobs."""
    if ended.broke:
        raise VibsimError(f"the workflow failed: {ended.cause} {failure.save_text(ended.text)}")


def _show(
    options: Namespace, summaries: list[Entry], failures: list[Entry], results: Path, worked: bool
) -> str:
    """Show the outcome as the user wants it, and return its status."""
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
    return status
