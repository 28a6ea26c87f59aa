"""Runs and jobs that are ended at random moments, or share a results folder."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path

from workflow.conftest import TEXT, Place

from torture.laboratory import ASKED, Laboratory, is_free, problems, processes, require, words
from vibsim.cli import made_files

LIMIT = 30.0
"""Seconds within which a run must have ended."""
EARLY = 1.0
"""Seconds in which the interpreter may still be starting, on a busy machine: until then it has its own ways to end."""
AT_ONCE = 4
"""Kills before the run that must come to the end."""
TOLD = "vibsim: interrupted; run the same command again to continue"
COMMANDS = {
    "run": ("run", "--cores", "2"),
    "dry run": ("run", "--dry-run"),
    "job": ("simulate", "--level", "21"),
}


def kill(lab: Laboratory, choose: random.Random) -> str:
    """End runs, dry runs and jobs by hand, one after the other; then the same run must come to the same bytes."""
    place = lab.empty()
    # runs with too little room have left there what their errors name
    _clear(lab.folder / "tmp")
    told = [_kill(lab, place, choose) for _ in range(AT_ONCE)]
    lab.finish(place, "tiny")
    return "; ".join(told)


def _kill(lab: Laboratory, place: Place, choose: random.Random) -> str:
    """Start a command on what is there, and end it."""
    kind = choose.choices(list(COMMANDS), [8, 1, 1])[0]
    if kind == "job":
        place.change("9]", "9, 21]")
    if choose.random() < 0.3:
        shutil.rmtree(place.tiny, ignore_errors=True)
    with lab.start(place, *COMMANDS[kind]) as process:
        start = time.monotonic()
        _wait(process, place, choose, lab.finished("tiny") if kind == "run" else None)
        delay = time.monotonic() - start
        has_ended = process.poll() is not None
        lab.counts["kills after the end" if has_ended else "kills"] += 1
        target = _target(process, place, choose)
        sent = choose.choice([*ASKED, signal.SIGKILL])
        role = "nobody" if has_ended else _role(target, process.pid)
        name = f"{kind}, {sent.name} to {role} after {delay:.2f} s"
        with suppress(ProcessLookupError):
            (os.killpg(-target, sent) if target < 0 else os.kill(target, sent))
        if choose.random() < 0.2:
            time.sleep(choose.uniform(0, 0.2))
            with suppress(ProcessLookupError):
                os.killpg(process.pid, choose.choice(ASKED))
        # a signal to one process of many need not end the run
        limit = LIMIT if role in ("all", "vibsim", "nobody") else 10 * LIMIT
        _look(process, place, name, limit, delay < EARLY, sent == signal.SIGKILL)
    place.file.write_text(TEXT)
    return name


def _wait(
    process: subprocess.Popen[str], place: Place, choose: random.Random, whole: Place | None
) -> None:
    """Wait for a moment that does not depend on how busy the machine is: until so many files are there; or a second."""
    delay = choose.uniform(0, 2.0)
    if whole and choose.random() < 0.7:
        delay /= 10
        made, most = _size(place.tiny), _size(whole.tiny)
        wanted = choose.randint(min(made, most), most)
        while process.poll() is None and _size(place.tiny) < wanted:
            time.sleep(0.01)
    with suppress(subprocess.TimeoutExpired):
        process.wait(delay)


def _size(folder: Path) -> int:
    """Count what is in a folder; what vanishes meanwhile is not there."""
    return sum(len(folders) + len(files) for _, folders, files in os.walk(folder))


def _target(process: subprocess.Popen[str], place: Place, choose: random.Random) -> int:
    """Return the process to be told, or minus the group."""
    if process.poll() is None and choose.random() < 0.7:
        return choose.choice([process.pid, *processes(place.results)])
    return -process.pid


def _role(pid: int, first: int) -> str:
    if pid in (first, -first):
        return "vibsim" if pid > 0 else "all"
    found = words(pid)
    return next(
        (name for name in ("snakemake", "simulate", "analyse", "report", "index") if name in found),
        "driver",
    )


def _look(
    process: subprocess.Popen[str],
    place: Place,
    name: str,
    limit: float,
    is_early: bool,
    is_killed: bool,
) -> None:
    """See that a command ended, how, and that it left nothing at work, locked or damaged."""
    try:
        out, err = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        left = [words(pid) for pid in processes(place.results)]
        os.killpg(process.pid, signal.SIGKILL)
        out, err = process.communicate()
        raise AssertionError(name, "does not end", left, out, err) from None
    status = process.returncode
    ends = {0, 1, 129, 130, 143} | ({-1, -2, -15} if is_early else set())
    ends |= {137, -9} if is_killed else set()
    require(status in ends, name, status, out, err)
    if not is_early:
        require("Traceback" not in err, name, err)
        require(status <= 2 or is_killed or TOLD in err, name, "says", err)
        require(status != 1 or err or out, name, "says nothing")
    # of a run that is killed the system ends the rest
    deadline = time.monotonic() + LIMIT
    while (left := processes(place.results)) or not is_free(place.results):
        require(time.monotonic() < deadline, name, "left", [words(pid) for pid in left])
        time.sleep(0.02)
    damaged = {path: text for path, text in problems(place).items() if made_files.CHANGED in text}
    require(not damaged, name, damaged)
    tmp = place.folder.parent / "tmp"
    # the full text of an error is there to be read
    paths = [path for path in tmp.glob("vibsim-*") if str(path) not in err]
    left = {path.name: path.read_text() if path.is_file() else "" for path in paths}
    require(is_killed or not left, name, "left", left)
    _clear(tmp)


def _clear(folder: Path) -> None:
    shutil.rmtree(folder)
    folder.mkdir(mode=0o700)


def together(lab: Laboratory, choose: random.Random) -> str:
    """Start two or three runs at once, and kill one now and then; the others must come to the end."""
    place = lab.empty()
    number, is_killed = choose.randint(2, 3), choose.random() < 0.5
    running = []
    for _ in range(number):
        running.append(lab.start(place))
        time.sleep(choose.uniform(0, 1.5))
    if is_killed:
        os.killpg(running[0].pid, signal.SIGKILL)
    for k, process in enumerate(running):
        out, err = process.communicate(timeout=300)
        allowed = (0, -9) if is_killed and k == 0 else (0,)
        require(process.returncode in allowed, k, process.returncode, out, err)
    lab.finish(place, "tiny")
    lab.counts["runs at once"] += number
    return f"{number} runs at once" + ", one killed" * is_killed
