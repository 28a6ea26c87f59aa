"""The user's private cache: the only folder from which vibsim loads code, or other data that it trusts as its own.

It holds compiled kernels and templates, reference solutions, plans, and the imports of modules, each kind in its own
folder in ``$VIBSIM_CACHE_DIR``, by default in ``vibsim`` in the user's cache folder. A seal detects damaged entries and
identifies each one, but anybody can make a seal: security rests on the file system. Only the user and root can write to
the folders or replace them. A folder that others can write to is refused and left as it is, since restricting it would
keep what they put there; a folder that others can only read is made private.
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
"""Most bytes in the folder of one kind."""
MOST_OF_ENTRY = 2**26
"""Largest entry that is stored [bytes]."""
VARIABLE = "VIBSIM_CACHE_DIR"
_LOCKS = 2
"""Number of leading digits of an entry's name that name its lock: 256 lock files for any number of entries."""
_SEAL = 32
"""Length of the SHA-256 after the content [bytes]."""
_FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
_MODE = 0o700
_MOST_LINKS = 40
"""Most symbolic links in a path, as in the Linux kernel."""


def cached(
    kind: str,
    name: str,
    make: Callable[[], Thing],
    dump: Callable[[Thing], bytes | None],
    load: Callable[[bytes], Thing | None],
) -> Thing:
    """Return an entry of the cache: the stored one, or the result of `make`, which is then stored.

    Processes that need the same entry at the same time wait for the first one to make it.

    Parameters
    ----------
    kind
        The folder, one of `KINDS`.
    name
        Name of the entry, which begins with a digest of all that it depends on.
    make, dump, load
        Make the entry; return its bytes, or None if it shall not be stored; return the entry from bytes, or None if
        these are invalid.
    """
    folder = opened(kind)
    if folder is None:
        return make()
    content = folder.read(name)
    thing = None if content is None else load(content)
    if thing is not None:
        return thing
    with folder.held(name):
        # another process may have made it meanwhile
        content = folder.read(name)
        thing = None if content is None else load(content)
        if thing is None:
            thing = make()
            content = dump(thing)
            if content is not None:
                folder.write(name, content)
    return thing


def place() -> Path:
    """Return the folder of the cache, which need not exist; raises OSError where the user has no home folder."""
    if named := os.environ.get(VARIABLE):
        return Path(named).absolute()
    return general() / "vibsim"


def general() -> Path:
    """Return the folder for the caches of all programs of the user; raises OSError as `place` does."""
    named = os.environ.get("XDG_CACHE_HOME", "")
    # relative paths are invalid (XDG Base Directory Specification), and would differ between jobs
    if Path(named).is_absolute():
        return Path(named)
    # Path.home would raise RuntimeError without a home folder
    home = Path(os.path.expanduser("~"))  # noqa: PTH111
    if not home.is_absolute():
        raise OSError(0, "there is no home folder", "$HOME")
    return home / ".cache"


def opened(kind: str) -> Folder | None:
    """Return the folder of a kind; None if it cannot be used, or if others may have written to it."""
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
    """Provide a private cache for this process and its children: the user's, or a temporary one within the context.

    Yields the reason why the user's cache cannot be used, empty if it can. Raises OSError if there is no folder for
    temporary files either.
    """
    # imported here, since every job imports this module but only a run calls this function
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
            # an absolute path, since child processes have other working directories
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
    """The open folder of one kind of entries."""

    kind: str
    descriptor: int

    def read(self, name: str) -> bytes | None:
        """Return the content of an entry; None if it does not exist, is damaged, or may be another user's."""
        try:
            descriptor = _file(name, os.O_RDONLY, self.descriptor)
        except OSError:
            return None
        with os.fdopen(descriptor, "rb") as file:
            whole = file.read()
            # set the access time, by which `_bound` finds old entries; keep the modification time
            with suppress(OSError):
                os.utime(descriptor, ns=(time.time_ns(), os.fstat(descriptor).st_mtime_ns))
        content, seal = whole[:-_SEAL], whole[-_SEAL:]
        return content if content and self._seal(name, content) == seal else None

    def write(self, name: str, content: bytes) -> None:
        """Store an entry in one step, unless it is too large or cannot be written."""
        if len(content) <= MOST_OF_ENTRY:
            self.put(name, content + self._seal(name, content))
            self._bound()

    def put(self, name: str, content: bytes) -> None:
        """Write a file in one step, without a seal, if it can be written."""
        temporary = f".{os.urandom(8).hex()}.tmp"
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
        with suppress(OSError):
            descriptor = regular_files.descriptor(temporary, flags, folder=self.descriptor)
            with os.fdopen(descriptor, "wb") as file:
                file.write(content)
            os.replace(temporary, name, src_dir_fd=self.descriptor, dst_dir_fd=self.descriptor)

    @contextmanager
    def held(self, name: str) -> Iterator[None]:
        """Lock an entry within the context; without a lock if none is possible. A lock ends with its process."""
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
        """Remove the least recently used files, also those left by killed jobs, until the folder is small enough."""
        rows = []
        for entry in os.scandir(self.descriptor):
            if entry.name.startswith("lock_"):
                continue
            with suppress(FileNotFoundError):
                info = entry.stat(follow_symlinks=False)
                rows.append((info.st_atime_ns, info.st_size, entry.name))
        total = sum(size for _, size, _ in rows)
        for _, size, name in sorted(rows):
            if total <= MOST_BYTES:
                break
            with suppress(OSError):
                os.unlink(name, dir_fd=self.descriptor)
            total -= size


def _inside(place: Path, name: str) -> int:
    """Open folder `name` in `place` and return its descriptor; both are made if missing, and checked as in `check`."""
    check(place)
    outer = os.open(place, _FOLDER)
    try:
        with suppress(FileExistsError):
            os.mkdir(name, _MODE, dir_fd=outer)
        return _open_folder(place / name, outer)
    finally:
        os.close(outer)


def check(place: Path, *, writable: bool = False) -> None:
    """Make a folder if it is missing, and refuse it if others can write to it or could replace it.

    Raises
    ------
    OSError
        States the path and the reason; with `writable`, also where this user cannot create files in the folder.
    """
    for folder in (*reversed(place.parents), place):
        with suppress(FileExistsError):
            folder.mkdir(_MODE)
    _check_parents(place.parent)
    os.close(_open_folder(place))
    if writable and not os.access(place, os.W_OK | os.X_OK):
        raise _refusal(place, "cannot be written")


def _check_parents(path: Path, links: int = 0) -> None:
    """Refuse `path` if another user owns or can write to it, to a folder above it, or to a link among them."""
    for folder in (*reversed(path.parents), path):
        info = folder.lstat()
        if info.st_uid not in (0, os.geteuid()):
            raise _refusal(folder, "belongs to another user")
        if stat.S_ISLNK(info.st_mode):
            if links == _MOST_LINKS:
                raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
            target = folder.parent / folder.readlink() / path.relative_to(folder)
            return _check_parents(target, links + 1)
        # in a sticky folder, users cannot rename the files of others
        if info.st_mode & _OTHERS_WRITE and not info.st_mode & stat.S_ISVTX:
            raise _refusal(folder, "others can write to it")
    return None


def _open_folder(path: Path, outer: int | None = None) -> int:
    """Open a folder of this user; relative to the descriptor `outer`, if given, it is also made private."""
    try:
        folder = os.open(path.name if outer is not None else path, _FOLDER, dir_fd=outer)
    except OSError as error:
        reason = "is a link" if path.is_symlink() else error.strerror
        raise OSError(error.errno, reason, str(path)) from None
    info = os.fstat(folder)
    try:
        if info.st_uid != os.geteuid():
            raise _refusal(path, "belongs to another user")
        if info.st_mode & _OTHERS_WRITE:
            raise _refusal(path, "others can write to it")
        # the folder that the user names keeps its mode: it is no danger that others can read it
        if outer is not None and stat.S_IMODE(info.st_mode) != _MODE:
            os.fchmod(folder, _MODE)
    except OSError:
        os.close(folder)
        raise
    return folder


def _file(name: str, flags: int, folder: int) -> int:
    """Open a file in an open folder; raises OSError unless it is a regular file that only this user can write to."""
    file = regular_files.descriptor(name, flags | os.O_NOFOLLOW, folder=folder)
    info = os.fstat(file)
    if info.st_uid == os.geteuid() and info.st_nlink == 1 and not info.st_mode & _OTHERS_WRITE:
        return file
    os.close(file)
    raise _refusal(Path(name), "is not ours alone")


def _refusal(path: Path, reason: str) -> OSError:
    return OSError(errno.EPERM, reason, str(path))
