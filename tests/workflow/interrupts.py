"""Interrupt runs again and again, at any moment and in any way, and count what does not end or is left behind.

python -m tests.workflow.interrupts 500
"""

from __future__ import annotations

import fcntl
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from .conftest import TEXT

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
TARGETS = ("group", "vibsim", "Snakemake")
LIMIT = 10.0
"""Seconds within which a run must have ended."""
EARLY = 1.0
"""Seconds in which the interpreter may still be starting, on a busy machine: until then it has its own ways to end."""


def words(pid: int) -> str:
    """Return the command line of a process, empty when it has ended."""
    try:
        return (
            Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
        )
    except OSError:
        return ""


def processes(mark: str) -> list[int]:
    """Return the living processes that name `mark`, or work in it."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit() or int(entry.name) == os.getpid():
            continue
        try:
            place = str((entry / "cwd").readlink())
        except OSError:
            continue
        if mark in words(int(entry.name)) or place.startswith(mark):
            found.append(int(entry.name))
    return found


@dataclass
class Stress:
    """A small experiment, interrupted; and what was seen."""

    folder: Path
    random: random.Random
    counts: Counter[str] = field(default_factory=Counter)
    longest: float = 0.0
    faults: list[str] = field(default_factory=list)
    whole: dict[str, bytes] = field(default_factory=dict)
    duration: float = 0.0

    @property
    def results(self) -> Path:
        return self.folder / "results"

    @property
    def environment(self) -> dict[str, str]:
        """Return that of a run, which has temporary files of its own."""
        return {**os.environ, "TMPDIR": str(self.folder / "tmp")}

    def command(self, *more: str) -> list[str]:
        file = self.folder / "tiny.yaml"
        file.write_text(TEXT)
        command = [sys.executable, "-m", "vibsim", more[0], str(file), *more[1:]]
        return [*command, "--results", str(self.results)]

    def content(self) -> dict[str, bytes]:
        """Return every result."""
        kinds = (".nc", ".json", ".html", ".csv", ".tex", ".svg")
        return {
            str(path.relative_to(self.results)): path.read_bytes()
            for path in sorted(self.results.rglob("*"))
            if path.suffix in kinds and not {".snakemake", ".vibsim"} & set(path.parts)
        }

    def finish(self) -> None:
        """Run to the end: nothing that was interrupted may have left a wrong byte."""
        start = time.monotonic()
        ended = subprocess.run(
            self.command("run"),
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=600,
        )
        self.duration = time.monotonic() - start
        self.counts["whole runs"] += 1
        if ended.returncode:
            self.faults.append(f"a run to the end: {ended.returncode} {ended.stderr}")
        if not self.whole:
            self.whole = self.content()
        found = self.content()
        names = found.keys() | self.whole.keys()
        if wrong := [name for name in names if found.get(name) != self.whole.get(name)]:
            self.faults.append(f"wrong bytes: {wrong}")
        if left := list(self.results.rglob(".*.part")):
            self.faults.append(f"left behind: {left}")

    def once(self, number: int) -> None:
        """Start a run, interrupt it, and look at what is left."""
        choose = self.random
        kind = choose.choices(["run", "dry", "simulate"], [8, 1, 1])[0]
        if choose.random() < 0.6:
            shutil.rmtree(self.results, ignore_errors=True)
        arguments = {
            "run": ("run", "--cores", "2"),
            "dry": ("run", "--dry-run"),
            # beside the results, which are to be those of whole runs
            "simulate": ("simulate", "--level", "21", "--out", str(self.folder / "by_hand.nc")),
        }[kind]
        command = self.command(*arguments)
        if kind == "simulate":
            (self.folder / "tiny.yaml").write_text(TEXT.replace("9]", "9, 21]"))
        delay = choose.uniform(0, self.duration * (0.7 if kind == "run" else 0.3))
        target, sent = choose.choice(TARGETS), choose.choice(SIGNALS)
        name = f"{number}: {kind}, {sent.name} to {target} after {delay:.2f} s"
        with subprocess.Popen(
            command,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        ) as process:
            time.sleep(delay)
            self.send(process, target, sent)
            start = time.monotonic()
            if choose.random() < 0.2:
                time.sleep(choose.uniform(0, 0.2))
                self.send(process, target, choose.choice(SIGNALS))
            self.look(process, name, delay, start)

    def send(self, process: subprocess.Popen[str], target: str, number: int) -> None:
        if process.poll() is not None:
            return
        if target == "Snakemake":
            found = [pid for pid in processes(str(self.results)) if "snakemake" in words(pid)]
            if found:
                os.kill(found[0], number)
                return
        (os.killpg if target == "group" else os.kill)(process.pid, number)

    def look(self, process: subprocess.Popen[str], name: str, delay: float, start: float) -> None:
        try:
            out, err = process.communicate(timeout=60)
        except subprocess.TimeoutExpired:
            self.faults.append(f"{name}: hangs")
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            return
        took, status = time.monotonic() - start, process.returncode
        self.longest = max(self.longest, took)
        self.counts["ended in time"] += took < LIMIT
        if took >= LIMIT:
            self.faults.append(f"{name}: {took:.1f} s, status {status}: {err}")
        self.counts[f"status {status}"] += 1
        told = "vibsim: interrupted; run the same command again to continue" in err
        if status not in ((0, 129, 130, 143) if delay > EARLY else (0, 129, 130, 143, -1, -2, -15)):
            self.faults.append(f"{name}: status {status}: {out} {err}")
        if delay > EARLY and status > 2 and not told:
            self.faults.append(f"{name}: says {err!r}")
        if "Traceback" in err:
            self.counts["tracebacks"] += 1
            if delay > EARLY:
                self.faults.append(f"{name}: {err}")
        if left := processes(str(self.results)):
            self.faults.append(f"{name}: left {[words(pid) for pid in left]}")
        if left := list(self.folder.joinpath("tmp").glob("vibsim-*")):
            texts = [path.read_text() for path in left if path.is_file()]
            self.faults.append(f"{name}: left {left}: {texts}")
            for path in left:
                if path.is_dir():
                    shutil.rmtree(path)
                else:
                    path.unlink()
        self.try_lock(name)

    def try_lock(self, name: str) -> None:
        path = self.results / ".vibsim/lock"
        if path.exists():
            with path.open() as lock:
                try:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    self.faults.append(f"{name}: the folder is locked")


def stress(folder: Path, number: int, seed: int, every: int = 25) -> Stress:
    """Interrupt `number` runs; finish one after `every` of them."""
    (folder / "tmp").mkdir()
    # a shell starts what runs in the background with signals ignored, and they would stay so
    for sent in SIGNALS:
        signal.signal(sent, signal.SIG_DFL)
    found = Stress(folder, random.Random(seed))
    for _ in range(2):
        # the second finds the kernels made
        shutil.rmtree(found.results, ignore_errors=True)
        found.finish()
    for count in range(1, number + 1):
        found.once(count)
        if count % every == 0 or count == number:
            found.finish()
            shutil.rmtree(found.results)
            print(f"{count}: {dict(found.counts)}, longest {found.longest:.2f} s", flush=True)
            print(*found.faults, sep="\n", flush=True)
    return found


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="interrupts-") as place:
        stress(Path(place), int(sys.argv[1]), int((sys.argv[2:] or ["1"])[0]))
