"""Hostile environments: always an end, a sentence and the exit status that is documented; never a traceback."""

from __future__ import annotations

import errno
import fcntl
import os
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import forked
import pytest
from torture.harm import disk

from vibsim.cli import main

from .test_cli_commands import TEXT

SOMEBODY = 12345
"""A user whom the system does not know."""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "tiny.yaml"
    path.write_text(TEXT)
    return path


def vibsim(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a command, and see that it ends without a traceback."""
    ended = forked.vibsim(*arguments)
    assert "Traceback" not in ended.stdout + ended.stderr
    return ended


def started(*arguments: object, before: Callable[[], None]) -> subprocess.CompletedProcess[str]:
    """Run a command by an interpreter of its own: where its limits count."""
    ended = subprocess.run(
        [sys.executable, "-m", "vibsim", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        preexec_fn=before,
    )
    assert "Traceback" not in ended.stdout + ended.stderr
    return ended


def limit(what: int, size: int) -> Callable[[], None]:
    return lambda: resource.setrlimit(what, (size, size))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["x" * 300, "/".join(["y" * 99] * 50)], ids=["300", "5000"])
def test_a_path_that_is_too_long_is_refused(file: Path, tmp_path: Path, name: str) -> None:
    for ended in (
        vibsim("run", file, "--results", tmp_path / name),
        vibsim("check", tmp_path / f"{name}.yaml"),
        vibsim("run", f"{name}.yaml", "--results", tmp_path),
    ):
        assert ended.returncode == 2
        assert "File name too long" in ended.stderr


def test_a_folder_that_leaves_no_room_for_names_is_refused(file: Path, tmp_path: Path) -> None:
    """The path is short enough, and those of the files in it are not."""
    length = 4094 - len(str(tmp_path))
    deep = "/".join(["y" * 99] * 50)[:length].rstrip("/")
    ended = vibsim("run", file, "--results", tmp_path / deep)
    assert ended.returncode in (1, 2)
    assert "File name too long" in ended.stderr


def test_a_file_to_write_with_a_name_that_is_too_long(file: Path, tmp_path: Path) -> None:
    arguments = ["simulate", file, "--level", 5, "--results", tmp_path]
    ended = vibsim(*arguments, "--out", tmp_path / ("x" * 300))
    assert ended.returncode == 1
    assert ended.stderr.endswith("File name too long\n")


@pytest.mark.parametrize("megabytes", [100, 150, 200, 300])
def test_too_little_memory_is_told_with_what_is_needed(file: Path, megabytes: int) -> None:
    ended = started("check", file, before=limit(resource.RLIMIT_AS, megabytes * 10**6))
    assert ended.returncode == 1
    text = f"the limit is {megabytes} MB (ulimit -v), 600 MB are needed"
    assert ended.stderr == f"vibsim: not enough memory: {text}\n"


@pytest.mark.slow
@pytest.mark.parametrize("kilobytes", [2, 12])
def test_a_limit_of_the_size_of_files_is_named(file: Path, tmp_path: Path, kilobytes: int) -> None:
    """The library says only `HDF error`, wherever in the file it comes to the limit."""
    file.write_text(TEXT.replace("7]", "10]"))
    ended = started(
        *("simulate", file, "--level", 10, "--results", tmp_path, "--out", tmp_path / "level.nc"),
        before=limit(resource.RLIMIT_FSIZE, kilobytes * 1024),
    )
    assert ended.returncode == 1
    assert ended.stderr.endswith("level.nc: File too large\n")
    assert not list(tmp_path.glob("*level.nc*"))


@contextmanager
def small_disk(tmp_path: Path, kilobytes: int) -> Iterator[Path]:
    """Have a disk of some kilobytes; that takes the right to mount one."""
    folder = tmp_path / f"disk_{kilobytes}"
    with disk(folder, kilobytes) as is_there:
        if not is_there:
            pytest.skip(
                "no disk can be mounted here: full disks are not tried, limits of files are"
            )
        yield folder


@pytest.mark.slow
def test_a_full_disk_is_named(file: Path, tmp_path: Path) -> None:
    file.write_text(TEXT.replace("7]", "10]"))
    for kilobytes in (4, 24):
        with small_disk(tmp_path, kilobytes) as folder:
            ended = vibsim("simulate", file, "--level", 10, "--out", folder / "level.nc")
            assert ended.returncode == 1, kilobytes
            assert ended.stderr.endswith("level.nc: No space left on device\n")
            assert list(folder.iterdir()) == []


def test_an_index_on_a_full_disk(tmp_path: Path) -> None:
    with small_disk(tmp_path, 4) as folder:
        ended = vibsim("report", "--results", folder)
        assert ended.returncode == 1
        assert ended.stderr.endswith("No space left on device\n")


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_system_without_locks_is_refused(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    def flock(*_: object) -> None:
        raise OSError(number, "no locks")

    monkeypatch.setattr(fcntl, "flock", flock)
    ended = vibsim("run", file, "--results", tmp_path / "results")
    assert ended.returncode == 1
    assert "file system has no file locks (flock)" in ended.stderr
    assert "--results" in ended.stderr


needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can be another user")


def as_somebody(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a command as a user without a name and a home, who may read everything."""
    variables = [f"--unset={name}" for name in ("HOME", "USER", "LOGNAME", "XDG_CACHE_HOME")]
    user = ["--reuid", str(SOMEBODY), "--regid", str(SOMEBODY), "--clear-groups"]
    right = ["--inh-caps", "+dac_read_search", "--ambient-caps", "+dac_read_search"]
    command = ["env", *variables, "setpriv", *user, *right, sys.executable, "-m", "vibsim"]
    ended = subprocess.run(
        [*command, *map(str, arguments)], capture_output=True, text=True, check=False, timeout=300
    )
    assert "Traceback" not in ended.stdout + ended.stderr
    return ended


@pytest.mark.slow
@needs_root
def test_results_of_another_user(file: Path, tmp_path: Path) -> None:
    results = tmp_path / "results"
    (results / ".vibsim").mkdir(parents=True)
    (results / ".vibsim/lock").touch()
    ended = as_somebody("run", file, "--results", results)
    assert ended.returncode == 1
    assert f"vibsim: {results}: cannot be written (Permission denied)\n" in ended.stderr


@needs_root
@pytest.mark.slow
def test_a_user_without_a_home_and_files_of_others_below(file: Path, tmp_path: Path) -> None:
    results = tmp_path / "results"
    results.mkdir()
    os.chown(results, SOMEBODY, SOMEBODY)
    ended = as_somebody("run", file, "--results", results)
    # levels as coarse as these may leave a check open
    assert "failed" not in ended.stdout, ended.stdout
    assert (results / "index.html").is_file()
    assert f"all results: {results / 'index.html'}\n" in ended.stdout
    assert not list(results.rglob("~*"))
    for path in (results / "index.html", results):
        os.chown(path, 0, 0)
    file.write_text(TEXT.replace("20.0", "21.0"))
    ended = as_somebody("run", file, "--results", results)
    assert ended.returncode == 1
    assert "index.html" in ended.stdout + ended.stderr
    assert "report: " not in ended.stdout


def test_a_report_in_the_place_of_a_file_is_refused(file: Path, tmp_path: Path) -> None:
    for command in (["report", file], ["report"], ["analyse", file]):
        for place in (file, file / "below"):
            ended = vibsim(*command, "--results", tmp_path / "results", "--out", place)
            assert ended.returncode == 2
            assert "--out" in ended.stderr
            assert "must be a folder, " in ended.stderr


@needs_root
@pytest.mark.slow
def test_a_report_in_the_folder_of_another_user_is_refused(file: Path, tmp_path: Path) -> None:
    ended = as_somebody("report", file, "--out", tmp_path / "new")
    assert ended.returncode == 2
    assert f"{tmp_path / 'new'}: must be a folder to write to, " in ended.stderr


STRANGE = [
    "L" * 400,
    "é" * 400,
    "../../x",
    "a\"b'c",
    "$(touch x); `y`",
    "<b>&amp;</b>",
    "..",
]


@pytest.mark.slow
def test_labels_of_any_kind_have_reports(tmp_path: Path) -> None:
    import yaml

    file, results = tmp_path / "labels.yaml", tmp_path / "results"
    content = yaml.safe_load(TEXT)
    content["schemes"] = [{"kind": "central", "label": label} for label in STRANGE]
    file.write_text(yaml.safe_dump(content))
    ended = vibsim("check", file)
    assert ended.returncode == 0, ended.stderr
    common = (file, "--results", results)
    for command in (["simulate", *common, "--level", 5, 6, 7], ["analyse", *common]):
        assert vibsim(*command).returncode == 0
    ended = vibsim("report", *common)
    assert ended.returncode == 0, ended.stderr
    made = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert all(path.is_relative_to(results) or path.parent == tmp_path for path in made)
    assert not (tmp_path / "x").exists()


def test_a_fault_of_vibsim_is_told_in_short_and_kept_in_full(
    file: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from vibsim.cli.commands import plan

    def broken(*_: object, **__: object) -> None:
        raise KeyError("nobody expects this")

    monkeypatch.setattr(plan, "plans_of", broken)
    assert main(["check", str(file)]) == 1
    told = capsys.readouterr().err
    assert "Traceback" not in told
    assert "internal error, test_hostile.py, line" in told
    assert "KeyError: 'nobody expects this'" in told
    path = Path(told.rpartition("its full text: ")[2].strip().removesuffix(")"))
    assert "Traceback" in path.read_text()
    path.unlink()
