"""What the system says of processes, by the kernel of Linux and in the ways that other systems have."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from vibsim.core import processes
from vibsim.core.temporary import temporary_folder

WAYS = pytest.mark.parametrize("on_linux", [True, False])
PARENT = """\
import os, subprocess, sys
child = subprocess.Popen([sys.executable, "-c", sys.argv[1], str(os.getpid())], stdout=subprocess.PIPE, text=True)
print(child.pid, child.stdout.readline(), flush=True)
os.kill(os.getpid(), 9)
"""
CHILD = """\
import sys, time
from vibsim.core import processes
processes._ON_LINUX = {}
processes.end_with(int(sys.argv[1]))
print("ready", flush=True)
time.sleep(60)
"""
# A process of its own: a test runner has threads, to which the signal could go.
WAITING = """\
import os, signal
from vibsim.core import processes
processes._ON_LINUX = {}
numbers = {{signal.SIGUSR1, signal.SIGUSR2}}
signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
print(processes.wait_for_signal(numbers, 0.0))
os.kill(os.getpid(), signal.SIGUSR2)
print(int(processes.wait_for_signal(numbers, 5.0)))
"""


@WAYS
def test_a_process_ends_with_the_one_that_started_it(on_linux: bool) -> None:
    command = [sys.executable, "-c", PARENT, CHILD.format(on_linux)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    child, ready = done.stdout.split()
    assert ready == "ready"
    until = time.monotonic() + 20.0
    while processes.started(int(child)) and time.monotonic() < until:
        time.sleep(0.02)
    assert not processes.started(int(child))


@WAYS
def test_a_start_tells_a_process_from_others_and_from_dead_ones(
    on_linux: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(processes, "_ON_LINUX", on_linux)
    assert processes.started(os.getpid()) == processes.started(os.getpid()) != processes.started(1)
    child = subprocess.Popen([sys.executable, "-c", ""])
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)  # it stays a zombie
    assert processes.started(child.pid) == ""
    child.wait()
    assert processes.started(child.pid) == ""


@WAYS
def test_a_signal_is_waited_for(on_linux: bool) -> None:
    done = subprocess.run([sys.executable, "-c", WAITING.format(on_linux)], stdout=subprocess.PIPE)
    assert done.stdout.split() == [b"0", b"%d" % signal.SIGUSR2]


def test_every_system_has_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    assert processes.usable_cores() == len(os.sched_getaffinity(0))
    monkeypatch.delattr(os, "sched_getaffinity")
    assert processes.usable_cores() == os.cpu_count()


def test_a_temporary_folder_is_gone_also_when_its_removal_is_interrupted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    remove, asked = shutil.rmtree, []

    def interrupted(folder: Path, **options: bool) -> None:
        asked.append(folder)
        if len(asked) == 1:
            raise KeyboardInterrupt
        remove(folder, **options)

    monkeypatch.setattr(shutil, "rmtree", interrupted)
    with pytest.raises(KeyboardInterrupt), temporary_folder() as folder:
        (folder / "file").touch()
    assert asked == [folder, folder]
    assert not folder.exists()
