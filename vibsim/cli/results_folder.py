"""Keep a results folder safe to write to: only regular files and folders, no links, pipes or devices.

A folder may come from somebody else, who put a link where a run would write; such a folder is refused. The results
folder itself may be a link, since its user has named it. Jobs that delete damaged files leave notes in the folder for
the run that started them.
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
"""Folders of an experiment where the shell and Snakemake overwrite existing files in place."""
_NEEDED = ("incomplete", "log", "metadata")
"""Parts of Snakemake's own folder that a run needs: its records, which are JSON, and its logs."""


def check(results: Path, keys: Iterable[str]) -> None:
    """Refuse all links, pipes and devices wherever runs of the experiments `keys` read or write."""
    paths = [results / name for name in (*_OURS, *keys)]
    with _naming():
        entries = (entry for path in paths for entry in _entries(path, deep=True))
        folders = {*paths, *(path.parent for path in paths)} - {results}
        _refuse([*folders, *(entry for entry in entries if not _is_plain(entry))])


def check_folders(results: Path, key: str) -> None:
    """Refuse links, pipes and devices among the folders that the jobs of the experiment `key` write to."""
    folder = results / key
    with _naming():
        special = (entry for entry in _entries(folder) if not _is_plain(entry))
        _refuse([results / ".vibsim", folder.parent, folder, *special])


def clean(results: Path, keys: Iterable[str]) -> None:
    """Prepare a checked folder for Snakemake.

    In Snakemake's own folder only the parts that a run needs stay: Snakemake would import modules from there, and a
    lock in it is left over from an ended run. A file that is overwritten in place and has hard links is copied first.
    """
    # imported here, since jobs do not need it
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
    """Delete records of Snakemake that cannot be read and would stop it; tell whether there were any."""
    unreadable = [
        Path(entry)
        for name in ("metadata", "incomplete")
        for entry in _entries(results / ".snakemake" / name, deep=True)
        if entry.is_file() and not _is_record(Path(entry).read_bytes())
    ]
    for path in unreadable:
        path.unlink()
    return bool(unreadable)


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
    """Refuse existing paths that are neither a regular file nor a folder."""
    advice = "remove it, or choose another folder with --results"
    faults = []
    for path in paths:
        with suppress(FileNotFoundError, NotADirectoryError):
            kind = stat.S_IFMT(os.lstat(path).st_mode)
            if kind not in (stat.S_IFREG, stat.S_IFDIR):
                name = _KINDS.get(kind, "neither a file nor a folder")
                rule = f"is {name}, and vibsim writes to real files and folders only"
                faults.append(Fault(os.fspath(path), 0, "", "", rule, advice))
    if faults:
        raise InputError(faults)


def _is_plain(entry: os.DirEntry[str]) -> bool:
    return entry.is_file(follow_symlinks=False) or entry.is_dir(follow_symlinks=False)


def _entries(folder: Path | str, *, deep: bool = False) -> Iterator[os.DirEntry[str]]:
    """Yield the entries of a folder, with `deep` recursively; nothing if it is not a folder."""
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

    Raises VibsimError where the path is a folder that is not empty, which vibsim may not delete, or the note cannot be
    written.
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
    """Return the notes on files deleted since the last call, and remove the notes."""
    note = results / _NOTE
    try:
        with regular_files.reading(note) as file:
            lines = file.read().decode(errors="replace").splitlines()
    except FileNotFoundError:
        return []
    note.unlink()
    return lines
