"""The user's private cache: the one place that vibsim loads code from, or anything else that it trusts as its own work.

It holds compiled kernels and templates, references, plans, and what modules import, each kind in a folder of its own
inside of ``$VIBSIM_CACHE_DIR``, else of ``vibsim`` in the user's cache folder. A seal tells a damaged entry from a
whole one and says which entry it is, but anybody can make a seal. What keeps others out is the file system: no one but
the user, and root, can write to the folders or replace them. A folder that others can write to is refused and not
changed, since closing it afterwards would leave what they put there; a folder of ours that others can only read is
closed to them. What cannot be kept is made again.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import os
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TypeVar

from vibsim.core import regular_files

Thing = TypeVar("Thing")

KINDS = ("imports", "kernels", "plans", "references", "templates")
MOST_BYTES = 2**29
"""Size of the folder of a kind, at most."""
MOST_OF_ENTRY = 2**26
"""A larger entry is not kept."""
VARIABLE = "VIBSIM_CACHE_DIR"
_LOCKS = 2
"""Digits of a name that name a lock: 256 files, whatever the number of entries."""
_SEAL = 32
"""Bytes of the SHA-256 behind the content."""
_FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
_MODE = 0o700
_MOST_LINKS = 40
"""Links that a path may lead through, as for the system."""


def cached(
    kind: str,
    name: str,
    make: Callable[[], Thing],
    dump: Callable[[Thing], bytes | None],
    load: Callable[[bytes], Thing | None],
) -> Thing:
    """Return an entry of the cache: the one on disk, or what `make` returns, which is kept.

    Processes that want the same entry at the same time wait for the first one to make it.

    Parameters
    ----------
    kind
        The folder, one of `KINDS`.
    name
        The entry, beginning with a digest of all that it depends on.
    make, dump, load
        Makes it; turns it into bytes, None where it is not to be kept; turns bytes into it, None where they are not it.
    """
    folder = opened(kind)
    if folder is None:
        return make()
    content = folder.read(name)
    thing = None if content is None else load(content)
    if thing is not None:
        return thing
    with folder.held(name):
        # another one may have made it
        content = folder.read(name)
        thing = None if content is None else load(content)
        if thing is None:
            thing = make()
            content = dump(thing)
            if content is not None:
                folder.write(name, content)
    return thing


def place() -> Path:
    """Return the folder of the cache, which need not be there; OSError where nothing names one."""
    if named := os.environ.get(VARIABLE):
        return Path(named).absolute()
    return general() / "vibsim"


def general() -> Path:
    """Return the folder where all programs of the user keep their caches; `place` tells what it raises."""
    named = os.environ.get("XDG_CACHE_HOME", "")
    # a relative one is invalid, says the XDG Base Directory Specification, and would be another one in each job
    if Path(named).is_absolute():
        return Path(named)
    # Path.home raises RuntimeError where there is none
    home = Path(os.path.expanduser("~"))  # noqa: PTH111
    if not home.is_absolute():
        raise OSError(0, "there is no home folder", "$HOME")
    return home / ".cache"


def opened(kind: str) -> Folder | None:
    """Return the folder of a kind; None where it cannot be had, or others could have written to it."""
    try:
        return _opened(place(), kind, os.geteuid())
    except OSError:
        return None


@cache
def _opened(place: Path, kind: str, user: int) -> Folder | None:
    # once for each process and user
    with suppress(OSError):
        return Folder(kind, _inside(place, kind))
    return None


@contextmanager
def provided() -> Iterator[str]:
    """Give this process and its children a private cache; where the user has none, one that ends with this block.

    Yields why the user has none, empty where there is one. OSError where there is no folder for temporary files either.
    """
    # every job imports this module, and only a run has use for it
    from vibsim.core.temporary import temporary_folder

    before = os.environ.get(VARIABLE)
    reason = ""
    try:
        for kind in KINDS:
            os.close(_inside(place(), kind))
            check(place() / kind, writable=True)
    except OSError as error:
        reason = f"{error.filename}: {error.strerror}"
    try:
        if not reason:
            # a relative name would be another folder for processes that work elsewhere
            os.environ[VARIABLE] = str(place())
            yield ""
        else:
            with temporary_folder() as folder:
                os.environ[VARIABLE] = str(folder)
                yield reason
    finally:
        os.environ.pop(VARIABLE)
        if before is not None:
            os.environ[VARIABLE] = before


@dataclass(frozen=True)
class Folder:
    """The folder of a kind, opened."""

    kind: str
    descriptor: int

    def read(self, name: str) -> bytes | None:
        """Return the content of an entry; None where there is none, it is not as it was written, or not ours."""
        try:
            found = _file(name, os.O_RDONLY, self.descriptor)
        except OSError:
            return None
        with os.fdopen(found, "rb") as file:
            whole = file.read()
            # read times tell what was used last; when it was written stays
            with suppress(OSError):
                os.utime(found, ns=(time.time_ns(), os.fstat(found).st_mtime_ns))
        content, seal = whole[:-_SEAL], whole[-_SEAL:]
        return content if content and self._seal(name, content) == seal else None

    def write(self, name: str, content: bytes) -> None:
        """Keep an entry, of which others see nothing or all, unless it is too large or cannot be written."""
        if len(content) <= MOST_OF_ENTRY:
            self.put(name, content + self._seal(name, content))
            self._bound()

    def put(self, name: str, content: bytes) -> None:
        """Write a file without a seal in the same way, to be read by people."""
        temporary = f".{os.urandom(8).hex()}.tmp"
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
        with suppress(OSError):
            made = regular_files.descriptor(temporary, flags, folder=self.descriptor)
            with os.fdopen(made, "wb") as file:
                file.write(content)
            os.replace(temporary, name, src_dir_fd=self.descriptor, dst_dir_fd=self.descriptor)

    @contextmanager
    def held(self, name: str) -> Iterator[None]:
        """Keep others from an entry. A lock goes with its process; where there can be none, work goes on without."""
        lock = -1
        with suppress(OSError):
            flags = os.O_RDWR | os.O_CREAT
            lock = _file(f"lock_{name[:_LOCKS]}", flags, self.descriptor)
            fcntl.flock(lock, fcntl.LOCK_EX)
        try:
            yield
        finally:
            if lock >= 0:
                os.close(lock)

    def _seal(self, name: str, content: bytes) -> bytes:
        digest = hashlib.sha256(f"{self.kind}/{name}\0".encode())
        digest.update(content)
        return digest.digest()

    def _bound(self) -> None:
        """Remove what was not used for longest, also what killed jobs left, until the folder is small enough."""
        rows = []
        for entry in os.scandir(self.descriptor):
            if entry.name.startswith("lock_"):
                continue
            with suppress(FileNotFoundError):
                about = entry.stat(follow_symlinks=False)
                rows.append((about.st_atime_ns, about.st_size, entry.name))
        total = sum(size for _, size, _ in rows)
        for _, size, name in sorted(rows):
            if total <= MOST_BYTES:
                break
            with suppress(OSError):
                os.unlink(name, dir_fd=self.descriptor)
            total -= size


def _inside(place: Path, name: str) -> int:
    """Return the descriptor of folder `name` inside of `place`, both made where they are missing; see `check`."""
    check(place)
    outer = os.open(place, _FOLDER)
    try:
        with suppress(FileExistsError):
            os.mkdir(name, _MODE, dir_fd=outer)
        return _open_folder(place / name, outer)
    finally:
        os.close(outer)


def check(place: Path, *, writable: bool = False) -> None:
    """Make a folder where it is missing, and refuse one that others can write to, or could put another in its place.

    Raises
    ------
    OSError
        With the path and the reason, also where files cannot be made in it and it is to be `writable`.
    """
    for folder in (*reversed(place.parents), place):
        with suppress(FileExistsError):
            folder.mkdir(_MODE)
    _check_way(place.parent)
    os.close(_open_folder(place))
    if writable and not os.access(place, os.W_OK | os.X_OK):
        raise _refusal(place, "cannot be written")


def _check_way(path: Path, links: int = 0) -> None:
    """Refuse where one of the folders that lead to `path`, or a link among them, is another user's."""
    for folder in (*reversed(path.parents), path):
        about = folder.lstat()
        if about.st_uid not in (0, os.geteuid()):
            raise _refusal(folder, "belongs to another user")
        if stat.S_ISLNK(about.st_mode):
            if links == _MOST_LINKS:
                raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
            there = folder.parent / folder.readlink() / path.relative_to(folder)
            return _check_way(there, links + 1)
        # in a sticky folder nobody renames what is another's
        if about.st_mode & _OTHERS_WRITE and not about.st_mode & stat.S_ISVTX:
            raise _refusal(folder, "others can write to it")
    return None


def _open_folder(path: Path, outer: int | None = None) -> int:
    """Open a folder of ours, relative to the descriptor `outer` where there is one, and close it to others there."""
    try:
        found = os.open(path.name if outer is not None else path, _FOLDER, dir_fd=outer)
    except OSError as error:
        reason = "is a link" if path.is_symlink() else error.strerror
        raise OSError(error.errno, reason, str(path)) from None
    about = os.fstat(found)
    try:
        if about.st_uid != os.geteuid():
            raise _refusal(path, "belongs to another user")
        if about.st_mode & _OTHERS_WRITE:
            raise _refusal(path, "others can write to it")
        # what others can read is no danger, and the folder that a user names keeps its mode
        if outer is not None and stat.S_IMODE(about.st_mode) != _MODE:
            os.fchmod(found, _MODE)
    except OSError:
        os.close(found)
        raise
    return found


def _file(name: str, flags: int, folder: int) -> int:
    """Return the descriptor of a file in an opened folder; OSError unless it is a regular one of ours alone."""
    found = regular_files.descriptor(name, flags | os.O_NOFOLLOW, folder=folder)
    about = os.fstat(found)
    if about.st_uid == os.geteuid() and about.st_nlink == 1 and not about.st_mode & _OTHERS_WRITE:
        return found
    os.close(found)
    raise _refusal(Path(name), "is not ours alone")


def _refusal(path: Path, reason: str) -> OSError:
    return OSError(errno.EPERM, reason, str(path))
