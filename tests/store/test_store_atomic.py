from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from vibsim import store


def names(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir()]


def test_an_error_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    store.write_text(path, "old")

    def fail() -> None:
        with store.replacing(path) as temporary:
            temporary.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert path.read_text() == "old"
    assert names(tmp_path) == ["a.txt"]


def test_what_a_killed_writer_left_is_removed_by_the_next(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    program = (
        "import sys, time; from pathlib import Path; from vibsim import store\n"
        "with store.replacing(Path(sys.argv[1])) as t:\n"
        "    t.write_text('half'); print('ready', flush=True); time.sleep(60)"
    )
    writer = subprocess.Popen(
        [sys.executable, "-c", program, str(path)], stdout=subprocess.PIPE, text=True
    )
    with writer:
        assert writer.stdout is not None
        assert writer.stdout.readline() == "ready\n"
        store.write_text(path, "first")
        assert len(names(tmp_path)) == 2, "a living writer keeps its file"
        writer.send_signal(signal.SIGKILL)
    store.write_text(path, "second")
    assert names(tmp_path) == ["a.txt"]
    assert path.read_text() == "second"


def test_a_reader_sees_the_old_text_or_the_new_one(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    texts = ["a" * 200_000, "b" * 200_000]
    store.write_text(path, texts[0])
    program = (
        "import sys; from pathlib import Path; from vibsim import store\n"
        "for i in range(60): store.write_text(Path(sys.argv[1]), 'ab'[i % 2] * 200_000)"
    )
    with subprocess.Popen([sys.executable, "-c", program, str(path)]) as writer:
        while writer.poll() is None:
            assert path.read_text() in texts
            time.sleep(0.001)
    assert writer.returncode == 0
