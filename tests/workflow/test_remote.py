"""Jobs elsewhere: how often a scheduler is asked for them, and what is told of those that fail."""

from __future__ import annotations

import asyncio
import sys
from itertools import pairwise
from pathlib import Path
from threading import Lock
from types import SimpleNamespace
from typing import Any

import pytest
from snakemake_interface_executor_plugins.executors.remote import RemoteExecutor

from vibsim.cli.chosen_plans import plans_of
from vibsim.cli.run import outcome, remote
from vibsim.cli.run.snakemake import Job

from .conftest import Place


def test_a_pause_is_a_fifth_of_the_age_within_bounds() -> None:
    assert remote.pause([], 2.0) == 2.0
    assert remote.pause([1.0], 2.0) == 2.0
    assert remote.pause([10.0, 50.0], 2.0) == 6.0
    assert remote.pause([3600.0], 2.0) == 60.0
    # whoever wants fewer questions gets them
    assert remote.pause([3600.0], 90.0) == 90.0


def test_a_job_is_missed_for_a_fifth_of_its_time_and_an_old_one_asked_for_once_a_minute(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(RemoteExecutor, "sleep", RemoteExecutor.sleep)
    remote.ask_by_age()
    clock = 0.0
    asked: list[float] = []

    async def sleep(seconds: float) -> None:
        nonlocal clock
        clock += seconds
        asked.append(clock)

    monkeypatch.setattr("vibsim.cli.run.remote.time.monotonic", lambda: clock)
    monkeypatch.setattr("vibsim.cli.run.remote.asyncio.sleep", sleep)
    settings = SimpleNamespace(seconds_between_status_checks=2)
    plug_in = SimpleNamespace(
        lock=Lock(),
        active_jobs=[],
        workflow=SimpleNamespace(remote_execution_settings=settings),
        # what the executor for SLURM wants to wait
        next_seconds_between_status_checks=180,
    )

    def until(end: float) -> list[float]:
        asked.clear()
        while clock < end:
            asyncio.run(RemoteExecutor.sleep(plug_in))
        return [*asked]

    # the clock of a job starts when it is first seen
    assert until(100.0) == [2.0 * n for n in range(1, 51)]
    plug_in.active_jobs = [SimpleNamespace(external_jobid="7")]
    times = until(3700.0)
    pauses = {after: after - before for before, after in pairwise(times)}
    assert all(pauses[one] <= max(2.0, 0.2 * (one - 100.0)) for one in pauses)
    assert all(pauses[one] == pytest.approx(60.0) for one in pauses if one > 500.0)
    assert len(times) < 80
    # another job has an age of its own
    plug_in.active_jobs = [SimpleNamespace(external_jobid="8")]
    assert until(clock + 1.0) == [clock]


def test_each_job_of_a_group_is_told_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RemoteExecutor, "print_job_error", RemoteExecutor.print_job_error)
    remote.tell_reasons()
    told: list[tuple[str, str | None, list[str]]] = []

    def job(name: str) -> SimpleNamespace:
        def log_error(msg: str | None, aux_logs: list[str], **_: Any) -> None:
            told.append((name, msg, aux_logs))

        rule = SimpleNamespace(name=name)
        return SimpleNamespace(rule=rule, log_error=log_error, is_group=lambda: False)

    group = SimpleNamespace(jobs=[job("report"), job("analyse")], is_group=lambda: True)
    for failed in (group, job("simulate")):
        info = SimpleNamespace(job=failed, external_jobid="7")
        RemoteExecutor.print_job_error(None, info, "OUT_OF_MEMORY", aux_logs=["7.log"])
    assert told == [
        (name, "OUT_OF_MEMORY", ["7.log"]) for name in ("analyse", "report", "simulate")
    ]


def test_of_a_group_that_failed_those_are_named_that_made_nothing(place: Place) -> None:
    plans = plans_of([str(place.file)])
    paths = (*((path,) for path in plans[0].files),)
    jobs = [Job("a job", path, "none.log", "") for path in paths]

    def named() -> list[str]:
        return [entry["job"] for entry in outcome.failed_jobs(jobs, plans, place.results)]

    # all was made: what failed came after that
    assert len(named()) == len(jobs)
    page = place.results / plans[0].page
    page.unlink()
    assert named() == [str(jobs[-1])]
    (failure,) = outcome.failed_jobs(jobs, plans, place.results)
    assert failure["tail"] == ["it left no message: it did not start, or was killed"]
    place.change("{theta: 1.0}", "{theta: 1.5}")
    plans = plans_of([str(place.file)])
    assert len(named()) == len(jobs)


def test_the_log_of_an_executor_is_named_where_there_is_one(tmp_path: Path) -> None:
    job = Job("analyse", ("a/x/convergence.nc",), "none.log", "lost", str(tmp_path / "7.log"))
    assert outcome.failed_jobs([job], [], tmp_path)[0]["tail"] == ["lost"]
    (tmp_path / "7.log").touch()
    (failure,) = outcome.failed_jobs([job], [], tmp_path)
    assert failure["tail"] == ["lost", f"log of the executor: {tmp_path}/7.log"]


def test_a_group_that_slurm_does_not_take_fails_with_the_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[str] = []

    class Executor:
        def run_job(self, job: Any) -> None:
            try:
                raise ValueError("invalid account")
            except ValueError:
                # as the executor for SLURM does, though a group has no rule
                print(job.rule.name)

        def report_job_error(self, info: Any, msg: str) -> None:
            told.append(f"{info.job.name}: {msg}")

    plug_in = SimpleNamespace(Executor=Executor)
    monkeypatch.setitem(sys.modules, "snakemake_executor_plugin_slurm", plug_in)
    remote.report_submissions()
    Executor().run_job(SimpleNamespace(name="simulate"))
    assert told == ["simulate: it could not be submitted: invalid account"]
