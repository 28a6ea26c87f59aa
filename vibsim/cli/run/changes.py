"""What is in a results folder: files no longer as they were made, and files that nobody asks for any more.

A file is as it was made where size, time and inode are; where one of these differs, the content is compared.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from vibsim.cli import made_files
from vibsim.cli.made_files import BESIDE, Entry
from vibsim.core.errors import DamagedFileError, FileError, StaleFileError
from vibsim.plan import Plan
from vibsim.store.atomic import abandoned

_SEALED = (".nc", ".json")
"""Files that say themselves whether they are whole."""
_LEVEL = re.compile(r"level_\d{2,}")
_NAMED = re.compile(r"level_\d{2,}(?:/shard_\d{4,})?\.nc|best\.nc")


def changed(plans: Sequence[Plan], results: Path, *, every: bool) -> list[FileError]:
    """Return the files to be made again; what only was copied or touched gets its time back.

    The lock of `results` is held. With `every`, files are compared with their digests also where size, time and inode
    are as they were.
    """
    found: list[FileError] = []
    for plan in plans:
        own = [path.removeprefix(f"{plan.key}/") for path in plan.files]
        found.extend(_changed(results, plan.key, own, every))
    found.extend(_changed(results, made_files.INDEX, made_files.OVER_ALL, every))
    return found


def _changed(results: Path, key: str, own: Iterable[str], every: bool) -> Iterator[FileError]:
    folder, known = results / key, made_files.load(results, key)
    now = dict(known)
    bad = {name: problem for name in own if (problem := _problem(folder, name, now, every))}
    page = folder / "report.html"
    if page.exists() and page.name not in bad:
        for name in filter(lambda name: name.startswith(BESIDE), known):
            problem = _problem(folder, name, now, every)
            if problem or not (folder / name).exists():
                # a report is made as a whole
                bad[page.name] = f"its file {name}: {problem or 'is missing'}"
    yield from (DamagedFileError(folder / name, problem) for name, problem in bad.items())
    if now != known:
        made_files.replace(results, key, now)


def _problem(folder: Path, name: str, entries: dict[str, Entry], every: bool) -> str:
    """Say what is wrong with a file, if there is one, and bring its entry up to date."""
    path, known = folder / name, entries.get(name)
    try:
        status = path.lstat()
        if not every and known and known.fits(status):
            return ""
        if not stat.S_ISREG(status.st_mode):
            return "is not a file"
        if not known and path.suffix not in _SEALED:
            return "has no entry in the record of what was made"
        digest = made_files.content(path)
    except FileNotFoundError:
        return ""
    except OSError as error:
        return f"cannot be read: {error.strerror}"
    except FileError as error:
        return error.reason
    if known is None:
        entries[name] = made_files.entry(status, digest)
    elif digest != known.digest:
        return made_files.CHANGED
    else:
        entries[name] = known._replace(inode=status.st_ino)
        if status.st_mtime_ns != known.time:
            # Where it cannot be set, only time is lost: Snakemake makes anew what seems older than its input.
            with suppress(OSError):
                os.utime(path, ns=(status.st_atime_ns, known.time), follow_symlinks=False)
    return ""


def stale(plans: Sequence[Plan], results: Path) -> list[FileError]:
    """Return the files that another job is on record for; Snakemake misses them where its own record is lost."""
    found: list[FileError] = []
    for plan in plans:
        jobs = plan.files
        for name, entry in made_files.load(results, plan.key).items():
            path = f"{plan.key}/{name}"
            if entry.job and jobs.get(path, entry.job) != entry.job and (results / path).exists():
                found.append(StaleFileError(results / path, "is of another input, title or code"))
    return found


def settle(plans: Sequence[Plan], results: Path, outputs: Iterable[str]) -> None:
    """Write the manifests anew: without what was removed, and with the times of what jobs have just made.

    Snakemake sets these when a job has ended.
    """
    fresh = set(outputs)
    wanted = {path for plan in plans for path in plan.files}
    for key in (*(plan.key for plan in plans), made_files.INDEX):
        known = made_files.load(results, key)
        now = {
            name: entry
            for name, entry in known.items()
            if not key or name.startswith(BESIDE) or f"{key}/{name}" in wanted
        }
        for name, entry in tuple(now.items()):
            path = Path(key, name).as_posix()
            if path in fresh:
                with suppress(OSError):
                    status = (results / path).lstat()
                    if (status.st_size, status.st_ino) == (entry.size, entry.inode):
                        now[name] = entry._replace(time=status.st_mtime_ns)
        made_files.replace(results, key, now)


def leftovers(plans: Sequence[Plan], results: Path) -> list[Path]:
    """Return the files under names that vibsim gives, and that these experiments have not; links are nobody's.

    A temporary file that a killed job left counts as the file that it was to become.
    """
    wanted = {results / path for plan in plans for path in plan.files}
    found = []
    for folder in (results / plan.key for plan in plans):
        of_levels = [place for place in sorted(folder.glob("level_*/")) if not place.is_symlink()]
        for place in filter(Path.is_dir, (folder, *of_levels)):
            targets = [(path, path) for path in sorted(place.glob("*.nc"))]
            for path, target in [*targets, *abandoned(place)]:
                name = target.relative_to(folder).as_posix()
                is_own = path.is_file() and not path.is_symlink() and _NAMED.fullmatch(name)
                if is_own and target not in wanted:
                    found.append(path)
    return found


def remove(path: Path) -> None:
    """Remove a file, and the folder of its level when that is empty."""
    path.unlink(missing_ok=True)
    if _LEVEL.fullmatch(path.parent.name):
        # It is not empty while there is anything else in it.
        with suppress(OSError):
            path.parent.rmdir()
