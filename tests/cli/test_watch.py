"""``vibsim watch``: a run for each save, also of a faulty file, until a signal ends it."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import IO

import pytest

from vibsim.cli import main
from vibsim.cli.commands import watch

TEXT = """\
title: A car on a road
model:
  kind: vehicle
  road: {table: road.csv, x: place, h: height}
initial: {u: 0.1}
time: {end: 2.0}
levels: [5, 6]
schemes: [rk4]
"""
ROAD = "place,height\n0,0\n1,0.1\n2,0\n3,0\n"


class EndedError(Exception):
    """Ends a watch that waits."""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "car.yaml"
    path.write_text(TEXT)
    (tmp_path / "road.csv").write_text(ROAD)
    return path


def watched(
    monkeypatch: pytest.MonkeyPatch, file: Path, steps: list[Callable[[], object]], *options: str
) -> list[list[str]]:
    """Return the commands that a watch starts while each pause does one of some steps."""
    found: list[list[str]] = []
    left = iter(steps)

    def pause(_: float) -> None:
        step = next(left, None)
        if step is None:
            raise EndedError
        step()

    monkeypatch.setattr(watch.time, "sleep", pause)
    monkeypatch.setattr(watch.supervise, "child", found.append)
    with pytest.raises(EndedError):
        watch.watch(_options(file, *options))
    return found


def _options(file: Path, *options: str) -> object:
    from vibsim.cli.arguments import parsed

    return parsed(["watch", str(file), *options])


def test_every_save_of_the_file_and_of_its_tables_is_a_run(
    monkeypatch: pytest.MonkeyPatch, file: Path
) -> None:
    road = file.with_name("road.csv")
    other = file.with_name("other.csv")

    def replace() -> None:
        copy = file.with_name("copy")
        copy.write_text(TEXT)
        copy.replace(file)

    steps = [
        lambda: None,
        lambda: file.write_text(TEXT + "# a comment\n"),
        lambda: road.write_text(ROAD + "4,0\n"),
        lambda: other.write_text("of nobody"),
        replace,
    ]
    found = watched(monkeypatch, file, steps)
    assert found == [["run", str(file)]] * 4


def test_a_file_that_is_away_for_a_moment_or_faulty_is_waited_for(
    monkeypatch: pytest.MonkeyPatch, file: Path
) -> None:
    steps = [file.unlink, lambda: None, lambda: file.write_text("title: no model\n"), lambda: None]
    assert len(watched(monkeypatch, file, [*steps, lambda: file.write_text(TEXT)])) == 3


def test_options_are_those_of_the_run(monkeypatch: pytest.MonkeyPatch, file: Path) -> None:
    options = ["--results", "there", "--cores", "2", "-q", "--allow-commands"]
    (found,) = watched(monkeypatch, file, [], *options)
    assert found[2:] == ["--results", "there", "--cores", "2", "--allow-commands", "--quiet"]
    (found,) = watched(monkeypatch, file, [], "--set", "time.end=1", "--set", "initial.u=0")
    assert found[2:] == ["--set", "time.end=1", "--set", "initial.u=0"]
    (found,) = watched(monkeypatch, file, [], "-v")
    assert found[2:] == ["--verbose"]
    _options(Path(found[1]), *found[2:])


@pytest.mark.parametrize("name", ["none.yaml", "road.csv"])
def test_what_is_no_experiment_file_is_refused(
    file: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    assert main(["watch", str(file.with_name(name))]) == 2
    assert "must be an existing experiment file" in capsys.readouterr().err


@pytest.mark.slow
def test_a_signal_ends_it(file: Path, tmp_path: Path) -> None:
    """It shows the faults of each version of the file, goes on, and ends with the status of the signal."""
    file.write_text("title: one\nmodel: {kind: pendulm}\n")
    command = [sys.executable, "-m", "vibsim", "watch", str(file), "--results", str(tmp_path / "r")]
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, preexec_fn=_heeds_interrupts
    ) as process:
        try:
            assert process.stderr is not None
            assert "did you mean 'pendulum'?" in _told(process.stderr)
            file.write_text("title: one\nmodel: {kind: vehicel}\n")
            assert "did you mean 'vehicle'?" in _told(process.stderr)
            process.send_signal(signal.SIGINT)
            _, rest = process.communicate(timeout=10)
        finally:
            process.kill()
    assert process.returncode == 130
    assert "Traceback" not in rest


def _heeds_interrupts() -> None:
    """Undo what the background of a shell does: its programs ignore this signal."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _told(stream: IO[str]) -> str:
    """Return what is written until the watch waits."""
    text = ""
    for line in stream:
        text += line
        if line.startswith("watching"):
            break
    return text
