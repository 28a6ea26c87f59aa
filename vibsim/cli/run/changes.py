"""Find files in a results folder that were changed since they were made, and files that are no longer needed.

A file counts as unchanged if its size, time and inode are unchanged; if one of these differs, its content is compared.
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

_SEALED = (".nc", ".json")  # files with a seal, which shows whether they are intact
_LEVEL = re.compile(r"level_\d{2,}")
_NAMED = re.compile(r"level_\d{2,}(?:/shard_\d{4,})?\.nc|best\.nc")


def changed(plans: Sequence[Plan], results: Path, *, every: bool) -> list[FileError]:
    """Return the files to be made again; files that were only copied or touched get their old time back.

    The caller holds the lock of `results`. With `every`, the content of all files is compared with their digests.
    """
    errors: list[FileError] = []
    for plan in plans:
        names = [path.removeprefix(f"{plan.key}/") for path in plan.files]
        errors.extend(_changed(results, plan.key, names, every))
    errors.extend(_changed(results, made_files.INDEX, made_files.OVER_ALL, every))
    return errors


def _changed(results: Path, key: str, names: Iterable[str], every: bool) -> Iterator[FileError]:
    folder, known = results / key, made_files.load(results, key)
    now = dict(known)
    bad = {name: problem for name in names if (problem := _problem(folder, name, now, every))}
    page = folder / "report.html"
    if page.exists() and page.name not in bad:
        for name in filter(lambda name: name.startswith(BESIDE), known):
            problem = _problem(folder, name, now, every)
            if problem or not (folder / name).exists():
                # the report job makes the page and all its files at once
                bad[page.name] = f"its file {name}: {problem or 'is missing'}"
    yield from (DamagedFileError(folder / name, problem) for name, problem in bad.items())
    if now != known:
        made_files.replace(results, key, now)


def _problem(folder: Path, name: str, entries: dict[str, Entry], every: bool) -> str:
    """Return what is wrong with a file, empty if nothing or if there is no file, and update its manifest entry."""
    path, known = folder / name, entries.get(name)
    try:
        status = path.lstat()
        if not every and known and known.fits(status):
            return ""
        if not stat.S_ISREG(status.st_mode):
            return "is not a file"
        if not known and path.suffix not in _SEALED:
            return "has no entry in the manifest"
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
            # If this fails, only time is lost: Snakemake makes files again that seem older than their input.
            with suppress(OSError):
                os.utime(path, ns=(status.st_atime_ns, known.time), follow_symlinks=False)
    return ""


def stale(plans: Sequence[Plan], results: Path) -> list[FileError]:
    """Return the files that, by the manifest, another job made; Snakemake misses them if its own record is lost."""
    errors: list[FileError] = []
    for plan in plans:
        jobs = plan.files
        for name, entry in made_files.load(results, plan.key).items():
            path = f"{plan.key}/{name}"
            if entry.job and jobs.get(path, entry.job) != entry.job and (results / path).exists():
                errors.append(
                    StaleFileError(results / path, "was made from another input, title or code")
                )
    return errors


def settle(plans: Sequence[Plan], results: Path, outputs: Iterable[str]) -> None:
    """Rewrite the manifests: drop removed files, and record the new times of `outputs`, the files just made.

    Snakemake sets these times after the job that made a file, and wrote its entry, has ended.
    """
    fresh = set(outputs)
    planned = {path for plan in plans for path in plan.files}
    for key in (*(plan.key for plan in plans), made_files.INDEX):
        known = made_files.load(results, key)
        now = {
            name: entry
            for name, entry in known.items()
            if not key or name.startswith(BESIDE) or f"{key}/{name}" in planned
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
    """Return the files that have names of vibsim but belong to no plan; links are left alone.

    The temporary file of a killed job counts as its target.
    """
    planned = {results / path for plan in plans for path in plan.files}
    unused = []
    for folder in (results / plan.key for plan in plans):
        levels = [path for path in sorted(folder.glob("level_*/")) if not path.is_symlink()]
        for parent in filter(Path.is_dir, (folder, *levels)):
            targets = [(path, path) for path in sorted(parent.glob("*.nc"))]
            for path, target in [*targets, *abandoned(parent)]:
                name = target.relative_to(folder).as_posix()
                is_ours = path.is_file() and not path.is_symlink() and _NAMED.fullmatch(name)
                if is_ours and target not in planned:
                    unused.append(path)
    return unused


def remove(path: Path) -> None:
    """Remove a file, and the folder of its level if that becomes empty."""
    path.unlink(missing_ok=True)
    if _LEVEL.fullmatch(path.parent.name):
        # rmdir fails while the folder has other files
        with suppress(OSError):
            path.parent.rmdir()
