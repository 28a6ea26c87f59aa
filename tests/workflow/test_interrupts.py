"""A run ends when it is told to, or is killed, with everything that it has started, and leaves nothing locked."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from torture.kills import TOLD
from torture.laboratory import is_free, processes, words

from vibsim.cli import supervise
from vibsim.cli.jobs import simulate
from workflow.conftest import here

LONG = """\
title: A run of minutes
model: {kind: pendulum}
initial: {theta: 1.0}
time: {end: 20.0}
levels: [6, 32]
schemes: [central]
"""
LIMIT = 10.0
"""Seconds within which a run must have ended."""


@pytest.fixture(autouse=True)
def heeded() -> Iterator[None]:
    """Heed the signals: a shell starts what runs in the background with some of them ignored, and they stay so."""
    before = {number: signal.getsignal(number) for number in (signal.SIGHUP, signal.SIGINT)}
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def run(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """Return a run whose job is simulating, in a group of its own."""
    file, results = tmp_path / "long.yaml", tmp_path / "results"
    file.write_text(LONG)
    command = [sys.executable, "-m", "vibsim", "run", str(file), "--results", str(results)]
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        try:
            wait_for(
                lambda: [pid for pid in processes(str(tmp_path)) if " simulate " in words(pid)]
            )
            yield process
        finally:
            for pid in processes(str(tmp_path)):
                sent(pid, signal.SIGKILL)


def sent(pid: int, number: int) -> None:
    with suppress(ProcessLookupError):
        os.kill(pid, number)


def wait_for(found: Callable[[], object]) -> None:
    deadline = time.monotonic() + 60
    while not found():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def nothing_is_left(folder: Path) -> bool:
    return is_free(folder / "results") and not processes(folder)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "status"),
    [
        (signal.SIGTERM, 143),
        pytest.param(signal.SIGINT, 130, marks=pytest.mark.slow),
        pytest.param(signal.SIGHUP, 129, marks=pytest.mark.slow),
    ],
)
def test_a_run_ends_when_it_alone_is_told_to(
    run: subprocess.Popen[str], tmp_path: Path, number: int, status: int
) -> None:
    run.send_signal(number)
    _, err = run.communicate(timeout=LIMIT)
    assert run.returncode == status
    assert err.endswith(f"{TOLD}\n")
    assert nothing_is_left(tmp_path)


@pytest.mark.slow
def test_a_run_ends_with_its_workflow(run: subprocess.Popen[str], tmp_path: Path) -> None:
    (snakemake,) = (pid for pid in processes(str(tmp_path)) if "snakemake" in words(pid))
    sent(snakemake, signal.SIGTERM)
    _, err = run.communicate(timeout=LIMIT)
    assert run.returncode == 143
    assert err.endswith(f"{TOLD}\n")
    assert nothing_is_left(tmp_path)


@pytest.mark.slow
def test_a_killed_workflow_is_told_of(run: subprocess.Popen[str], tmp_path: Path) -> None:
    (snakemake,) = (pid for pid in processes(str(tmp_path)) if "snakemake" in words(pid))
    sent(snakemake, signal.SIGKILL)
    _, err = run.communicate(timeout=LIMIT)
    assert run.returncode == 1
    assert "the workflow was killed by SIGKILL" in err
    assert nothing_is_left(tmp_path)


@pytest.mark.slow
def test_a_killed_run_leaves_nothing_at_work_and_no_lock(
    run: subprocess.Popen[str], tmp_path: Path
) -> None:
    run.kill()
    run.communicate(timeout=LIMIT)
    wait_for(lambda: nothing_is_left(tmp_path))


def test_an_interrupt_that_a_library_takes_for_its_own_fault_is_one() -> None:
    """As it happens where it comes while numpy imports its C code."""
    program = """
import os, signal, sys
from vibsim.cli import arguments, main
def parsed(_):
    try:
        os.kill(os.getpid(), signal.SIGINT)
        signal.pause()
    except BaseException:
        raise ImportError("failed to import") from None
arguments.parsed = parsed
sys.exit(main())
"""
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, check=False)
    assert (done.returncode, done.stderr) == (130, f"{TOLD}\n")


@pytest.mark.slow
def test_a_signal_that_is_ignored_stays_so(tmp_path: Path) -> None:
    """As `nohup` does: a run goes on when its terminal goes away."""
    file = tmp_path / "long.yaml"
    file.write_text(LONG)
    command = f"trap '' HUP; exec {sys.executable} -m vibsim simulate {file} --level 32"
    with subprocess.Popen(["sh", "-c", f"{command} --results {tmp_path}"]) as process:
        time.sleep(3)
        process.send_signal(signal.SIGHUP)
        time.sleep(1)
        assert process.poll() is None
        process.terminate()
        assert process.wait(LIMIT) == 143
    assert nothing_is_left(tmp_path)


def test_an_interrupt_that_a_library_passes_off_as_its_own_fault_is_an_interrupt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "long.yaml"
    file.write_text(LONG)

    def make(*_: object) -> None:
        supervise._request = signal.SIGINT
        raise RuntimeError("schema error: Interrupted: 2")

    monkeypatch.setattr(supervise, "_request", 0)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(simulate, "_make", make)
    with pytest.raises(supervise.Interrupted):
        here("simulate", file, "--level", "6", "--results", tmp_path)
    assert not list(tmp_path.glob("vibsim-error-*"))
