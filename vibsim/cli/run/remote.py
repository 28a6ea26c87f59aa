"""Changes to Snakemake's remote executors: how often they query the scheduler, and what they report of failed jobs.

Executors query their scheduler at a fixed interval, or with growing pauses while no job ends: the one for SLURM waits
10 s longer each time, and notices the end of a one-minute job half a minute late. Here the pause grows with the age of
the jobs only. The end of a job is noticed after at most a fifth of the mean age of all jobs, and long jobs cause one
query per minute.

Snakemake loses the reason why a job of a group failed; here each job of the group is reported with the reason.

An interrupt cancels all submitted jobs. Snakemake itself omits the jobs whose states it is just querying.
"""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import Sequence
from statistics import mean
from typing import Any

from snakemake_interface_executor_plugins.executors.base import SubmittedJobInfo
from snakemake_interface_executor_plugins.executors.remote import RemoteExecutor
from snakemake_interface_executor_plugins.jobs import JobExecutorInterface

SHARE = 0.2  # ratio of the pause to the mean age of the jobs
LONGEST = 60.0  # longest pause [s], unless the profile requests a longer one


def pause(ages: Sequence[float], shortest: float) -> float:
    """Return the pause before the next query [s], from the times since the jobs were submitted [s]."""
    return max(shortest, min(LONGEST, SHARE * mean(ages))) if ages else shortest


def ask_by_age() -> None:
    """Make all executors that use Snakemake's default pause choose it from the age of their jobs.

    The shortest pause is ``--seconds-between-status-checks``.
    """
    since: dict[str | None, float] = {}

    async def sleep(self: RemoteExecutor) -> None:
        now = time.monotonic()
        with self.lock:
            jobs = [job.external_jobid for job in self.active_jobs]
        first = {job: since.get(job, now) for job in jobs}
        since.clear()
        since.update(first)
        shortest = self.workflow.remote_execution_settings.seconds_between_status_checks
        await asyncio.sleep(pause([now - then for then in first.values()], shortest))

    RemoteExecutor.sleep = sleep


def cancel_all() -> None:
    """Make an interrupt cancel every job that was submitted and is not known to have ended.

    While `RemoteExecutor` queries the states of jobs, they are not in its own list.
    """
    running: dict[JobExecutorInterface, SubmittedJobInfo] = {}
    submitted = RemoteExecutor.report_job_submission
    succeeded, failed = RemoteExecutor.report_job_success, RemoteExecutor.report_job_error

    def report_job_submission(
        self: RemoteExecutor, job_info: SubmittedJobInfo, *args: Any, **more: Any
    ) -> None:
        running[job_info.job] = job_info
        submitted(self, job_info, *args, **more)

    def report_job_success(self: RemoteExecutor, job_info: SubmittedJobInfo) -> None:
        running.pop(job_info.job, None)
        succeeded(self, job_info)

    def report_job_error(
        self: RemoteExecutor, job_info: SubmittedJobInfo, *args: Any, **more: Any
    ) -> None:
        running.pop(job_info.job, None)
        failed(self, job_info, *args, **more)

    def cancel(self: RemoteExecutor) -> None:
        if jobs := list(running.values()):
            self.cancel_jobs(jobs)
        self.shutdown()

    RemoteExecutor.report_job_submission = report_job_submission
    RemoteExecutor.report_job_success = report_job_success
    RemoteExecutor.report_job_error = report_job_error
    RemoteExecutor.cancel = cancel


def tell_reasons() -> None:
    """Make Snakemake report every failed job with its executor's message, also each job of a group."""

    def print_job_error(
        self: RemoteExecutor, job_info: SubmittedJobInfo, msg: str | None = None, **more: Any
    ) -> None:
        failed = job_info.job
        jobs = failed.jobs if failed.is_group() else [failed]
        for job in sorted(jobs, key=lambda job: job.rule.name):
            job.log_error(msg, **more)

    RemoteExecutor.print_job_error = print_job_error


def report_submissions() -> None:
    """Make a group of jobs that SLURM rejects fail with the reason.

    The SLURM executor raises an exception while it formats its own message, in a thread without a handler, and then
    waits for ever.
    """
    module = sys.modules.get("snakemake_executor_plugin_slurm")
    if module is None:
        return
    submit = module.Executor.run_job

    def run_job(self: RemoteExecutor, job: JobExecutorInterface) -> None:
        try:
            submit(self, job)
        except Exception as error:
            why = error.__context__ or error
            self.report_job_error(SubmittedJobInfo(job), msg=f"it could not be submitted: {why}")

    module.Executor.run_job = run_job
