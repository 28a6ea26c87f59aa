"""The outcome of a run: summaries of all experiments and failed jobs, as plain data or as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from vibsim.cli import made_files, resources, results_folder
from vibsim.cli.outcome_text import Entry
from vibsim.cli.run.snakemake import Job
from vibsim.core.errors import FileError
from vibsim.core.vocabulary import FORMAT, worst
from vibsim.plan import Plan
from vibsim.store import read_json

_LOG_LINES = 12


def collect(plan: Plan, results: Path) -> Entry:
    """Return the summary of an experiment, or an entry with the error; a damaged or outdated summary is deleted."""
    path = results / plan.summary
    problem = "did not finish: it has no summary"
    if path.is_file():
        try:
            return read_json(path, digest=plan.analysis, name=plan.key)
        except FileError as error:
            results_folder.delete(error, results)
            problem = f"summary.json: {error.reason}"
    return {
        "collection": plan.collection,
        "experiment": plan.name,
        "title": plan.title,
        "status": "FAIL",
        "checks": [],
        "failures": [],
        "error": problem,
    }


def failed_jobs(jobs: Sequence[Job], plans: Sequence[Plan], results: Path) -> list[Entry]:
    """Return an entry for each failed job; of a group, which fails as a whole, only for jobs that miss their files."""
    planned = {path: digest for plan in plans for path, digest in plan.files.items()}
    made = {
        f"{plan.key}/{name}": entry.job
        for plan in plans
        for name, entry in made_files.load(results, plan.key).items()
    }
    bad = [
        job
        for job in jobs
        if any(
            not (results / path).exists() or made.get(path) != planned.get(path)
            for path in job.outputs
        )
    ]
    return [_failed_job(job, results) for job in bad or jobs]


def _failed_job(job: Job, results: Path) -> Entry:
    """Return the entry of a failed job: the end of its log, the executor's reason and the path of its log, if any."""
    log = results / job.log
    try:
        lines = log.read_text(errors="replace").splitlines()
    except OSError:
        lines = []
    tail = [line for line in lines if line.strip()][-_LOG_LINES:]
    tail += [job.reason] * bool(job.reason)
    tail += [f"log of the executor: {job.executor_log}"] * (results / job.executor_log).is_file()
    tail = tail or [*resources.obstacle(results)]  # on a full disk, a job cannot write its log
    tail = tail or ["it left no message: it did not start, or was killed"]
    return {"job": str(job), "log": str(log), "tail": tail}


def status(summaries: Sequence[Entry], failures: Sequence[Entry]) -> str:
    """Return the status of the whole run: PASS if every check passed and no job failed."""
    return worst([entry["status"] for entry in summaries] + ["FAIL"] * bool(failures))


def as_json(summaries: Sequence[Entry], failures: Sequence[Entry], results: Path) -> str:
    """Return the outcome as JSON text."""
    content = {
        "vibsim_format": FORMAT,
        "status": status(summaries, failures),
        "results": str(results),
        "experiments": summaries,
        "failed_jobs": failures,
    }
    return json.dumps(content, indent=1, ensure_ascii=False)
