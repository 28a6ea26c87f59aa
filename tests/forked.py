"""The command ``vibsim`` in a process of its own that need not import anything: it is a fork of this one.

It goes the same way as ``python -m vibsim``, from the command line over its supervisor to its exit status. What the
test has changed in this process (`monkeypatch`) holds in it too, but nothing that only the start of an interpreter
reads (``sitecustomize.py``): where that matters, start one. Snakemake is a fork in the same way, and so are its jobs,
which else import for half of their time; a run of `tests/contract` and the one that `tests/workflow` looks at start
all of them.
"""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryFile
from types import SimpleNamespace
from typing import Any, NoReturn

import vibsim.cli.run.command
from vibsim import Experiment, analyse, simulate, verdicts  # noqa: F401
from vibsim.cli import main
from vibsim.cli.run import snakemake as starting
from vibsim.cli.run import snakemake_process

for name in ("snakemake.cli", "snakemake.report.html_reporter", "yaml", "yte"):
    import_module(name)  # once here, and not in every process of Snakemake
SHELL: Any = sys.modules["snakemake.shell"]  # a class of Snakemake hides it
SECONDS = 300
"""A command that takes longer waits for ever."""


def vibsim(
    *arguments: object, cwd: Path | None = None, forked_jobs: bool = True
) -> subprocess.CompletedProcess[str]:
    """Run a command and return its exit status and what it wrote; its jobs are forks too, or are started by a shell."""
    command = ["vibsim", *map(str, arguments)]
    with TemporaryFile() as out, TemporaryFile() as err:
        with warnings.catch_warnings():
            # from Python 3.12 on, of threads that this process has, and the new one has not
            warnings.simplefilter("ignore", DeprecationWarning)
            child = os.fork()
        if not child:
            if forked_jobs:
                SHELL.sp = with_popen(job)
            _perform(command, out.fileno(), err.fileno(), cwd)
        status = _wait(child, command)
        texts = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read().decode())
    return subprocess.CompletedProcess(command, status, *texts)


def _wait(child: int, command: list[str]) -> int:
    deadline = time.monotonic() + SECONDS
    while time.monotonic() < deadline:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.01)
    os.kill(child, 9)
    os.waitpid(child, 0)
    raise subprocess.TimeoutExpired(command, SECONDS)


def _perform(command: list[str], out: int, err: int, cwd: Path | None) -> NoReturn:
    # those of an interpreter, not those of the tests
    warnings.resetwarnings()
    for category in (DeprecationWarning, PendingDeprecationWarning, ImportWarning):
        warnings.simplefilter("ignore", category)
    starting.subprocess = with_popen(Snakemake)  # type: ignore[attr-defined]
    _become(main, command, out, err, cwd)


def with_popen(start: Callable[..., object]) -> Any:
    """Return the module `subprocess` with another way to start a process."""
    return SimpleNamespace(**{**vars(subprocess), "Popen": start})


def _become(
    work: Callable[[], object], command: Sequence[str], out: int, err: int, cwd: Path | str | None
) -> NoReturn:
    """Do the work of a process, and end with its status."""
    status: object = 1
    try:
        os.dup2(out, 1)
        os.dup2(err, 2)
        sys.stdout = os.fdopen(1, "w", closefd=False)
        sys.stderr = os.fdopen(2, "w", buffering=1, closefd=False)
        if cwd is not None:
            os.chdir(cwd)
        sys.argv = list(command)
        status = work()
    except SystemExit as left:
        status = left.code
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status if isinstance(status, int) else int(status is not None))


class Fork:
    """What is asked of a process that was started (`subprocess.Popen`), where it is a fork of this one."""

    def __init__(self) -> None:
        self.pid = os.fork()
        self.returncode: int | None = None

    def wait(self) -> int:
        if self.returncode is None:
            self.returncode = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        return self.returncode

    def kill(self) -> None:
        if self.returncode is None:
            with suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)

    def terminate(self) -> None:
        self.kill()


class Snakemake(Fork):
    """The process of Snakemake, which a run starts."""

    def __init__(
        self,
        command: Sequence[str],
        *,
        cwd: str,
        env: Mapping[str, str],
        pass_fds: Sequence[int],
        **_: Any,
    ) -> None:
        reading, writing = os.pipe()
        super().__init__()
        if not self.pid:
            for descriptor in pass_fds:
                os.set_inheritable(descriptor, True)
            # what is closed here stands open in the run
            os.close(reading)
            os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
            os.environ.clear()
            os.environ.update(env)
            # without the interpreter and the name of the module
            _become(snakemake_process.main, command[3:], writing, writing, cwd)
        os.close(writing)
        self.stdout = os.fdopen(reading, "rb")


JOB = re.compile(r"exec > (?P<log>.*) 2>&1; cd / && exec (?P<words>vibsim .*)")
"""The end of the line by which a rule starts a job."""


def job(line: str, *, env: Mapping[str, str], **options: Any) -> Fork | subprocess.Popen[bytes]:
    """Start a job of Snakemake, in a fork where the line is that of a job of vibsim."""
    found = JOB.search(line)
    if found is None:
        return subprocess.Popen(line, env=env, **options)
    (log,) = shlex.split(found["log"])
    words = shlex.split(found["words"].replace('"$OLDPWD"', shlex.quote(str(Path.cwd()))))
    with Path(log).open("wb") as file:
        fork = Fork()
        if not fork.pid:
            os.environ.clear()
            os.environ.update(env)
            _become(main, words, file.fileno(), file.fileno(), "/")
    return fork
