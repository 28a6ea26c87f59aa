"""Start Snakemake and follow it: its jobs, how far it is, and how it ended."""

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
from typing import Any, BinaryIO

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
"""Variables with folders and files that code is loaded from."""
CANCELLING = 60.0
"""Seconds that an executor has to cancel its jobs."""
_TELLING = 3
"""From so many finished jobs on, they tell how long the others take."""


@dataclass(frozen=True)
class Job:
    """A job that Snakemake started, or would start."""

    rule: str
    outputs: tuple[str, ...]
    """The files that it makes, from the results folder."""
    log: str
    reason: str
    """Why it is to run; of one that failed, what its executor says of that, if anything."""
    executor_log: str = ""
    """Path of what its executor wrote, of one that failed; empty where there is none."""

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
        """Say what it does: ``simulate pendulum_lab/convergence level_06.nc to level_09.nc``."""
        if not self.folder:
            return self.rule
        if not self.simulates:
            return f"{self.rule} {self.folder}"
        names = [path.removeprefix(f"{self.folder}/") for path in self.outputs]
        return f"simulate {self.folder} " + " to ".join(dict.fromkeys((names[0], names[-1])))


class Progress:
    """Tells on stderr how far a run is: in one line that is rewritten, or plain lines where the output is kept."""

    def __init__(self) -> None:
        self.is_terminal = sys.stderr.isatty()
        self.done = 0
        self.started = 0
        self.total = 0
        self.current = "starting the workflow"
        self.began = time.monotonic()
        self._show()

    def count(self, done: int, total: int) -> None:
        """Take how many jobs are done of how many, both with the target of all, which is no job."""
        self.total = total - 1
        self.done = min(done, self.total)
        if not done:
            self.started = 0
            self.began = time.monotonic()
        self._show()

    def start(self, job: Job) -> None:
        """Take a job that has started."""
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
        """Say how long the rest takes if its jobs are like those that are done, where some are."""
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
    jobs: list[Job] = field(default_factory=list)
    """Jobs that were started, or would be."""
    failed: list[Job] = field(default_factory=list)
    exception: str = ""
    """Name of the last exception that Snakemake logged; empty without one."""
    message: str = ""
    """The message of that exception, in several lines."""
    text: str = ""
    """What Snakemake wrote for people."""

    @property
    def broke(self) -> bool:
        """Whether Snakemake itself failed, rather than one of its jobs."""
        return bool(self.status and not self.failed)

    @property
    def cause(self) -> str:
        """The exception with what it says in a line; where none was logged, the last line that was written."""
        lines = [line.strip() for line in (self.message or self.text).splitlines() if line.strip()]
        heads = [n for n, line in enumerate(lines) if line.startswith(self.exception or "\0")]
        cause, *more = lines[heads[-1] if heads else -1 :] or [""]
        # such as `InputError in file "Snakefile", line 4:`, with the reason on the next line, or the files behind it
        for line in more:
            if not cause.endswith(":"):
                break
            cause = f"{cause} {line}"
        return cause


def run(
    plans: Sequence[Plan],
    results: Path,
    held: int,
    where: Executor,
    progress: Progress | None = None,
) -> Outcome:
    """Run Snakemake on `plans` and return when it has ended.

    Parameters
    ----------
    results, held
        The results folder, and the descriptor of its lock, which Snakemake inherits.
    where
        Where jobs run.
    progress
        Told how far the run is.

    Raises
    ------
    Interrupted
        When Snakemake was ended by a signal that asks to end.
    VibsimError
        When another signal killed it.
    """
    results_folder.clean(results, [plan.key for plan in plans])
    config = _write_config(plans, results, where)
    reading, writing = os.pipe()
    if where.is_remote:
        supervise.take_time(CANCELLING)
    with os.fdopen(reading, "rb") as events:
        try:
            process = subprocess.Popen(
                _command(config, results, where, writing),
                # Snakemake imports what it finds in .snakemake/pip-deployments of the folder that it is started in.
                cwd="/",
                env=_environment() | lock.inherited(held),
                pass_fds=(held, writing),
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
                if progress and where.is_remote:
                    stack.enter_context(pending.reported(results, progress.clear))
                ended = follow(events, progress)
            ended.status = _status(process)
        except supervise.Interrupted:
            if where.is_remote:
                _cancel(process)
            raise
        finally:
            # Where this is left early, nothing else is worth waiting for: the jobs here end with it.
            process.kill()
            process.wait()
        reader.join()
    ended.text = b"".join(text).decode(errors="replace")
    return ended


def _write_config(plans: Sequence[Plan], results: Path, where: Executor) -> Path:
    """Write what the workflow reads of a run, and return its path."""
    config = results / ".vibsim/run.json"
    content = {
        "experiments": [plan.file for plan in plans],
        "settings": plans[0].settings if plans else (),
        "results": str(results),
        **where.config,
    }
    write_text(config, json.dumps(content))
    return config


def _command(config: Path, results: Path, where: Executor, pipe: int) -> list[str]:
    """Return the command that starts Snakemake, which writes its events to a pipe."""
    command = [sys.executable, "-P", "-m", "vibsim.cli.run.snakemake_process", str(os.getpid())]
    command.append("remote" if where.is_remote else "here")
    command += ["--logger", "vibsim", "--logger-vibsim-pipe", str(pipe)]
    command += ["--snakefile", str(home() / "Snakefile")]
    command += ["--workflow-profile", str(home() / "workflow/profiles/default")]
    command += ["--configfile", str(config), "--directory", str(results), "--nocolor"]
    return [*command, *where.arguments]


def _cancel(process: subprocess.Popen[bytes]) -> None:
    """Have Snakemake cancel the jobs that it has submitted, and wait until it has."""
    print("vibsim: cancelling what was submitted", file=sys.stderr, flush=True)
    process.send_signal(signal.SIGTERM)
    with suppress(subprocess.TimeoutExpired):
        process.wait(CANCELLING)


def _read(file: BinaryIO, lines: list[bytes]) -> None:
    with file:
        lines.extend(file)


def follow(events: Iterable[bytes], progress: Progress | None = None) -> Outcome:
    """Return what Snakemake did, from its events (`vibsim.cli.run.snakemake_process`) until there are no more."""
    found = Outcome()
    for line in events:
        # one that a kill cut short is recognised by the status
        if line.endswith(b"\n"):
            _take(json.loads(line), found, progress)
    return found


def _take(event: dict[str, Any], found: Outcome, progress: Progress | None) -> None:
    match event:
        case {"event": "run_info", "stats": {"total": total}} if progress:
            progress.count(0, total)
        case {"event": "progress", "done": done, "total": total} if progress:
            progress.count(done, total)
        case {"event": "error"}:
            found.exception, found.message = event["exception"], event["msg"]
        # the target of all is no job
        case {"rule_name": rule} if rule != "all":
            outputs = tuple(path.removesuffix(" (update)") for path in event["output"])
            # behind its own log stands that of its executor
            log, executor_log = (*event["log"], "", "")[:2]
            reason = event.get("reason") or event.get("rule_msg") or ""
            job = Job(rule, outputs, log, reason, executor_log)
            failed = [one for one in found.failed if one.outputs == job.outputs]
            if event["event"] == "job_error":
                found.failed.append(job)
                return
            if failed:
                # it is tried again
                found.failed = [one for one in found.failed if one not in failed]
                return
            found.jobs.append(job)
            if progress:
                progress.start(job)


def _status(process: subprocess.Popen[bytes]) -> int:
    """Return the exit status of Snakemake, which may have been killed."""
    status = process.wait()
    if number := supervise.ended_by(status):
        raise supervise.Interrupted(number)
    if status < 0:
        how = f"killed by {signal.Signals(-status).name}"
        raise VibsimError(f"the workflow was {how}; run the same command again to continue")
    return status


def _environment() -> dict[str, str]:
    """Return the environment of Snakemake and its jobs, which work in the results folder.

    What is relative, or empty, in a search path means the folder that the user is in, and would mean the results folder
    there: programs and libraries would be loaded from it. Snakemake runs copies of its rules from the user's cache
    folder, and gets another one where others can write to that.
    """
    found = dict(os.environ)
    for name in _SEARCH_PATHS:
        if value := found.get(name):
            found[name] = os.pathsep.join(map(os.path.abspath, value.split(os.pathsep)))
    try:
        caches = private_cache.general()
        private_cache.check(caches, writable=True)
    except OSError:
        caches = private_cache.place()
        found["MPLCONFIGDIR"] = str(caches / "matplotlib")
    try:
        pwd.getpwuid(os.getuid())
    except KeyError:
        # Snakemake does not start without a home and a name; nothing is kept there: the caches have places of their own
        found |= {"HOME": str(private_cache.place()), "USER": str(os.getuid())}
    return found | {"XDG_CACHE_HOME": str(caches)}
