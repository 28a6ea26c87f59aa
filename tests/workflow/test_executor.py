"""Jobs that an executor of Snakemake runs: a scheduler of three scripts, which starts each in its own session."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path
from shlex import quote

import pytest
from made_once import change

from vibsim.plan import Names

from .conftest import Place, here
from .interrupts import processes, words

SCRIPTS = {
    "submit": 'setsid sh "$1" > /dev/null 2>&1 < /dev/null &\necho $!',
    "status": 'if kill -0 "$1" 2> /dev/null; then echo running; else echo success; fi',
    "cancel": 'for job in "$@"; do kill -9 "-$job"; done; echo "$@" >> cancelled',
}


def scheduler(folder: Path) -> list[str]:
    """Return the options of a run whose jobs go to a scheduler in `folder`."""
    folder.mkdir()
    options = ["--executor", "cluster-generic", "--jobs", "4", "--"]
    for name, text in SCRIPTS.items():
        script = folder / name
        script.write_text(f"#!/bin/sh\ncd {quote(str(folder))}\necho >> {name}.calls\n{text}\n")
        script.chmod(0o755)
        options += [f"--cluster-generic-{name}-cmd", str(script)]
    return [*options, "--seconds-between-status-checks", "1"]


def test_jobs_of_a_scheduler_give_the_same_bytes(place: Place, tmp_path: Path) -> None:
    wanted = place.content()
    other = Place(place.folder, elsewhere=tmp_path / "shared results")
    ended = other.run(*scheduler(tmp_path / "scheduler"))
    assert ended.returncode == 0, ended.stdout + ended.stderr
    found = other.content()
    assert found.keys() == wanted.keys()
    assert [name for name in wanted if found[name] != wanted[name]] == []
    # simulations, analysis and report; the index is made here
    assert len((tmp_path / "scheduler/submit.calls").read_text().splitlines()) == 3
    assert other.jobs() == []


def test_an_interrupt_cancels_what_was_submitted(place: Place, tmp_path: Path) -> None:
    change(place.file, "[6, 7, 8, 9]", "[27, 28]")
    change(place.file, "schemes:", "samples: common\nschemes:")
    results = tmp_path / "results"
    command = [sys.executable, "-m", "vibsim", "run", str(place.file), "--results", str(results)]
    command += scheduler(tmp_path / "scheduler")
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + 60
        while not computing(results) and time.monotonic() < deadline:
            time.sleep(0.1)
        assert computing(results)
        process.send_signal(signal.SIGTERM)
        _, told = process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM
    assert "cancelling what was submitted" in told
    jobs = (tmp_path / "scheduler/cancelled").read_text().split()
    assert len(jobs) == len((tmp_path / "scheduler/submit.calls").read_text().splitlines())
    deadline = time.monotonic() + 10
    while computing(results) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not computing(results)


def computing(results: Path) -> list[int]:
    """Return the jobs that make levels of some results."""
    return [pid for pid in processes(str(results)) if " simulate " in words(pid)]


def test_memory_holds_what_the_executor_needs_and_grows_with_each_attempt(place: Place) -> None:
    names = Names.of([str(place.file)], str(place.results), Path(), overhead=500, cores=3)
    (simulation,) = names.simulations
    asked = names.memory(simulation.megabytes)
    assert asked(None, 1) == simulation.megabytes + 500
    assert asked(None, 3) == 3 * asked(None, 1)


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        (["--executor", "cluster-generik", "--jobs", "2"], "did you mean 'cluster-generic'?"),
        (["--executor", "cluster-generic"], "needs --jobs N"),
        (["--profile", "nowhere"], "must be a folder with the file config.yaml"),
        (["--jobs", "2"], "belongs to --executor"),
    ],
)
def test_what_no_executor_can_do_is_refused(
    tmp_path: Path, place: Place, options: list[str], rule: str
) -> None:
    ended = here("run", place.file, "--results", tmp_path / "none", *options)
    assert ended.returncode == 2
    assert rule in ended.stderr
    assert not (tmp_path / "none").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["copy"]
