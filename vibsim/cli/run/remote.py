"""What the executors of Snakemake do in another way under vibsim: how often they ask for jobs, what they tell of them.

Executors ask their scheduler at a fixed interval, or ever more rarely while no job ends: that for SLURM waits 10 s
longer each time, so half of a minute goes by after a job of a minute. Here the pause grows with the age of the jobs,
and with nothing else. A job is missed for a fifth of its time at most, and a scheduler gets one question a minute for
jobs that take long.

Why a job failed is lost in Snakemake where it is one of a group; here each of the group is reported with the reason.

An interrupt cancels all jobs under way. The interface of Snakemake leaves out those whose states it is just asking for.
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

SHARE = 0.2
"""Pause over the mean age of the jobs."""
LONGEST = 60.0
"""Seconds of a pause at most, if the profile does not ask for more."""


def pause(ages: Sequence[float], shortest: float) -> float:
    """Return the seconds until the next question about jobs that were submitted so many seconds ago."""
    return max(shortest, min(LONGEST, SHARE * mean(ages))) if ages else shortest


def ask_by_age() -> None:
    """Have every executor that waits as the interface of Snakemake does ask by the age of its jobs.

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
    """Have an interrupt cancel every job that was submitted and has not ended, as far as is known.

    Jobs are no longer in the list of `RemoteExecutor` while it asks for their states.
    """
    under_way: dict[JobExecutorInterface, SubmittedJobInfo] = {}
    submitted = RemoteExecutor.report_job_submission
    succeeded, failed = RemoteExecutor.report_job_success, RemoteExecutor.report_job_error

    def report_job_submission(
        self: RemoteExecutor, job_info: SubmittedJobInfo, *args: Any, **more: Any
    ) -> None:
        under_way[job_info.job] = job_info
        submitted(self, job_info, *args, **more)

    def report_job_success(self: RemoteExecutor, job_info: SubmittedJobInfo) -> None:
        under_way.pop(job_info.job, None)
        succeeded(self, job_info)

    def report_job_error(
        self: RemoteExecutor, job_info: SubmittedJobInfo, *args: Any, **more: Any
    ) -> None:
        under_way.pop(job_info.job, None)
        failed(self, job_info, *args, **more)

    def cancel(self: RemoteExecutor) -> None:
        if jobs := list(under_way.values()):
            self.cancel_jobs(jobs)
        self.shutdown()

    RemoteExecutor.report_job_submission = report_job_submission
    RemoteExecutor.report_job_success = report_job_success
    RemoteExecutor.report_job_error = report_job_error
    RemoteExecutor.cancel = cancel


def tell_reasons() -> None:
    """Have every job that failed reported with what its executor says of that, also where it is one of a group."""

    def print_job_error(
        self: RemoteExecutor, job_info: SubmittedJobInfo, msg: str | None = None, **more: Any
    ) -> None:
        failed = job_info.job
        jobs = failed.jobs if failed.is_group() else [failed]
        for job in sorted(jobs, key=lambda job: job.rule.name):
            job.log_error(msg, **more)

    RemoteExecutor.print_job_error = print_job_error


def report_submissions() -> None:
    """Have a group of jobs that SLURM does not take fail with the reason.

    The executor for SLURM stumbles over its own message there, in a thread that nobody asks, and waits for ever.
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
