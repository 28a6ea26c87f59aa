"""Start Snakemake and follow it."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from vibsim.cli import lock
from vibsim.plan import Plan

_BLOCK = re.compile(r"^(?:local)?(?:rule|checkpoint) (\w+):$")
_FIELD = re.compile(r"^    (\w+): (.*)$")
_DONE = re.compile(r"^(\d+) of (\d+) steps \(\d+%\) done$")
_TOTAL = re.compile(r"^total +(\d+)$")
_ERROR = re.compile(r"^Error in rule (\w+):$")


@dataclass(frozen=True)
class Job:
    """A job as Snakemake tells of it."""

    rule: str
    output: str
    log: str
    reason: str

    @property
    def outputs(self) -> list[str]:
        """The files that it makes."""
        return [path.removesuffix(" (update)") for path in self.output.split(", ")]

    @property
    def simulates(self) -> bool:
        """Whether it makes level files."""
        return self.rule.startswith("simulate")

    @property
    def folder(self) -> str:
        """Folder of the experiment, empty for the index."""
        parts = self.outputs[0].split("/")
        return "/".join(parts[:2]) if len(parts) > 2 else ""


@dataclass(frozen=True)
class Outcome:
    """How Snakemake ended."""

    status: int
    jobs: tuple[Job, ...]
    """Jobs that were started, or would be."""
    failed: tuple[Job, ...]
    text: str
    """The end of what Snakemake wrote."""


Watcher = Callable[[int, int, Job | None], None]
"""Told how many steps are done, of how many with the target of all, and which job has just started."""


def run(
    plans: Sequence[Plan],
    results: Path,
    root: Path,
    held: int,
    arguments: list[str],
    watch: Watcher,
) -> Outcome:
    """Run Snakemake on `plans` and return when it has ended.

    Parameters
    ----------
    plans
        The experiments.
    results
        The results folder, whose lock is held.
    root
        The checkout.
    held
        Descriptor of the lock, which Snakemake inherits.
    arguments
        Further arguments for Snakemake.
    watch
        Follows the progress.
    """
    _clear_locks(results)
    config = results / ".vibsim/run.json"
    content = {"experiments": [plan.file for plan in plans], "results": str(results)}
    config.write_text(json.dumps(content))
    command = [sys.executable, "-P", "-m", "snakemake", "--snakefile", str(root / "Snakefile")]
    command += ["--workflow-profile", str(root / "workflow/profiles/default")]
    command += ["--configfile", str(config), "--nocolor", *arguments]
    process = subprocess.Popen(
        command,
        cwd=results,
        env=os.environ | lock.inherited(held) | _caches(results),
        pass_fds=(held,),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
    )
    with _passing_on(process):
        return _follow(process, watch)


def _caches(results: Path) -> dict[str, str]:
    """Return where Snakemake and the libraries keep their caches, if the usual place cannot be written."""
    usual = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    # what cannot be made cannot be written either
    with suppress(OSError):
        usual.mkdir(parents=True, exist_ok=True)
    if os.access(usual, os.W_OK | os.X_OK):
        return {}
    own = results / ".vibsim/cache"
    own.mkdir(parents=True, exist_ok=True)
    return {"XDG_CACHE_HOME": str(own), "MPLCONFIGDIR": str(own / "matplotlib")}


def _clear_locks(results: Path) -> None:
    """Remove Snakemake's own locks: our lock is held, so whoever left them is no more."""
    shutil.rmtree(results / ".snakemake/locks", ignore_errors=True)


@contextmanager
def _passing_on(process: subprocess.Popen[str]) -> Iterator[None]:
    """Pass a request to end on to Snakemake, which stops its jobs and cleans up."""

    def pass_on(number: int, _: object) -> None:
        process.send_signal(number)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, pass_on)
    try:
        yield
    except KeyboardInterrupt:
        process.wait()
        raise
    finally:
        signal.signal(signal.SIGTERM, before)


def _follow(process: subprocess.Popen[str], watch: Watcher) -> Outcome:
    reader = _Reader(watch)
    assert process.stdout is not None
    with process.stdout as lines:
        for line in lines:
            reader.take(line.rstrip("\n"))
    status = process.wait()
    reader.take("")
    return Outcome(status, tuple(reader.jobs), tuple(reader.failed), "\n".join(reader.lines[-40:]))


class _Reader:
    """Gathers jobs from the lines that Snakemake writes."""

    def __init__(self, watch: Watcher) -> None:
        self.watch = watch
        self.jobs: list[Job] = []
        self.failed: list[Job] = []
        self.lines: list[str] = []
        self.rule = ""
        self.is_error = False
        self.fields: dict[str, str] = {}

    def take(self, line: str) -> None:
        self.lines.append(line)
        if field := _FIELD.match(line):
            self.fields.setdefault(field[1], field[2])
            return
        self.end_block()
        if done := _DONE.match(line):
            self.watch(int(done[1]), int(done[2]), None)
        elif total := _TOTAL.match(line):
            self.watch(0, int(total[1]), None)
        elif start := _BLOCK.match(line) or _ERROR.match(line):
            self.rule, self.is_error, self.fields = start[1], line.startswith("Error"), {}

    def end_block(self) -> None:
        """Keep the job whose fields have come to their end; the target of all is no job."""
        if self.rule and self.rule != "all":
            get = self.fields.get
            log = get("log", "").removesuffix(" (check log file(s) for error details)")
            job = Job(self.rule, get("output", ""), log, get("reason", ""))
            (self.failed if self.is_error else self.jobs).append(job)
            if not self.is_error:
                self.watch(-1, -1, job)
        self.rule = ""
