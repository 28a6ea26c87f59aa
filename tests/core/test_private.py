"""The private cache: entries as they were written, made once, and out of reach of others; or no cache at all."""

from __future__ import annotations

import errno
import fcntl
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from vibsim.core import private_cache

NAME, CONTENT = "ab" * 32, b"twelve bytes"
STRANGER = 12345
"""Id of another user."""


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(tmp_path / "cache"))
    private_cache._opened.cache_clear()
    return tmp_path / "cache"


def ask(name: str = NAME, content: bytes = CONTENT, kind: str = "plans") -> bytes:
    return private_cache.cached(kind, name, lambda: content, bytes, bytes)


def again(home: Path) -> bytes:
    """Ask for the entry as another process would; what would be made anew is told apart."""
    private_cache._opened.cache_clear()
    return ask(content=b"made anew")


def entry(home: Path) -> Path:
    return home / "plans" / NAME


def give_away(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Make a file another user's; whoever is not root becomes another user instead."""
    if os.geteuid() == 0:
        os.chown(path, STRANGER, STRANGER, follow_symlinks=False)
    else:
        monkeypatch.setattr(os, "geteuid", lambda: STRANGER)


def test_an_entry_is_made_once_and_closed_to_others(home: Path) -> None:
    before = os.umask(0)
    try:
        assert ask() == CONTENT
    finally:
        os.umask(before)
    assert again(home) == CONTENT
    for path in (home, home / "plans"):
        assert path.stat().st_mode & 0o777 == 0o700
    assert not entry(home).stat().st_mode & 0o022


def test_every_damage_is_seen(home: Path) -> None:
    ask()
    whole = entry(home).read_bytes()
    bits = [
        whole[:k] + bytes([whole[k] ^ 1 << bit]) + whole[k + 1 :]
        for k in range(len(whole))
        for bit in range(8)
    ]
    for damaged in (*bits, *(whole[:k] for k in range(len(whole))), whole + b"\0"):
        entry(home).write_bytes(damaged)
        folder = private_cache.opened("plans")
        assert folder is not None
        assert folder.read(NAME) is None


def test_an_entry_under_another_name_or_of_another_kind_is_none(home: Path) -> None:
    ask()
    other = "cd" * 32
    ask(other, b"another")
    ask(kind="kernels")
    whole, another = entry(home).read_bytes(), (home / "plans" / other).read_bytes()
    entry(home).write_bytes(another)
    assert again(home) == b"made anew"
    (home / "kernels" / NAME).write_bytes(whole)
    assert ask(content=b"made anew", kind="kernels") == b"made anew"


def as_link(path: Path, outside: Path) -> None:
    path.replace(outside)
    path.symlink_to(outside)


def as_second_name(path: Path, outside: Path) -> None:
    os.link(path, outside)


def as_pipe(path: Path, outside: Path) -> None:
    path.replace(outside)
    os.mkfifo(path)


def as_writable(path: Path, outside: Path) -> None:
    path.chmod(0o666)
    outside.write_bytes(b"")


@pytest.mark.parametrize("change", [as_link, as_second_name, as_pipe, as_writable])
@pytest.mark.parametrize("which", ["entry", "lock"])
def test_a_file_that_is_not_ours_alone_is_as_good_as_missing(
    home: Path, tmp_path: Path, change: Callable[[Path, Path], None], which: str
) -> None:
    ask()
    path = entry(home) if which == "entry" else home / "plans" / f"lock_{NAME[:2]}"
    outside = tmp_path / "outside"
    change(path, outside)
    before = outside.read_bytes()
    assert again(home) == (b"made anew" if which == "entry" else CONTENT)
    assert outside.read_bytes() == before


@pytest.mark.parametrize("which", ["entry", "folder", "cache", "way"])
def test_what_belongs_to_another_user_is_not_used(
    home: Path, monkeypatch: pytest.MonkeyPatch, which: str
) -> None:
    way = home.parent / "way"
    way.mkdir()
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(way / "cache"))
    home = way / "cache"
    ask()
    give_away(
        {"entry": entry(home), "folder": home / "plans", "cache": home, "way": way}[which],
        monkeypatch,
    )
    assert again(home) == b"made anew"
    with private_cache.provided() as problem:
        assert bool(problem) == (which != "entry" or os.geteuid() != 0)


@pytest.mark.parametrize("which", ["plans", ".", ".."])
@pytest.mark.parametrize("mode", [0o777, 0o770, 0o702, 0o1777])
def test_a_folder_that_others_can_write_to_is_not_used_nor_changed(
    home: Path, which: str, mode: int
) -> None:
    ask()
    folder = home / which
    folder.chmod(mode)
    # in a sticky folder above, nobody can rename what is another's
    is_used = which == ".." and mode == 0o1777
    assert again(home) == (CONTENT if is_used else b"made anew")
    assert folder.stat().st_mode & 0o7777 == mode
    with private_cache.provided() as problem:
        assert (problem == "") == is_used
        assert is_used or "others can write to it" in problem
    folder.chmod(0o700)


def test_a_folder_of_ours_that_others_can_read_is_closed(home: Path) -> None:
    ask()
    (home / "plans").chmod(0o755)
    home.chmod(0o755)
    assert again(home) == CONTENT
    assert (home / "plans").stat().st_mode & 0o777 == 0o700
    # a folder that a user named may hold other things
    assert home.stat().st_mode & 0o777 == 0o755


def test_links_lead_to_the_cache_but_are_not_the_cache(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ask()
    link = tmp_path / "link"
    link.symlink_to(home)
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(link))
    assert again(home) == b"made anew"
    link.unlink()
    link.symlink_to(tmp_path)
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(link / "cache"))
    assert again(home) == CONTENT
    open_ = tmp_path / "open"
    open_.mkdir()
    open_.chmod(0o777)
    (open_ / "hop").symlink_to(tmp_path)
    link.unlink()
    link.symlink_to("open/hop")
    assert again(home) == b"made anew"
    link.unlink()
    link.symlink_to("link")
    assert again(home) == b"made anew"


@pytest.mark.parametrize("value", ["", ".cache", "relative"])
def test_a_relative_cache_home_is_not_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, value: str
) -> None:
    monkeypatch.delenv("VIBSIM_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", value)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert private_cache.place() == tmp_path / ".cache/vibsim"
    monkeypatch.setenv("HOME", "nowhere")
    with pytest.raises(OSError, match="no home"):
        private_cache.place()
    assert private_cache.opened("plans") is None


def test_without_a_cache_there_is_one_for_as_long_as_a_run_lasts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(tmp_path / "file"))
    assert again(tmp_path) == b"made anew"
    with private_cache.provided() as problem:
        assert problem.startswith(str(tmp_path / "file"))
        place = private_cache.place()
        ask()
        assert again(place) == CONTENT
    assert not place.exists()
    assert os.environ["VIBSIM_CACHE_DIR"] == str(tmp_path / "file")


def test_a_folder_is_bounded_and_what_was_used_last_stays(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(private_cache, "MOST_BYTES", 3 * 1040)
    for k, name in enumerate("abcd"):
        ask(name * 64, bytes(1000) + b"x")
        if k < 3:
            os.utime(home / "plans" / (name * 64), (k, k))
        if k == 2:
            ask("a" * 64)
    names = sorted(path.name[0] for path in (home / "plans").iterdir() if len(path.name) == 64)
    assert names == ["a", "c", "d"]
    monkeypatch.setattr(private_cache, "MOST_OF_ENTRY", 10)
    assert ask("e" * 64) == CONTENT
    assert not (home / "plans" / ("e" * 64)).exists()


JOB = """
import sys, time
from pathlib import Path
from vibsim.core import private_cache as private
def make():
    with Path(sys.argv[1]).open("a") as file:
        file.write("x")
    time.sleep(0.2)
    return b"content"
print(private.cached("plans", "ab" * 32, make, bytes, bytes))
"""


def test_where_there_are_no_file_locks_an_entry_is_made_and_kept(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def flock(descriptor: int, operation: int) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", flock)
    assert ask() == CONTENT
    assert again(home) == CONTENT


def test_processes_that_want_the_same_entry_make_it_once(home: Path, tmp_path: Path) -> None:
    count = tmp_path / "count"
    jobs = [
        subprocess.Popen([sys.executable, "-c", JOB, str(count)], stdout=subprocess.PIPE, text=True)
        for _ in range(4)
    ]
    assert {job.communicate()[0] for job in jobs} == {"b'content'\n"}
    assert count.read_text() == "x"
    assert not list(home.rglob("*.tmp"))
