"""Compiled kernels on disk, under the digest of their text.

numba keys its cache by the file a function stands in, so each kernel gets a file of its own, named after what is in
it. The file is written once and never changed: a kernel of other text, another numba or another Python is another
file. Jobs that want the same kernel at the same time wait for the first one to compile it.
"""

from __future__ import annotations

import fcntl
import hashlib
import importlib.util
import os
import platform
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

from vibsim.errors import SimulationError

Kernel = Callable[..., None]


def folder() -> Path:
    """Return the folder of compiled kernels: ``$VIBSIM_CACHE_DIR``, else the user's cache folder."""
    named = os.environ.get("VIBSIM_CACHE_DIR")
    if named:
        return Path(named)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "vibsim" / "kernels"


def load(text: str) -> Kernel:
    """Return the function ``kernel`` of the module `text`, compiled now or before.

    Raises
    ------
    SimulationError
        Where the text cannot be compiled, or the cache folder cannot be written.
    """
    key = "\n".join((text, version("numba"), platform.python_version()))
    name = f"kernel_{hashlib.sha256(key.encode()).hexdigest()[:24]}"
    try:
        home = folder()
        home.mkdir(parents=True, exist_ok=True)
        path = home / f"{name}.py"
        with _lock(path.with_suffix(".lock")):
            if _is_whole(path, text):
                return _compile(path, name)
            _clear(path)
            _write(path, text)
            kernel = _compile(path, name)
            _write(path.with_suffix(".sha256"), _seal(path))
            return kernel
    except OSError as error:
        raise SimulationError(
            f"compiled kernels cannot be kept: {error}; "
            "set VIBSIM_CACHE_DIR to a folder that can be written"
        ) from error


def _compiled(path: Path) -> list[Path]:
    """Return the files that numba keeps of a kernel."""
    return sorted((path.parent / "__pycache__").glob(f"{path.stem}.*"))


def _seal(path: Path) -> str:
    """Return the digest of a kernel's text and of everything that was compiled from it."""
    digest = hashlib.sha256()
    for file in (path, *_compiled(path)):
        digest.update(f"{file.name} {file.stat().st_size}\n".encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _is_whole(path: Path, text: str) -> bool:
    """Tell whether the kernel on disk is as it was written: damaged machine code would give wrong numbers."""
    seal = path.with_suffix(".sha256")
    if not (path.exists() and seal.exists()):
        return False
    return seal.read_text() == _seal(path) and path.read_text() == text


def _clear(path: Path) -> None:
    for file in (path, path.with_suffix(".sha256"), *_compiled(path)):
        file.unlink(missing_ok=True)


def _write(path: Path, text: str) -> None:
    with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".tmp", delete=False) as file:
        file.write(text)
    Path(file.name).replace(path)


def _compile(path: Path, name: str) -> Kernel:
    """Import the kernel and compile it for the one set of types that the engine calls it with."""
    from numba import float64, int64, void
    from numba.core.errors import NumbaError

    specification = importlib.util.spec_from_file_location(name, path)
    if specification is None or specification.loader is None:
        raise SimulationError(f"{path}: cannot be imported")
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    specification.loader.exec_module(module)
    array, table, cube = float64[::1], float64[:, ::1], float64[:, :, ::1]
    whole = (int64, int64, int64, int64)
    dispatcher: Any = module.kernel
    try:
        dispatcher.compile(void(table, table, array, *whole, float64, cube, table, int64[:, ::1]))
    except NumbaError as error:
        raise SimulationError(f"a kernel cannot be compiled ({path}): {error}") from error
    kernel: Kernel = dispatcher
    return kernel


@contextmanager
def _lock(path: Path) -> Iterator[None]:
    """Hold the lock file `path`; it goes with the process, so that a killed job leaves nothing locked."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
