"""Damaged files, full disks and bad surroundings."""

from __future__ import annotations

import errno
import os
import random
import resource
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from torture.laboratory import EXPERIMENTS, Laboratory, problems, require, some, vouched_for

FULL = ("No space left on device", "File too large", " of disk, ")


def _flip(path: Path, choose: random.Random, _: Path) -> None:
    content = bytearray(path.read_bytes() or b"\0")
    content[some(choose, path, len(content))] ^= 1 << choose.randrange(8)
    path.write_bytes(content)


def _cut(path: Path, choose: random.Random, _: Path) -> None:
    os.truncate(path, some(choose, path))


def _zero(path: Path, choose: random.Random, _: Path) -> None:
    content = bytearray(path.read_bytes())
    start = some(choose, path)
    content[start : start + 512] = bytes(len(content[start : start + 512]))
    path.write_bytes(content)


def _grow(path: Path, choose: random.Random, _: Path) -> None:
    with path.open("ab") as file:
        file.write(choose.randbytes(choose.randint(1, 600)))


def _remove(path: Path, *_: object) -> None:
    path.unlink()


def _swap(path: Path, choose: random.Random, root: Path) -> None:
    alike = [other for other in sorted(root.rglob(f"*{path.suffix}")) if other.is_file()]
    other, aside = choose.choice(alike), path.with_name("aside")
    path.rename(aside)
    if other.exists():
        other.rename(path)
    aside.rename(other)


def _stale(path: Path, _: object, root: Path) -> None:
    """Put the file of the same name of another experiment in its place."""
    other = root.parent.parent / "stale" / root.name / path.relative_to(root)
    if other.is_file():
        shutil.copyfile(other, path)
    else:
        path.write_bytes(b"")


def _quietly(path: Path, choose: random.Random, root: Path) -> None:
    """Flip a bit, and keep size, time and inode."""
    status = path.stat()
    _flip(path, choose, root)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


HARMS = (_flip, _cut, _zero, _grow, _remove, _swap, _stale, _quietly)
AT_ONCE = 6
"""Files that are damaged before the run that mends them."""


def damage(lab: Laboratory, choose: random.Random) -> str:
    """Damage files of all kinds; what is vouched for must be named, and a run must bring everything back."""
    if not (lab.folder / "stale").exists():
        place = lab.empty()
        place.change("theta: 1.0", "theta: 1.1")
        lab.finish(place)
        (lab.folder / "case").rename(lab.folder / "stale")
    place, done = lab.copy(), []
    # copies have other inodes: a run makes them its own
    require(not place.changed(), "a copy")
    whole = _bytes(place.results)
    for _ in range(AT_ONCE):
        # a kind of files first: there are thirty figures for one report
        kinds: dict[str, list[Path]] = {}
        for root in (place.results, lab.folder / "cache"):
            for path in sorted(root.rglob("*")):
                if path.is_file() and path.name != "lock":
                    kinds.setdefault(f"{path.parent.name}{path.suffix}", []).append(path)
        path, harm = choose.choice(kinds[choose.choice(sorted(kinds))]), choose.choice(HARMS)
        is_result = path.is_relative_to(place.results)
        root = place.results if is_result else lab.folder / "cache"
        before = _bytes(root)
        vouched = {p.relative_to(place.results).as_posix() for p in vouched_for(place)}
        harm(path, choose, root)
        after = _bytes(root)
        other = {p for p in before.keys() | after.keys() if before.get(p) != after.get(p)}
        done.append(f"{harm.__name__.strip('_')} {path.relative_to(root)}")
        # what one exchange takes away, another may bring back
        wrong = {path for path in other if after.get(path) != whole.get(path)}
        if named := wrong & vouched if is_result else set():
            told = problems(place)
            # of another manifest the files are told that it does not fit
            seen = told.keys() | {p for p in named if told and p.startswith(".vibsim/made/")}
            seen |= {p for p in named if _is_end(before[p], after.get(p))}
            is_blind = any(p.startswith(".vibsim/made/") for p in told)
            require(named <= seen or is_blind, "not noticed", named - seen, done)
    lab.finish(place, "tiny", "--verify")
    lab.counts["damages"] += AT_ONCE
    return f"{AT_ONCE} damages: {'; '.join(done)}"


def _bytes(root: Path) -> dict[str, bytes]:
    return {p.relative_to(root).as_posix(): p.read_bytes() for p in root.rglob("*") if p.is_file()}


def _is_end(before: bytes, after: bytes | None) -> bool:
    """Tell whether nothing but the end of the last line is gone, which says nothing."""
    return after is not None and before.rstrip(b"\n") == after.rstrip(b"\n")


def limited(lab: Laboratory, choose: random.Random) -> str:
    """Let no file be larger than a limit."""
    place = lab.empty()
    size = int(2 ** choose.uniform(0, 19))
    cache = {} if choose.random() < 0.7 else {"VIBSIM_CACHE_DIR": str(lab.folder / "case/cache")}

    def before() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    with lab.start(place, before=before, **cache) as process:
        _end(process)
    lab.finish(place, "tiny")
    lab.counts["limits of files"] += 1
    return f"files of at most {size} bytes"


def full(lab: Laboratory, choose: random.Random) -> str:
    """Have something else fill the disk of the results at a random moment, which takes the right to mount one."""
    lab.content("tiny")
    place = lab.empty()
    delay, free = choose.uniform(0, lab.seconds), choose.choice([0, choose.randrange(600)]) * 1024
    with disk(place.results, 8192):
        with lab.start(place) as process:
            time.sleep(delay)
            _fill(place.results / "ballast", free)
            _end(process)
        (place.results / "ballast").unlink()
        lab.finish(place, "tiny")
    lab.counts["full disks"] += 1
    return f"{free} bytes of disk left after {delay:.1f} s"


def _fill(ballast: Path, free: int) -> None:
    """Take all but so many bytes of a disk to which a run is writing, so that there may be less than was seen."""
    with ballast.open("wb") as file:
        for _ in range(100):
            status = os.statvfs(ballast)
            try:
                size = max(1, status.f_bavail * status.f_frsize - free)
                os.posix_fallocate(file.fileno(), 0, size)
            except OSError as error:
                if error.errno != errno.ENOSPC:
                    raise
            else:
                return


def can_mount(folder: Path) -> bool:
    """Tell whether a disk can be mounted here."""
    with disk(folder / "mount") as is_there:
        return is_there


@contextmanager
def disk(folder: Path, kilobytes: int = 4) -> Iterator[bool]:
    """Have a small disk at a folder, if that is allowed."""
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(folder)]
    is_there = not subprocess.run(command, check=False, capture_output=True).returncode
    try:
        yield is_there
    finally:
        if is_there:
            subprocess.run(["umount", str(folder)], check=True)


def _end(process: subprocess.Popen[str]) -> None:
    """Wait for a run that had too little room: it ends well, or says what was full."""
    out, err = process.communicate(timeout=120)
    require(process.returncode in (0, 1, 2), process.returncode, out, err)
    require("Traceback" not in out + err, out, err)
    told = any(words in out + err for words in FULL)
    require(process.returncode == 0 or told, "does not say what was full", out, err)


SURROUNDINGS: dict[str, list[dict[str, str]]] = {
    "language": [
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
        {"LC_ALL": "de_DE.UTF-8", "LANGUAGE": "de"},
        {"LC_ALL": "tr_TR.UTF-8", "PYTHONHASHSEED": "1"},
        {"LC_ALL": "C.utf8", "TZ": "Pacific/Kiritimati", "COLUMNS": "7"},
    ],
    "processor": [
        {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4"},
        {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-AVX,-FMA,-FMA4"},
        {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": "X86_V3"},
        {"OPENBLAS_NUM_THREADS": "4", "OMP_NUM_THREADS": "3"},
    ],
}


def surrounded(lab: Laboratory, choose: random.Random) -> str:
    """Run with another language, processor, number of cores, mode of new files and private cache."""
    name = choose.choice(list(EXPERIMENTS))
    right, more = lab.content(name), {}
    place = lab.empty(name)
    for kind in SURROUNDINGS.values():
        more |= choose.choice([{}, *kind])
    cores = choose.randint(1, 2)
    chosen = set(choose.sample(sorted(os.sched_getaffinity(0)), 1)) if cores == 1 else None
    mask = choose.choice([0o022, 0o077, 0o002])
    if choose.random() < 0.4:
        more["VIBSIM_CACHE_DIR"] = str(lab.folder / "case/cache")

    def before() -> None:
        os.umask(mask)
        if chosen:
            os.sched_setaffinity(0, chosen)

    with lab.start(place, before=before, **more) as process:
        out, err = process.communicate(timeout=300)
    require(process.returncode == 0 and "Traceback" not in err, process.returncode, out, err)
    lab.compare(place.content(), right)
    lab.counts["surroundings"] += 1
    return f"{name} on {cores} cores, umask {mask:o}, {more}"
