"""Interleaved timing: A B C A B C ..., so that a machine whose speed drifts is the same to all of them."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Process:
    """What one whole process cost."""

    wall: float
    cpu: float
    peak_mib: float


def interleave(contestants: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, float]:
    """Return the median of what each contestant returns, after one round that does not count."""
    for run in contestants.values():
        run()
    times: dict[str, list[float]] = {name: [] for name in contestants}
    for _ in range(rounds):
        for name, run in contestants.items():
            times[name].append(run())
    return {name: statistics.median(values) for name, values in times.items()}


def seconds(function: Callable[[], object]) -> Callable[[], float]:
    """Wrap `function` so that it returns how long it took."""

    def timed() -> float:
        began = time.perf_counter()
        function()
        return time.perf_counter() - began

    return timed


def process(
    command: Sequence[str], cwd: Path | None = None, environment: Mapping[str, str] | None = None
) -> Process:
    """Run `command` to its end and return what it cost, itself and its children.

    Raises
    ------
    RuntimeError
        Where the command fails: a benchmark of a failure means nothing.
    """
    program = (
        "import resource, subprocess, sys, time\n"
        "began = time.perf_counter()\n"
        "done = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)\n"
        "wall = time.perf_counter() - began\n"
        "use = resource.getrusage(resource.RUSAGE_CHILDREN)\n"
        "sys.stderr.write(done.stderr.decode()[-2000:] if done.returncode else '')\n"
        "print(wall, use.ru_utime + use.ru_stime, use.ru_maxrss / 1024, done.returncode)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *command],
        capture_output=True,
        text=True,
        env={**os.environ, **(environment or {})},
        cwd=cwd,
        check=True,
    )
    wall, cpu, peak, status = map(float, done.stdout.split())
    if status:
        end = " ".join(done.stderr.split())[-400:]
        raise RuntimeError(f"{' '.join(command[:6])} ... exited with {status:.0f}: ... {end}")
    return Process(wall, cpu, peak)
