"""Run Snakemake and follow its jobs, its progress and how it ends."""

from __future__ import annotations

import json
import os
import pwd
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import Thread
from typing import Any, BinaryIO, NamedTuple

from vibsim.cli import resources, results_folder, supervise
from vibsim.cli.run import lock, pending
from vibsim.cli.run.executor import Executor
from vibsim.core import private_cache
from vibsim.core.errors import VibsimError
from vibsim.core.home import home
from vibsim.plan import Plan
from vibsim.store import write_text

_SEARCH_PATHS = (
    *("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "PYTHONPYCACHEPREFIX"),
    *("BASH_ENV", "HDF5_PLUGIN_PATH", "MPLCONFIGDIR"),
)
"""Environment variables with folders and files from which code or settings are loaded."""
CANCELLING = 60.0  # time that an executor has to cancel its jobs [s]
_TELLING = 3  # number of finished jobs from which the remaining time is estimated


@dataclass(frozen=True)
class Job:
    """A job that Snakemake started, or would start."""

    rule: str
    outputs: tuple[str, ...]  # the files that it makes, relative to the results folder
    log: str
    reason: str  # why it runs; for a failed job the executor's message, if any
    executor_log: str = ""  # path of the executor's log of a failed job; empty if there is none

    @property
    def simulates(self) -> bool:
        """Whether it makes level files."""
        return self.rule.startswith("simulate")

    @property
    def folder(self) -> str:
        """Folder of the experiment, empty for the index."""
        parts = self.outputs[0].split("/")
        return "/".join(parts[:2]) if len(parts) > 2 else ""

    def __str__(self) -> str:
        """Describe the job: ``simulate pendulum_lab/convergence level_06.nc to level_09.nc``."""
        if not self.folder:
            return self.rule
        if not self.simulates:
            return f"{self.rule} {self.folder}"
        names = [path.removeprefix(f"{self.folder}/") for path in self.outputs]
        return f"simulate {self.folder} " + " to ".join(dict.fromkeys((names[0], names[-1])))


class Progress:
    """Shows the progress of a run on stderr: in one line that is rewritten, or in a line per job if not a terminal."""

    def __init__(self) -> None:
        self.is_terminal = sys.stderr.isatty()
        self.done = 0
        self.started = 0
        self.total = 0
        self.current = "starting the workflow"
        self.began = time.monotonic()
        self._show()

    def count(self, done: int, total: int) -> None:
        """Record the number of finished jobs; the total includes the target rule ``all``, which is no job."""
        self.total = total - 1
        self.done = min(done, self.total)
        if not done:
            self.started = 0
            self.began = time.monotonic()
        self._show()

    def start(self, job: Job) -> None:
        """Record that a job has started."""
        self.current = str(job)
        self.started += 1
        if not self.is_terminal:
            count = f"{self.started} of {self.total}: " if self.total else ""
            print(f"{count}{self.current}", file=sys.stderr, flush=True)
        self._show()

    def clear(self) -> None:
        """Remove the line."""
        if self.is_terminal:
            self._rewrite("")

    def _show(self) -> None:
        if self.is_terminal:
            count = f"{self.done} of {self.total} done{self._left()}: " if self.total else ""
            self._rewrite(f"{count}{self.current}")

    def _left(self) -> str:
        """Return the remaining time, estimated from the mean time of the finished jobs, as text."""
        if self.done < _TELLING or self.done == self.total:
            return ""
        each = (time.monotonic() - self.began) / self.done
        return f", about {resources.duration(each * (self.total - self.done))} left"

    def _rewrite(self, text: str) -> None:
        width = shutil.get_terminal_size().columns - 1
        sys.stderr.write(f"\r\033[K{text[:width]}")
        sys.stderr.flush()


@dataclass
class Outcome:
    """What Snakemake did, and how it ended."""

    status: int = 0
    jobs: list[Job] = field(default_factory=list)  # those that it started, or would start
    failed: list[Job] = field(default_factory=list)
    exception: str = ""  # name of the last exception that Snakemake logged; empty without one
    message: str = ""  # the message of that exception, with several lines
    text: str = ""  # Snakemake's output on stdout and stderr

    @property
    def broke(self) -> bool:
        """Whether Snakemake itself failed, rather than one of its jobs."""
        return bool(self.status and not self.failed)

    @property
    def cause(self) -> str:
        """The exception with its message in one line; if none was logged, the last line of the output."""
        lines = [line.strip() for line in (self.message or self.text).splitlines() if line.strip()]
        heads = [n for n, line in enumerate(lines) if line.startswith(self.exception or "\0")]
        cause, *more = lines[heads[-1] if heads else -1 :] or [""]
        # e.g. `InputError in file "Snakefile", line 4:`, followed by lines with the reason or the files
        for line in more:
            if not cause.endswith(":"):
                break
            cause = f"{cause} {line}"
        return cause


class Work(NamedTuple):
    """What Snakemake is asked to do."""

    plans: Sequence[Plan]
    results: Path
    lock_fd: int  # descriptor of the lock of `results`, which Snakemake inherits
    target: Executor


def run(work: Work, progress: Progress | None = None) -> Outcome:
    """Run Snakemake and return when it has ended.

    Raises Interrupted where SIGHUP, SIGINT or SIGTERM ended Snakemake, and VibsimError where another signal killed it.
    """
    plans, results, lock_fd, target = work
    results_folder.clean(results, [plan.key for plan in plans])
    config = _write_config(plans, results, target)
    reading, writing = os.pipe()
    if target.is_remote:
        supervise.take_time(CANCELLING)
    with os.fdopen(reading, "rb") as events:
        try:
            process = subprocess.Popen(
                _command(config, results, target, writing),
                # Snakemake imports modules from .snakemake/pip-deployments in its working directory.
                cwd="/",
                env=_environment() | lock.inherited(lock_fd),
                pass_fds=(lock_fd, writing),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
            )
        finally:
            os.close(writing)
        text: list[bytes] = []
        reader = Thread(target=_read, args=(process.stdout, text), daemon=True)
        reader.start()
        try:
            with ExitStack() as stack:
                if progress and target.is_remote:
                    stack.enter_context(pending.reported(results, progress.clear))
                ended = follow(events, progress)
            ended.status = _status(process)
        except supervise.Interrupted:
            if target.is_remote:
                _cancel(process)
            raise
        finally:
            # after an exception there is nothing to wait for: local jobs end with Snakemake
            process.kill()
            process.wait()
        reader.join()
    ended.text = b"".join(text).decode(errors="replace")
    return ended


def _write_config(plans: Sequence[Plan], results: Path, target: Executor) -> Path:
    """Write the configuration that the workflow reads, and return its path."""
    config = results / ".vibsim/run.json"
    content = {
        "experiments": [plan.file for plan in plans],
        "settings": plans[0].settings if plans else (),
        "results": str(results),
        **target.config,
    }
    write_text(config, json.dumps(content))
    return config


def _command(config: Path, results: Path, target: Executor, pipe: int) -> list[str]:
    """Return the command that starts Snakemake, which writes its events to the descriptor `pipe`."""
    command = [sys.executable, "-P", "-m", "vibsim.cli.run.snakemake_process", str(os.getpid())]
    command.append("remote" if target.is_remote else "extended" if target.is_extended else "here")
    command += ["--logger", "vibsim", "--logger-vibsim-pipe", str(pipe)]
    command += ["--snakefile", str(home() / "Snakefile")]
    command += ["--workflow-profile", str(home() / "workflow/profiles/default")]
    command += ["--configfile", str(config), "--directory", str(results), "--nocolor"]
    return [*command, *target.arguments]


def _cancel(process: subprocess.Popen[bytes]) -> None:
    """Make Snakemake cancel its submitted jobs, and wait for it."""
    print("vibsim: cancelling what was submitted", file=sys.stderr, flush=True)
    process.send_signal(signal.SIGTERM)
    with suppress(subprocess.TimeoutExpired):
        process.wait(CANCELLING)


def _read(file: BinaryIO, lines: list[bytes]) -> None:
    with file:
        lines.extend(file)


def follow(events: Iterable[bytes], progress: Progress | None = None) -> Outcome:
    """Read events of Snakemake (`vibsim.cli.run.snakemake_process`) until they end, and return what it did."""
    outcome = Outcome()
    for line in events:
        # a line is incomplete only if Snakemake was killed, which the exit status shows
        if line.endswith(b"\n"):
            _record(json.loads(line), outcome, progress)
    return outcome


def _record(event: dict[str, Any], outcome: Outcome, progress: Progress | None) -> None:
    match event:
        case {"event": "run_info", "stats": {"total": total}} if progress:
            progress.count(0, total)
        case {"event": "progress", "done": done, "total": total} if progress:
            progress.count(done, total)
        case {"event": "error"}:
            outcome.exception, outcome.message = event["exception"], event["msg"]
        # the target rule is no job
        case {"rule_name": rule} if rule != "all":
            outputs = tuple(path.removesuffix(" (update)") for path in event["output"])
            # its own log, then possibly the executor's
            log, executor_log = (*event["log"], "", "")[:2]
            reason = event.get("reason") or event.get("rule_msg") or ""
            job = Job(rule, outputs, log, reason, executor_log)
            others = [failed for failed in outcome.failed if failed.outputs != job.outputs]
            if event["event"] == "job_error":
                outcome.failed.append(job)
                return
            if len(others) < len(outcome.failed):
                outcome.failed = others  # a failed job is tried again
                return
            outcome.jobs.append(job)
            if progress:
                progress.start(job)


def _status(process: subprocess.Popen[bytes]) -> int:
    """Return the exit status of Snakemake; raise an error if a signal killed it."""
    status = process.wait()
    if number := supervise.ended_by(status):
        raise supervise.Interrupted(number)
    if status < 0:
        how = f"killed by {signal.Signals(-status).name}"
        raise VibsimError(f"the workflow was {how}; run the same command again to continue")
    return status


def _environment() -> dict[str, str]:
    """Return the environment of Snakemake and its jobs, which work in the results folder.

    Search paths become absolute: a relative or empty entry means the user's current folder, and would mean the results
    folder there, from which no code may be loaded. Snakemake runs copies of its rules from the user's cache folder; it
    gets another folder if other users can write to that.
    """
    variables = dict(os.environ)
    for name in _SEARCH_PATHS:
        if value := variables.get(name):
            variables[name] = os.pathsep.join(map(os.path.abspath, value.split(os.pathsep)))
    try:
        caches = private_cache.general()
        private_cache.check(caches, writable=True)
    except OSError:
        caches = private_cache.place()
        variables["MPLCONFIGDIR"] = str(caches / "matplotlib")
    try:
        pwd.getpwuid(os.getuid())
    except KeyError:
        # Snakemake needs a home folder and a user name to start, but stores nothing there
        variables |= {"HOME": str(private_cache.place()), "USER": str(os.getuid())}
    return variables | {"XDG_CACHE_HOME": str(caches)}
