"""Start Snakemake and follow it."""

from __future__ import annotations

import json
import os
import pwd
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from vibsim.cli import results_folder
from vibsim.cli.run import lock, supervise
from vibsim.core import ownership, private_cache
from vibsim.core.errors import VibsimError
from vibsim.plan import Plan
from vibsim.store import write_text

_BLOCK = re.compile(r"^(?:local)?(?:rule|checkpoint) (\w+):$")
_FIELD = re.compile(r"^    (\w+): (.*)$")
_DONE = re.compile(r"^(\d+) of (\d+) steps \(\d+%\) done$")
_TOTAL = re.compile(r"^total +(\d+)$")
_CAUSE = re.compile(r"^[\w.]*(?:Error|Exception)\b")
_ERROR = re.compile(r"^Error in rule (\w+):$")
_SEARCH_PATHS = (
    *("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "PYTHONPYCACHEPREFIX"),
    *("BASH_ENV", "HDF5_PLUGIN_PATH", "MPLCONFIGDIR"),
)
"""Variables with folders and files that code is loaded from."""


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
    """What Snakemake wrote."""

    @property
    def cause(self) -> str:
        """The last line that names an exception, else the last one, with those that a colon promises."""
        lines = [line.strip() for line in self.text.splitlines() if line.strip()]
        named = [number for number, line in enumerate(lines) if _CAUSE.match(line)]
        told: list[str] = []
        for line in lines[named[-1] if named else -1 :]:
            told.append(line)
            if not line.endswith(":"):
                break
        return " ".join(told)


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
    results_folder.clean(results, [plan.key for plan in plans])
    config = results / ".vibsim/run.json"
    content = {"experiments": [plan.file for plan in plans], "results": str(results)}
    write_text(config, json.dumps(content))
    command = [sys.executable, "-P", "-m", "vibsim.cli.run.snakemake_process", str(os.getpid())]
    command += ["--snakefile", str(root / "Snakefile")]
    command += ["--workflow-profile", str(root / "workflow/profiles/default")]
    command += ["--configfile", str(config), "--directory", str(results), "--nocolor", *arguments]
    process = subprocess.Popen(
        command,
        # Snakemake imports what it finds in .snakemake/pip-deployments of the folder that it is started in.
        cwd="/",
        env=_environment() | lock.inherited(held),
        pass_fds=(held,),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
    )
    try:
        return _follow(process, watch)
    finally:
        # Where this is left early, nothing is worth waiting for: the jobs end with it.
        process.kill()
        process.wait()


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
        ownership.check(caches)
        ownership.check_writable(caches)
    except OSError:
        caches = private_cache.place()
        found["MPLCONFIGDIR"] = str(caches / "matplotlib")
    return found | _of_unknown_user() | {"XDG_CACHE_HOME": str(caches)}


def _of_unknown_user() -> dict[str, str]:
    """Return a home and a name for a user whom the system does not know: without them Snakemake does not start."""
    try:
        pwd.getpwuid(os.getuid())
    except KeyError:
        # nothing is kept there: the caches have places of their own
        return {"HOME": str(private_cache.place()), "USER": str(os.getuid())}
    return {}


def _follow(process: subprocess.Popen[str], watch: Watcher) -> Outcome:
    reader = _Reader(watch)
    assert process.stdout is not None
    with process.stdout as lines:
        for line in lines:
            reader.take(line.rstrip("\n"))
    status = process.wait()
    if number := supervise.ended_by(status):
        raise supervise.Interrupted(number)
    if status < 0:
        name = signal.Signals(-status).name
        raise VibsimError(f"the workflow was killed by {name}; the same command goes on from here")
    reader.take("")
    return Outcome(status, tuple(reader.jobs), tuple(reader.failed), "\n".join(reader.lines))


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
