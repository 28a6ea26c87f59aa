"""What every case needs: small experiments with the bytes of undisturbed runs, commands, and a look at what is left."""

from __future__ import annotations

import fcntl
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from workflow.conftest import TEXT, Place

from vibsim.cli.commands import verify

ROAD = """\
title: A tiny road
model: {kind: vehicle, speed: 5, road: {table: road.csv}}
time: {end: 2, base_steps: 100}
levels: [0, 1, 2]
schemes: [central]
"""
ROWS = "x,h\n" + "".join(f"{i / 10:g},{(i * i) % 7 / 100:g}\n" for i in range(101))
EXPERIMENTS = {
    "tiny": TEXT,
    "sweep": TEXT.replace("time:", "sweep: {initial.theta: [0.5, 1.0]}\ntime:"),
    "road": ROAD,
}
ASKED = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""Signals that ask a command to end."""
VARIABLES = {"VIBSIM_CACHE_DIR": "cache", "TMPDIR": "tmp"}
"""What vibsim writes outside of the results, and its folder in the laboratory."""


def require(holds: object, *told: object) -> None:
    """Raise what is told where something was lost, or was wrong in silence."""
    if not holds:
        raise AssertionError(*told)


def words(pid: int) -> str:
    """Return the command line of a process, empty when it has ended."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    return ""


def processes(mark: object) -> list[int]:
    """Return the living processes that name `mark`, or work in it."""
    found = []
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            if entry.name.isdigit() and int(entry.name) != os.getpid():
                place = str((entry / "cwd").readlink())
                if str(mark) in words(int(entry.name)) or place.startswith(str(mark)):
                    found.append(int(entry.name))
    return found


def is_free(results: Path) -> bool:
    """Tell whether no run holds the lock of a results folder."""
    path = results / ".vibsim/lock"
    if path.exists():
        with path.open() as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
    return True


def problems(place: Place) -> dict[str, str]:
    """Compare all files with the manifest, as `vibsim verify` without a name does."""
    keys = ["", *verify.experiments(place.results)]
    return {
        path: text for key in keys for path, text in verify.compare(place.results, key)[1].items()
    }


def vouched_for(place: Place) -> list[Path]:
    """Return every file whose bytes the manifests tell, and the manifests themselves."""
    aside = {".snakemake", *verify.NO_RESULTS}
    return sorted(
        path
        for path in place.results.rglob("*")
        if path.is_file()
        and (inner := path.relative_to(place.results).parts)
        and not aside & set(inner)
        and (inner[0] != ".vibsim" or inner[1] == "made")
        and path.name != verify.TIMESTAMP
    )


@dataclass
class Laboratory:
    """Finished experiments in a folder, of which every case gets a copy."""

    folder: Path
    seconds: float = 0.0
    """What a run takes, on this machine at this time."""
    counts: Counter[str] = field(default_factory=Counter)
    """What was done, by its kind."""

    def __post_init__(self) -> None:
        for variable, name in VARIABLES.items():
            (self.folder / name).mkdir(mode=0o700)
            os.environ[variable] = str(self.folder / name)

    def finished(self, name: str) -> Place:
        """Return the place of an undisturbed run, which is made for the first who asks."""
        folder = self.folder / "finished" / name
        if not folder.exists():
            self.finish(self.empty(name, folder))
        return Place(folder)

    def content(self, name: str) -> dict[str, bytes]:
        """Return the bytes of every result of an undisturbed run."""
        return self.finished(name).content()

    def empty(self, name: str = "tiny", folder: Path | None = None) -> Place:
        """Return a place with an experiment file and no results; by default that of the case, emptied."""
        folder = folder or self.folder / "case"
        shutil.rmtree(folder, ignore_errors=True)
        place = Place(folder)
        place.file.parent.mkdir(parents=True)
        place.file.write_text(EXPERIMENTS[name])
        place.file.with_name("road.csv").write_text(ROWS)
        return place

    def copy(self, name: str = "tiny") -> Place:
        """Return the place of the case with a finished experiment."""
        finished = self.finished(name)
        shutil.rmtree(self.folder / "case", ignore_errors=True)
        shutil.copytree(finished.folder, self.folder / "case")
        return Place(self.folder / "case")

    def start(
        self, place: Place, *options: str, before: Callable[[], object] | None = None, **more: str
    ) -> subprocess.Popen[str]:
        """Start a command on the experiment in processes of their own, with further environment variables."""

        def prepare() -> None:
            # a shell starts what runs in the background with some of them ignored, and they stay so
            for number in ASKED:
                signal.signal(number, signal.SIG_DFL)
            if before:
                before()

        given = options or ("run", "--cores", "2")
        command = [sys.executable, "-m", "vibsim", given[0], str(place.file), *given[1:]]
        return subprocess.Popen(
            [*command, "--results", str(place.results)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=prepare,
            env={**os.environ, **more},
        )

    def finish(self, place: Place, name: str = "", *options: str) -> str:
        """Run to the end, and require what an undisturbed run of experiment `name` made; return what the run said."""
        start = time.monotonic()
        ended = place.run(*options)
        self.seconds = self.seconds or 0.4 * (time.monotonic() - start)
        told = ended.stdout + ended.stderr
        require(ended.returncode == 0 and "Traceback" not in told, ended.returncode, told)
        if name:
            self.compare(place.content(), self.content(name))
        require(not (left := list(place.results.rglob(".*.part"))), "left behind", left)
        require(not (found := problems(place)), found)
        return told

    def compare(self, found: dict[str, bytes], right: dict[str, bytes]) -> None:
        names = found.keys() | right.keys()
        wrong = sorted(name for name in names if found.get(name) != right.get(name))
        require(not wrong, "other bytes", wrong)


def some(choose: random.Random, path: Path, size: int = 0) -> int:
    """Return a random place in a file."""
    return choose.randrange(max(size or path.stat().st_size, 1))
