"""How often a scheduler is asked: by the age of the jobs, whatever the executor does on its own."""

from __future__ import annotations

import asyncio
from itertools import pairwise
from threading import Lock
from types import SimpleNamespace

import pytest
from snakemake_interface_executor_plugins.executors.remote import RemoteExecutor

from vibsim.cli.run import questions


def test_a_pause_is_a_fifth_of_the_age_within_bounds() -> None:
    assert questions.pause([], 2.0) == 2.0
    assert questions.pause([1.0], 2.0) == 2.0
    assert questions.pause([10.0, 50.0], 2.0) == 6.0
    assert questions.pause([3600.0], 2.0) == 60.0
    # whoever wants fewer questions gets them
    assert questions.pause([3600.0], 90.0) == 90.0


def test_a_job_is_missed_for_a_fifth_of_its_time_and_an_old_one_asked_for_once_a_minute(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(RemoteExecutor, "sleep", RemoteExecutor.sleep)
    questions.by_age()
    clock = 0.0
    asked: list[float] = []

    async def sleep(seconds: float) -> None:
        nonlocal clock
        clock += seconds
        asked.append(clock)

    monkeypatch.setattr("vibsim.cli.run.questions.time.monotonic", lambda: clock)
    monkeypatch.setattr("vibsim.cli.run.questions.asyncio.sleep", sleep)
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
