"""A results folder holds files and folders only, so that nothing is written outside of it, and no pipe is waited for.

It may come from somebody else, who put a link where a run writes. Such a folder is refused. The results folder itself
may be a link, which its user has named. Of files that must not be used, which were deleted, a job leaves notes there
for the run that started it.
"""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from vibsim import store
from vibsim.core import regular_files
from vibsim.core.errors import Fault, FileError, InputError, VibsimError

_NOTE = ".vibsim/deleted.txt"
_OURS = (".vibsim", ".snakemake", "index.html", "summary.csv")
_IN_PLACE = ("logs", "benchmarks", "figures", "tables")
"""Folders of an experiment where the shell and Snakemake write to files that are there."""
_NEEDED = ("incomplete", "log", "metadata")
"""What a run needs of Snakemake's own folder: its records, which are JSON, and its logs."""


def check(results: Path, keys: Iterable[str]) -> None:
    """Refuse a results folder with anything else where runs of the experiments `keys` read and write.

    Raises
    ------
    InputError
        With every path that is neither a file nor a folder.
    """
    places = [results / name for name in (*_OURS, *keys)]
    with _naming():
        found = (entry for place in places for entry in _entries(place, deep=True))
        folders = {*places, *(place.parent for place in places)} - {results}
        _refuse([*folders, *(entry for entry in found if not _is_plain(entry))])


def check_folders(results: Path, key: str) -> None:
    """Refuse the same among the folders that the jobs of the experiment `key` write to."""
    folder = results / key
    with _naming():
        found = (entry for entry in _entries(folder) if not _is_plain(entry))
        _refuse([results / ".vibsim", folder.parent, folder, *found])


def clean(results: Path, keys: Iterable[str]) -> None:
    """Make a checked folder one that Snakemake may be started in.

    Of Snakemake's own folder only what a run needs stays: Snakemake would import modules from there, and a lock in it
    belongs to a run that is no more. A file that is written in place and has another name elsewhere becomes one of its
    own.
    """
    # jobs do without it
    from shutil import rmtree

    records = results / ".snakemake"
    written = [results / key / name for key in keys for name in _IN_PLACE]
    with _naming():
        for entry in _entries(records):
            if entry.name not in _NEEDED:
                rmtree(entry) if entry.is_dir() else Path(entry).unlink()
        for folder in (results / ".vibsim", records, *written):
            for entry in _entries(folder, deep=True):
                if not entry.is_dir() and entry.stat().st_nlink > 1:
                    store.write_bytes(Path(entry), Path(entry).read_bytes())


def forget(results: Path) -> bool:
    """Remove the records of Snakemake that cannot be read, which end its work; tell whether there were any."""
    found = [
        Path(entry)
        for name in ("metadata", "incomplete")
        for entry in _entries(results / ".snakemake" / name, deep=True)
        if entry.is_file() and not _is_record(Path(entry).read_bytes())
    ]
    for path in found:
        path.unlink()
    return bool(found)


def _is_record(content: bytes) -> bool:
    try:
        return isinstance(json.loads(content), dict)
    except ValueError:
        return False


_KINDS = {
    stat.S_IFLNK: "a symbolic link",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def _refuse(paths: Iterable[os.PathLike[str]]) -> None:
    """Refuse those that are there, and neither a file nor a folder."""
    advice = "remove it, or choose another folder with --results"
    faults = []
    for path in paths:
        with suppress(FileNotFoundError, NotADirectoryError):
            kind = stat.S_IFMT(os.lstat(path).st_mode)
            if kind not in (stat.S_IFREG, stat.S_IFDIR):
                what = _KINDS.get(kind, "no file and no folder")
                rule = f"is {what}, and vibsim writes to real files and folders only"
                faults.append(Fault(os.fspath(path), 0, "", "", rule, advice))
    if faults:
        raise InputError(faults)


def _is_plain(entry: os.DirEntry[str]) -> bool:
    return entry.is_file(follow_symlinks=False) or entry.is_dir(follow_symlinks=False)


def _entries(folder: Path | str, *, deep: bool = False) -> Iterator[os.DirEntry[str]]:
    """Yield what is in a folder, with `deep` also what is in the folders there; nothing where it is no folder."""
    with suppress(FileNotFoundError, NotADirectoryError), os.scandir(folder) as entries:
        for entry in entries:
            yield entry
            if deep and entry.is_dir(follow_symlinks=False):
                yield from _entries(entry.path, deep=True)


@contextmanager
def _naming() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise VibsimError(f"{error.filename}: cannot be used ({error.strerror})") from error


def delete(error: FileError, results: Path) -> None:
    """Delete the file that `error` names and leave a note, so that the run makes it again.

    Raises
    ------
    VibsimError
        Where a folder with something in it has the place of the file, which is not ours to delete, or the note cannot
        be written.
    """
    try:
        if error.path.is_dir() and not error.path.is_symlink():
            error.path.rmdir()
        else:
            error.path.unlink(missing_ok=True)
    except OSError as reason:
        text = f"{error.path}: cannot be deleted ({reason.strerror}); move it away"
        raise VibsimError(text) from None
    try:
        regular_files.append(results / _NOTE, f"{error}\n".encode())
    except OSError as reason:
        raise VibsimError(f"{results / _NOTE}: cannot be written ({reason.strerror})") from None


def deleted(results: Path) -> list[str]:
    """Return what was deleted since the last time, and why."""
    note = results / _NOTE
    try:
        with regular_files.reading(note) as file:
            lines = file.read().decode(errors="replace").splitlines()
    except FileNotFoundError:
        return []
    note.unlink()
    return lines
