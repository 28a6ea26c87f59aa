from __future__ import annotations

import json
import logging
import os
from pathlib import Path
from typing import Any

import pytest
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.tests import MockOutputSettings
from thinned import thinned

from vibsim.cli.resources import amount, duration, size
from vibsim.cli.run import lock, snakemake
from vibsim.cli.run.executor import Executor
from vibsim.cli.run.snakemake import Job, Outcome, Progress, Work, follow
from vibsim.cli.run.snakemake_process import LogHandler, LogHandlerSettings

EVENTS: list[tuple[str, LogEvent | None, dict[str, Any]]] = [
    ("Building DAG of jobs...", None, {}),
    ("Job stats: ...", LogEvent.RUN_INFO, {"stats": {"simulate_3": 1, "total": 4}}),
    (
        "Rule: simulate_3",
        LogEvent.JOB_INFO,
        {
            "rule_name": "simulate_3",
            "output": ["a/x/level_07.nc (update)"],
            "log": ["a/x/logs/level_07.log"],
            "reason": "Missing output files: a/x/level_07.nc",
            "resources": object(),
        },
    ),
    ("Finished jobid: 2", LogEvent.JOB_FINISHED, {"job_id": 2}),
    ("", LogEvent.PROGRESS, {"done": 1, "total": 4}),
    (
        "Error in rule analyse",
        LogEvent.JOB_ERROR,
        {
            "rule_name": "analyse",
            "output": ["a/x/convergence.nc", "a/x/summary.json"],
            "log": ["a/x/logs/analyse.log", "/x/.snakemake/slurm_logs/5.log"],
            "rule_msg": "SLURM-job '5' failed, SLURM status is: 'OUT_OF_MEMORY'",
        },
    ),
    ("", LogEvent.JOB_INFO, {"rule_name": "all", "output": [], "log": [], "reason": ""}),
    (
        "",
        LogEvent.JOB_INFO,
        {"rule_name": "index", "output": ["index.html", "summary.csv"], "log": [], "reason": ""},
    ),
    ("WorkflowError:\nAt least one job", LogEvent.ERROR, {"exception": "WorkflowError"}),
]


_, _, STARTED = EVENTS[2]
FAILED = ("Error", LogEvent.JOB_ERROR, STARTED | {"rule_msg": None})


def lines_of(events: list[tuple[str, LogEvent | None, dict[str, Any]]]) -> list[bytes]:
    """Return what the plug-in writes of records as Snakemake makes them."""
    reading, writing = os.pipe()
    handler = LogHandler(MockOutputSettings(), LogHandlerSettings(pipe=writing))
    for text, event, fields in events:
        record = logging.LogRecord("snakemake", logging.INFO, "x.py", 1, text, (), None)
        record.__dict__ |= fields | ({"event": event} if event else {})
        handler.handle(record)
    os.close(writing)
    with os.fdopen(reading, "rb") as file:
        return file.readlines()


def test_jobs_failures_and_steps_are_read_from_the_events_of_snakemake() -> None:
    lines = lines_of(EVENTS)
    assert [json.loads(line)["event"] for line in lines] == [
        str(event) for _, event, _ in EVENTS if event not in (None, LogEvent.JOB_FINISHED)
    ]
    found = follow(lines)
    assert [str(job) for job in found.jobs] == ["simulate a/x level_07.nc", "index"]
    assert found.jobs[0].outputs == ("a/x/level_07.nc",)
    assert found.jobs[0].reason == "Missing output files: a/x/level_07.nc"
    (failed,) = found.failed
    assert str(failed) == "analyse a/x"
    assert failed.log == "a/x/logs/analyse.log"
    assert failed.reason == "SLURM-job '5' failed, SLURM status is: 'OUT_OF_MEMORY'"
    assert found.cause == "WorkflowError: At least one job"


def test_a_job_that_is_tried_again_is_no_failure_and_counted_once() -> None:
    found = follow(lines_of([EVENTS[1], EVENTS[2], FAILED, EVENTS[2]]))
    assert found.failed == []
    assert len(found.jobs) == 1
    assert [str(job) for job in follow(lines_of([EVENTS[2], FAILED])).failed] == [
        "simulate a/x level_07.nc"
    ]


def test_an_event_that_a_kill_cut_short_is_left_out() -> None:
    lines = lines_of(EVENTS)
    assert len(follow([*lines[:2], lines[4][:-1]]).jobs) == 1


@pytest.mark.parametrize(
    ("exception", "message", "text", "cause"),
    [
        (
            "",
            "",
            "Traceback ...\n  File\nImportError: nothing here\n\n",
            "ImportError: nothing here",
        ),
        ("", "", "", ""),
        (
            "ValueError",
            "ValueError in line 4:\nno good\n  File x",
            "",
            "ValueError in line 4: no good",
        ),
        (
            "ProtectedOutputException",
            "ProtectedOutputException in line 2:\nWrite-protected output files:\nindex.html\n",
            "",
            "ProtectedOutputException in line 2: Write-protected output files: index.html",
        ),
        ("OSError", "Traceback:\n  File x:\nOSError: full", "Building\n", "OSError: full"),
        ("Error", "Traceback:\n  File x:\nsqlite3.Error: locked", "", "sqlite3.Error: locked"),
    ],
)
def test_the_cause_is_the_exception_or_the_last_line(
    exception: str, message: str, text: str, cause: str
) -> None:
    assert Outcome(1, exception=exception, message=message, text=text).cause == cause


@pytest.mark.parametrize(
    ("snakefile", "profile", "cause"),
    thinned(
        [
            ('raise ValueError("no good")', "{}", 'Snakefile", line 2: no good'),
            ("rule all:\n    input: 'none'", "{}", "Missing input files for rule all:"),
            ("", "scheduler: none", "argument --scheduler: invalid choice: 'none'"),
            ("", "[", 'config.yaml", line 1'),
        ],
        2,
    ),
    ids=["exception", "input", "argument", "profile"],
)
def test_a_broken_workflow_is_told_in_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, snakefile: str, profile: str, cause: str
) -> None:
    root = tmp_path / "root"
    (root / "workflow/profiles/default").mkdir(parents=True)
    (root / "workflow/profiles/default/config.yaml").write_text(profile)
    (root / "Snakefile").write_text(f"# a workflow\n{snakefile}\n")
    monkeypatch.setattr(snakemake, "home", lambda: root)
    held = lock.hold(tmp_path / "results")
    try:
        ended = snakemake.run(Work([], tmp_path / "results", held, Executor(["--cores", "1"])))
    finally:
        os.close(held)
    assert ended.status in (1, 2)
    assert cause in ended.cause
    assert len(ended.text.splitlines()) > 1


def test_options_behind_two_dashes_may_name_a_plug_in_of_a_local_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root, plug_in = tmp_path / "root", tmp_path / "snakemake_logger_plugin_mine"
    (root / "workflow/profiles/default").mkdir(parents=True)
    (root / "workflow/profiles/default/config.yaml").write_text("{}")
    (root / "Snakefile").write_text("rule all:\n    shell: 'true'\n")
    plug_in.mkdir()
    (plug_in / "__init__.py").write_text(
        "from vibsim.cli.run.snakemake_process import LogHandler as Base\n\n\n"
        "class LogHandler(Base):\n    def emit(self, record):\n        pass\n"
    )
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}")
    monkeypatch.setattr(snakemake, "home", lambda: root)
    held = lock.hold(tmp_path / "results")
    mine = Executor(["--cores", "1", "--logger", "vibsim", "mine"], is_extended=True)
    try:
        ended = snakemake.run(Work([], tmp_path / "results", held, mine))
    finally:
        os.close(held)
    assert ended.status == 0, ended.text


def test_a_job_with_several_files_is_told_by_its_first_and_last() -> None:
    outputs = ("a/x/level_06.nc", "a/x/level_07.nc", "a/x/level_09.nc")
    assert str(Job("simulate_3", outputs, "", "")) == "simulate a/x level_06.nc to level_09.nc"
    shard = Job("simulate_4", ("a/x/level_06/shard_0001.nc",), "", "")
    assert str(shard) == "simulate a/x level_06/shard_0001.nc"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (size(0), "0 B"),
        (size(999), "999 B"),
        (size(999.9), "1 kB"),
        (size(123_456), "123 kB"),
        (size(2.46e9), "2.46 GB"),
        (size(1e16), "1e+04 TB"),
        (amount(960), "960"),
        (amount(1.3e9), "1.3e+09"),
        (duration(0.04), "0.0 s"),
        (duration(99.94), "99.9 s"),
        (duration(186), "3.1 min"),
        (duration(9000), "2.5 h"),
        (duration(864_000), "10.0 d"),
    ],
)
def test_numbers_for_people(text: str, expected: str) -> None:
    assert text == expected


def test_progress_counts_the_jobs_without_the_target_of_all(
    capsys: pytest.CaptureFixture[str],
) -> None:
    progress = Progress()
    progress.is_terminal = False
    follow(lines_of(EVENTS), progress)
    assert capsys.readouterr().err.splitlines() == [
        "1 of 3: simulate a/x level_07.nc",
        "2 of 3: index",
    ]
    assert progress.done == 1


def test_the_line_of_a_terminal_tells_what_goes_on_and_how_long_the_rest_takes(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter(range(0, 1000, 5))
    monkeypatch.setattr(snakemake.time, "monotonic", lambda: float(next(clock)))
    monkeypatch.setenv("COLUMNS", "70")
    progress = Progress()
    progress.is_terminal = True
    progress.count(0, 9)
    progress.start(Job("analyse", ("a/x/convergence.nc",), "", ""))
    progress.count(2, 9)
    progress.count(4, 9)
    shown = capsys.readouterr().err.split("\r\033[K")
    assert shown[-3:] == [
        "0 of 8 done: analyse a/x",
        "2 of 8 done: analyse a/x",
        "4 of 8 done, about 5.0 s left: analyse a/x",
    ]
    monkeypatch.setenv("COLUMNS", "20")
    progress.count(8, 9)
    assert capsys.readouterr().err == "\r\033[K8 of 8 done: analys"
