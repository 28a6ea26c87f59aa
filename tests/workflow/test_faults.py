"""Damage, kills and runs at the same time: afterwards the same command just works."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from forked import vibsim

from vibsim.cli.run import snakemake

from .conftest import TEXT, Place


def flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "harm"),
    [
        ("summary.json", cut),
        ("convergence.nc", flip),
        ("convergence.nc", cut),
        ("level_07.nc", cut),
        ("summary.json", flip),
    ],
)
def test_a_damaged_file_is_named_deleted_and_made_again(
    place: Place, finished: Place, name: str, harm: object
) -> None:
    assert callable(harm)
    harm(place.tiny / name)
    ended = place.run()
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "to be made again" in ended.stderr
    assert name in ended.stderr
    assert place.content() == finished.content()
    assert place.jobs() == []


@pytest.mark.slow
def test_damage_that_keeps_the_time_of_the_file_is_seen_by_whatever_reads_it(
    place: Place, finished: Place
) -> None:
    path = place.tiny / "level_07.nc"
    status = path.stat()
    flip(path)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    place.change("order: scheme", "order: 2")
    ended = place.run()
    assert ended.returncode == 0
    assert "level_07.nc" in ended.stderr
    assert place.content()["adhoc/tiny/level_07.nc"] == finished.content()["adhoc/tiny/level_07.nc"]


@pytest.mark.slow
def test_swapped_files_are_seen(place: Place, finished: Place) -> None:
    first, second = place.tiny / "level_06.nc", place.tiny / "level_07.nc"
    other = place.tiny / "swap"
    first.rename(other)
    second.rename(first)
    other.rename(second)
    os.utime(first)
    os.utime(second)
    ended = place.run()
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert place.content() == finished.content()


@pytest.mark.slow
def test_results_without_snakemakes_records_are_not_taken_for_others(place: Place) -> None:
    """Snakemake sees no changed parameter when its records are gone; the digests in the files do."""
    import shutil

    shutil.rmtree(place.results / ".snakemake")
    place.change("g: 1.0", "g: 1.5")
    ended = place.run()
    assert ended.returncode == 0, ended.stdout + ended.stderr
    for name in ("level_06.nc", "level_09.nc", "summary.json"):
        assert name in ended.stderr


def start(place: Place) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "vibsim", "run", str(place.file), "--results"]
    return subprocess.Popen(
        [*command, str(place.results), "--cores", "2"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_for(path: Path, process: subprocess.Popen[str]) -> None:
    """Wait until a run that is still at work has come to make `path`."""
    deadline = time.monotonic() + 120
    while not path.exists():
        assert process.poll() is None, f"the run ended before it made {path.name}"
        assert time.monotonic() < deadline, f"{path.name} is not made"
        time.sleep(0.005)
    assert process.poll() is None, f"the run ended as soon as it had made {path.name}"


def wait_for_end(group: int) -> None:
    """Wait until no process of a killed group is left: until the system has reaped one, it counts as alive."""
    deadline = time.monotonic() + 60
    with suppress(ProcessLookupError):
        while time.monotonic() < deadline:
            os.killpg(group, 0)
            time.sleep(0.01)


@pytest.mark.slow
def test_two_runs_at_once_both_succeed_and_one_waits(tmp_path: Path, finished: Place) -> None:
    place = Place(tmp_path)
    place.file.parent.mkdir()
    place.file.write_text(TEXT)
    with start(place) as first:
        wait_for(place.results / ".vibsim/run.json", first)
        second = place.run()
        out, err = first.communicate()
    assert first.returncode == 0, out + err
    assert second.returncode == 0, second.stdout + second.stderr
    assert f"waiting for another run in {place.results} (process {first.pid})" in second.stderr
    assert place.content() == finished.content()


def test_a_job_refuses_when_its_file_changed_after_it_was_planned(
    place: Place, tmp_path: Path
) -> None:
    out = tmp_path / "x.nc"
    command = ["simulate", place.file, "--level", 6, "--out", out, "--results", place.results]
    ended = vibsim(*command, "--digest", "0" * 64)
    assert ended.returncode == 2
    assert "changed after this job was planned" in ended.stderr
    assert not out.exists()


TRAP = """
import sys
def full(event, arguments):
    if event == "open" and "/other/.level_07.nc." in str(arguments[0]):
        raise OSError(28, "No space left on device")
sys.addaudithook(full)
"""


@pytest.fixture
def trap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make level 7 of an experiment with the name `other` fail."""
    path = tmp_path / "trap/sitecustomize.py"
    path.parent.mkdir()
    path.write_text(TRAP)
    paths = [str(path.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(paths))
    return path


@pytest.mark.slow
def test_a_failing_job_is_named_with_its_log_and_the_others_go_on(place: Place, trap: Path) -> None:
    other = place.file.with_name("other.yaml")
    other.write_text(TEXT)
    place.change("A tiny", "Another")
    ended = place.run(files=[place.file, other], forked_jobs=False)
    assert ended.returncode == 1
    assert "failed: simulate adhoc/other level_06.nc to level_09.nc" in ended.stdout
    quiet = place.run("-q", files=[place.file, other], forked_jobs=False)
    assert (quiet.returncode, quiet.stdout) == (1, "")
    assert "level_07.nc: No space left on device" in quiet.stderr
    assert "level_06_to_09.log" in ended.stdout
    assert "vibsim: adhoc/other, level 7, member 0: " in ended.stdout
    assert "adhoc/other/level_07.nc: No space left on device" in ended.stdout
    assert "Another" in (place.tiny / "report.html").read_text()
    assert "other" in (place.results / "index.html").read_text()


@pytest.mark.slow
def test_a_failing_level_does_not_cost_those_that_share_its_job(place: Place, trap: Path) -> None:
    other = place.file.with_name("other.yaml")
    other.write_text(TEXT)
    assert place.run(files=[other], forked_jobs=False).returncode == 1
    folder = place.results / "adhoc/other"
    kept = {path: path.stat().st_ino for path in folder.glob("level_*.nc")}
    assert [path.name for path in sorted(kept)] == ["level_06.nc", "level_08.nc", "level_09.nc"]
    trap.unlink()
    assert place.jobs(files=[other]) == ["level_07", "analyse", "report", "index"]
    assert place.run(files=[other]).returncode == 0
    # What is written anew is another file, put in the place of the old one.
    assert {path: path.stat().st_ino for path in kept} == kept
    assert (folder / "level_07.nc").is_file()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "is_refused"),
    [("theta: 1.0", "theta: 0.5", True), ("title: A", "# a word\ntitle: A", False)],
)
def test_a_file_that_is_edited_while_it_is_run_costs_one_round(
    place: Place,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    old: str,
    new: str,
    is_refused: bool,
) -> None:
    right, rounds = snakemake.run, tmp_path / "rounds"

    def edit_first(*arguments: Any) -> snakemake.Outcome:
        with rounds.open("a") as file:
            file.write("x")
        place.change(old, new)
        return right(*arguments)

    monkeypatch.setattr(snakemake, "run", edit_first)
    (place.tiny / "report.html").unlink()
    ended = place.run()
    assert rounds.read_text() == "x"
    assert ended.returncode == int(is_refused)
    told = f"{place.file}: was edited while it was run; run it again"
    assert (told in ended.stderr) == is_refused
