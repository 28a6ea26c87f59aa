"""Compiled kernels on disk: machine code under the digest of the text that it was compiled from.

What is kept is an object file, and beside it its text, to be read by people. A file is written once and never changed:
a kernel of other text, another compiler or another processor is another file. Jobs that want the same kernel at the
same time wait for the first one to compile it.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from vibsim.engine.entry import bind
from vibsim.errors import SimulationError

Kernel = Callable[..., None]

ENTRY = "kernel"
"""Name of the function that is called."""


def folder() -> Path:
    """Return the folder of compiled kernels: ``$VIBSIM_CACHE_DIR``, else the user's cache folder."""
    named = os.environ.get("VIBSIM_CACHE_DIR")
    if named:
        return Path(named)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "vibsim" / "kernels"


def load(text: str, kinds: str) -> Kernel:
    """Return the function ``kernel`` of the module `text`, compiled now or before.

    Parameters
    ----------
    kinds
        Kinds of its arguments (`vibsim.engine.entry`).

    Raises
    ------
    SimulationError
        Where the text cannot be compiled, or the cache folder cannot be written.
    """
    # what only plans, analyses or draws needs no LLVM
    from vibsim.native.linking import identity, link

    key = "\n".join((text, kinds, identity()))
    name = f"kernel_{hashlib.sha256(key.encode()).hexdigest()[:24]}"
    try:
        home = folder()
        home.mkdir(parents=True, exist_ok=True)
        path = home / f"{name}.o"
        with _lock(path.with_suffix(".lock")):
            code = _whole(path)
            if code is None:
                _write(path.with_suffix(".py"), text.encode())
                code = _compile(text, kinds)
                _write(path, code + hashlib.sha256(code).digest())
            return bind(link(code, ENTRY), kinds)
    except OSError as error:
        raise SimulationError(
            f"compiled kernels cannot be kept: {error}; "
            "set VIBSIM_CACHE_DIR to a folder that can be written"
        ) from error


def _whole(path: Path) -> bytes | None:
    """Return the code in a file, None where it is not as it was written: damaged code would give wrong numbers."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return None
    code, seal = content[:-32], content[-32:]
    return code if code and hashlib.sha256(code).digest() == seal else None


def _write(path: Path, content: bytes) -> None:
    with tempfile.NamedTemporaryFile("wb", dir=path.parent, suffix=".tmp", delete=False) as file:
        file.write(content)
    Path(file.name).replace(path)


def _compile(text: str, kinds: str) -> bytes:
    # what finds its kernel needs no compiler
    from vibsim.native.machine import machine_code

    return machine_code(text, ENTRY, kinds)


@contextmanager
def _lock(path: Path) -> Iterator[None]:
    """Hold the lock file `path`; it goes with the process, so that a killed job leaves nothing locked."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
