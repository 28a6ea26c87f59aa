"""Files of a cache: as they were written, or none; and one job at a time."""

from __future__ import annotations

import fcntl
import hashlib
from pathlib import Path

import pytest

from vibsim import sealed

CONTENT, LABEL = b"twelve bytes", b"entry\0"


def damaged(whole: bytes) -> list[bytes]:
    """Return a file with every single bit changed, every beginning of it, and a longer one."""
    bits = [
        whole[:k] + bytes([whole[k] ^ 1 << bit]) + whole[k + 1 :]
        for k in range(len(whole))
        for bit in range(8)
    ]
    return [*bits, *(whole[:k] for k in range(len(whole))), whole + b"\0"]


@pytest.mark.parametrize("label", [b"", LABEL])
def test_a_file_is_as_it_was_written_or_none(tmp_path: Path, label: bytes) -> None:
    path = tmp_path / "entry"
    assert sealed.read(path, label) is None
    sealed.write(path, CONTENT, label)
    whole = path.read_bytes()
    assert whole == CONTENT + hashlib.sha256(label + CONTENT).digest()
    assert sealed.read(path, label) == CONTENT
    assert sealed.read(path, label + b"another") is None
    for other in damaged(whole):
        path.write_bytes(other)
        assert sealed.read(path, label) is None


def test_an_empty_file_with_its_seal_is_none(tmp_path: Path) -> None:
    sealed.write(tmp_path / "empty", b"")
    assert sealed.read(tmp_path / "empty") is None


def test_a_file_that_cannot_be_read_or_written_is_told(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        sealed.read(tmp_path)
    with pytest.raises(FileNotFoundError):
        sealed.write(tmp_path / "no folder" / "entry", CONTENT)


def test_a_file_without_a_seal_is_put_in_the_place_of_another(tmp_path: Path) -> None:
    path = tmp_path / "text"
    for content in (b"first", b"second"):
        sealed.put(path, content)
        assert path.read_bytes() == content
    assert list(tmp_path.iterdir()) == [path]


def test_a_lock_is_held_by_one_at_a_time_and_let_go_after_a_fault(tmp_path: Path) -> None:
    path = tmp_path / "lock"

    def work_beside(other: int) -> None:
        with pytest.raises(BlockingIOError):
            fcntl.flock(other, fcntl.LOCK_SH | fcntl.LOCK_NB)
        raise ZeroDivisionError

    with path.open("w") as one, path.open("w") as other:
        with pytest.raises(ZeroDivisionError), sealed.held(one):
            work_beside(other.fileno())
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
