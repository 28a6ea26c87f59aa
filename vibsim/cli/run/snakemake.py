"""Start Snakemake and follow it."""

from __future__ import annotations

import json
import os
import pwd
import signal
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from threading import Thread
from typing import Any, BinaryIO

from vibsim.cli import results_folder
from vibsim.cli.run import lock, supervise
from vibsim.cli.run.progress import Job, Progress
from vibsim.core import ownership, private_cache
from vibsim.core.errors import VibsimError
from vibsim.plan import Plan, checkout
from vibsim.store import write_text

_SEARCH_PATHS = (
    *("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "PYTHONPYCACHEPREFIX"),
    *("BASH_ENV", "HDF5_PLUGIN_PATH", "MPLCONFIGDIR"),
)
"""Variables with folders and files that code is loaded from."""


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
    arguments: Sequence[str],
    progress: Progress | None = None,
) -> Outcome:
    """Run Snakemake on `plans` and return when it has ended.

    Parameters
    ----------
    plans
        The experiments.
    results
        The results folder, whose lock is held.
    held
        Descriptor of the lock, which Snakemake inherits.
    arguments
        Further arguments for Snakemake.
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
    config = results / ".vibsim/run.json"
    content = {"experiments": [plan.file for plan in plans], "results": str(results)}
    write_text(config, json.dumps(content))
    reading, writing = os.pipe()
    command = [sys.executable, "-P", "-m", "vibsim.cli.run.snakemake_process", str(os.getpid())]
    command += ["--logger", "vibsim", "--logger-vibsim-pipe", str(writing)]
    command += ["--snakefile", str(checkout() / "Snakefile")]
    command += ["--workflow-profile", str(checkout() / "workflow/profiles/default")]
    command += ["--configfile", str(config), "--directory", str(results), "--nocolor", *arguments]
    with os.fdopen(reading, "rb") as events:
        try:
            process = subprocess.Popen(
                command,
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
            ended = follow(events, progress)
            ended.status = _status(process)
        finally:
            # Where this is left early, nothing is worth waiting for: the jobs end with it.
            process.kill()
            process.wait()
        reader.join()
    ended.text = b"".join(text).decode(errors="replace")
    return ended


def _read(file: BinaryIO, lines: list[bytes]) -> None:
    with file:
        lines.extend(file)


def follow(events: Iterable[bytes], progress: Progress | None = None) -> Outcome:
    """Return what Snakemake did, from its events (`vibsim.cli.run.snakemake_process`) until there are no more."""
    found = Outcome()
    for line in events:
        # one that a kill cut short is told by the status
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
            job = Job(rule, outputs, ", ".join(event["log"]), event.get("reason", ""))
            if event["event"] == "job_error":
                found.failed.append(job)
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
        name = signal.Signals(-status).name
        raise VibsimError(
            f"the workflow was killed by {name}; run the same command again to continue"
        )
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
