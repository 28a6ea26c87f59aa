"""Other solvers, each in a process of its own that is kept alive and asked in turn.

The process runs `bench/worker.py` with the Python of .venv-peers, which has its own versions of everything; SciPy and
the ladder run in processes like it with the Python of vibsim. All of them are bound to one core.
"""

from __future__ import annotations

import json
import os
import re
import select
import statistics
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import IO, Any

from bench.native import NotHereError

ROOT = Path(__file__).resolve().parents[1]
ENVIRONMENT = ROOT / ".venv-peers"
PATIENCE = 180
"""Seconds that one answer may take."""


@cache
def python() -> Path:
    """Set the environment of the peers up and return its Python."""
    script = ROOT / "requirements" / "install.sh"
    done = subprocess.run(["sh", str(script), "peers"], capture_output=True, text=True, check=False)
    sys.stderr.write(done.stderr)
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
        raise NotHereError(f"requirements/install.sh peers: {last}")
    return ENVIRONMENT / "bin" / "python"


def versions() -> str:
    """Name the versions that requirements/peers.txt pins."""
    text = (ROOT / "requirements" / "peers.txt").read_text()
    names = ("diffrax", "heyoka", "jax", "numbalsoda", "scipy")
    return ", ".join(
        " ".join(pin) for pin in re.findall(r"(?m)^([a-z]+)==(\S+)", text) if pin[0] in names
    )


@dataclass
class Worker:
    """A process that solves one problem by one method as often as it is told."""

    requests: IO[str]
    answers: IO[str]

    def ask(self, **request: Any) -> dict[str, Any]:
        """Send a request and wait for its answer.

        Raises
        ------
        NotHereError
            Where the process says that it cannot, or has gone.
        """
        try:
            self.requests.write(json.dumps(request) + "\n")
            self.requests.flush()
        except BrokenPipeError:
            raise NotHereError("the process has gone") from None
        ready, _, _ = select.select([self.answers], [], [], PATIENCE)
        if not ready:
            raise NotHereError(f"no answer in {PATIENCE} s")
        line = self.answers.readline()
        if not line:
            raise NotHereError("the process has gone")
        answer: dict[str, Any] = json.loads(line)
        if "reason" in answer:
            raise NotHereError(answer["reason"])
        return answer


@contextmanager
def worker(is_peer: bool) -> Iterator[Worker]:
    """Start a process and end it."""
    executable = str(python()) if is_peer else sys.executable
    environment = {
        **os.environ,
        "JAX_PLATFORMS": "cpu",
        "OMP_NUM_THREADS": "1",
        "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
        "PYTHONPATH": str(ROOT),
    }
    process = subprocess.Popen(
        [executable, str(Path(__file__).with_name("worker.py"))],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=environment,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        yield Worker(process.stdin, process.stdout)
    finally:
        process.kill()
        process.wait()


@dataclass(frozen=True)
class Contestant:
    """A method and how the tables call it."""

    method: str
    """``module:function`` below `bench`."""
    name: str
    settings: tuple[Any, ...]
    """Tolerances from loose to tight, or ladders from cheap to dear."""
    is_peer: bool = False
    measured_on: int = 0
    """So many members are timed, and stand for all; 0 for all."""


@dataclass(frozen=True)
class Problem:
    """Pendulums with g = L = 1, released at rest; theta at the end is asked for."""

    arrays: str
    """File with ``theta`` and the ``exact`` angle at the end."""
    end: float
    wanted: float
    """Largest error of any member."""
    tuned_on: int = 0
    """So many members are solved while a setting is sought; 0 for all."""


@dataclass(frozen=True)
class Found:
    """What reaches the error that is asked for, and how long one member takes."""

    setting: Any
    error: float
    seconds: float


def compete(
    contestants: tuple[Contestant, ...], problem: Problem, rounds: int, enough: float
) -> dict[str, Found | str]:
    """Tune every contestant, then time all of them in turn.

    Returns
    -------
    dict
        By name: what was found, or the reason why there is nothing. One measurement lasts `enough` seconds at least.
    """
    found: dict[str, Found | str] = {}
    with ExitStack() as stack:
        tuned: dict[str, tuple[Worker, Any, float]] = {}
        for one in contestants:
            try:
                process = stack.enter_context(worker(one.is_peer))
                process.ask(
                    do="load",
                    method=one.method,
                    arrays=problem.arrays,
                    end=problem.end,
                    enough=enough,
                )
                tuned[one.name] = (process, *_tune(process, one, problem))
            except NotHereError as error:
                found[one.name] = f"not measured: {error}"
        times: dict[str, list[float]] = {name: [] for name in tuned}
        for _ in range(rounds):
            for name in [name for name in tuned if name not in found]:
                try:
                    times[name].append(tuned[name][0].ask(do="time")["seconds"])
                except NotHereError as error:
                    found[name] = f"not measured: {error}"
    for name, (_, setting, least) in tuned.items():
        if name not in found:
            found[name] = Found(setting, least, statistics.median(times[name]))
    return {one.name: found[one.name] for one in contestants}


def _tune(process: Worker, one: Contestant, problem: Problem) -> tuple[Any, float]:
    """Return the first setting that reaches the error, and the error; what is to be timed is then set.

    Where none reaches it, the one with the least error: the tables show that it falls short.
    """

    def error_of(setting: Any, members: int) -> float:
        return float(process.ask(do="set", setting=setting, members=members)["error"])

    errors: dict[Any, float] = {}
    for setting in one.settings:
        errors[setting] = error_of(setting, problem.tuned_on)
        if errors[setting] <= problem.wanted and problem.tuned_on != one.measured_on:
            errors[setting] = error_of(setting, one.measured_on)
        if errors[setting] <= problem.wanted:
            return setting, errors[setting]
    best = min(errors, key=lambda setting: errors[setting])
    return best, error_of(best, one.measured_on)
