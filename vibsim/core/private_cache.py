"""The user's private cache: the one place that vibsim loads code from, or anything else that it trusts as its own work.

It holds compiled kernels, references and plans, each kind in a folder of its own inside of ``$VIBSIM_CACHE_DIR``, else
of ``vibsim`` in the user's cache folder. A seal tells a damaged entry from a whole one and says which entry it is, but
anybody can make a seal. What keeps others out is the file system (`vibsim.core.ownership`): no one but the user, and
root, can write to the folders or replace them. What cannot be kept is made again.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TypeVar

from vibsim.core import ownership, regular_files

Thing = TypeVar("Thing")

KINDS = ("kernels", "plans", "references")
MOST_BYTES = 2**29
"""Size of the folder of a kind, at most."""
MOST_OF_ENTRY = 2**26
"""A larger entry is not kept."""
VARIABLE = "VIBSIM_CACHE_DIR"
_LOCKS = 2
"""Digits of a name that name a lock: 256 files, whatever the number of entries."""
_SEAL = 32
"""Bytes of the SHA-256 behind the content."""


def kept(
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

    def found() -> Thing | None:
        content = folder.read(name)
        return None if content is None else load(content)

    thing = found()
    if thing is not None:
        return thing
    with folder.held(name):
        # another one may have made it
        thing = found()
        if thing is None:
            thing = make()
            content = dump(thing)
            if content is not None:
                folder.write(name, content)
    return thing


def place() -> Path:
    """Return the folder of the cache, which need not be there.

    Raises
    ------
    OSError
        Where nothing names one.
    """
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
    """Open the folder once for each process and user."""
    with suppress(OSError):
        return Folder(kind, ownership.inside(place, kind))
    return None


@contextmanager
def provided() -> Iterator[str]:
    """Give this process and its children a private cache; where the user has none, one that ends with this block.

    Yields
    ------
    str
        Why the user has none; empty where there is one.

    Raises
    ------
    OSError
        Where there is no folder for temporary files either.
    """
    # every job imports this module, and only a run has use for it
    from tempfile import TemporaryDirectory

    before = os.environ.get(VARIABLE)
    reason = _problem()
    try:
        if not reason:
            # a relative name would be another folder for processes that work elsewhere
            os.environ[VARIABLE] = str(place())
            yield ""
        else:
            with TemporaryDirectory(prefix="vibsim-", ignore_cleanup_errors=True) as folder:
                os.environ[VARIABLE] = folder
                yield reason
    finally:
        os.environ.pop(VARIABLE)
        if before is not None:
            os.environ[VARIABLE] = before


def _problem() -> str:
    """Say why the user has no private cache; empty where there is one that can be written."""
    try:
        for kind in KINDS:
            os.close(ownership.inside(place(), kind))
            ownership.check_writable(place() / kind)
    except OSError as error:
        return f"{error.filename}: {error.strerror}"
    return ""


@dataclass(frozen=True)
class Folder:
    """The folder of a kind, opened."""

    kind: str
    descriptor: int

    def read(self, name: str) -> bytes | None:
        """Return the content of an entry; None where there is none, it is not as it was written, or not ours."""
        try:
            found = ownership.file(name, os.O_RDONLY, self.descriptor)
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
            lock = ownership.file(f"lock_{name[:_LOCKS]}", flags, self.descriptor)
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
