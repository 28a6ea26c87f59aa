"""References on disk, so that the jobs of an experiment's levels do not compute the same one again.

An entry is named by the digest of all that its numbers depend on: the model, the numbers of its members, the code that
computes it, the libraries and the processor. It is the arrays and behind them their SHA-256, written aside and then put
into its place. One that is damaged, or no entry at all, is computed again. Jobs that want the same reference at the
same time wait for the first one to compute it. The folder holds a bounded number of bytes; what was used last stays
longest.
"""

from __future__ import annotations

import hashlib
import io
import os
import platform
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim import sealed
from vibsim.engine.cache import folder
from vibsim.expression import Expression
from vibsim.models import Model, tree
from vibsim.plan.code import of_folder
from vibsim.plan.versions import versions

Arrays = Mapping[str, NDArray[Any]]

MOST_BYTES = 2**29
"""Size of the folder, at most."""
MOST_OF_ENTRY = 2**26
"""A larger entry is not kept."""
LOCKS = 2
"""Digits of a digest that name a lock: 256 files, whatever the number of references."""


def home() -> Path:
    """Return the folder of references, inside that of compiled kernels."""
    return folder() / "references"


def kept(digest: str, compute: Callable[[], Arrays]) -> Arrays:
    """Return the arrays of an entry: those on disk, or what `compute` returns, which is kept.

    Where the folder cannot be written, everything is computed.
    """
    try:
        home().mkdir(parents=True, exist_ok=True)
        lock = (home() / f"lock_{digest[:LOCKS]}").open("w")
    except OSError:
        return compute()
    with lock, sealed.held(lock):
        path = home() / f"reference_{digest}"
        found = _read(path)
        if found is None:
            found = compute()
            _write(path, found)
    return found


def _read(path: Path) -> Arrays | None:
    """Return the arrays of an entry; None where there is none, or it is not as it was written."""
    try:
        content = sealed.read(path, _label(path))
    except OSError:
        return None
    if content is None:
        return None
    with suppress(OSError):
        # the one used last is the newest
        os.utime(path)
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        return dict(arrays)


def _label(path: Path) -> bytes:
    """Return what is sealed with an entry: its name, so that another's entry is none."""
    return path.name.encode() + b"\0"


def _write(path: Path, arrays: Arrays) -> None:
    """Keep an entry, unless it is too large or the folder cannot be written."""
    if sum(array.nbytes for array in arrays.values()) > MOST_OF_ENTRY:
        return
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    with suppress(OSError):
        sealed.write(path, buffer.getvalue(), _label(path))
        _bound(path.parent)


def _bound(place: Path) -> None:
    """Remove what was not used for longest, until the folder is small enough: entries, and what killed jobs left."""
    rows = []
    for path in place.iterdir():
        if path.name.startswith("lock_"):
            continue
        with suppress(FileNotFoundError):
            about = path.stat()
            rows.append((about.st_mtime_ns, about.st_size, path))
    total = sum(size for _, size, _ in rows)
    for _, size, path in sorted(rows):
        if total <= MOST_BYTES:
            break
        path.unlink(missing_ok=True)
        total -= size


def digest_of(model: Model, numbers: tuple[bytes, ...]) -> str:
    """Return the digest of all that a reference depends on.

    Parameters
    ----------
    numbers
        Initial values, end times and parameters of all members.
    """
    digest = hashlib.sha256()
    for part in (*_about(model), *_surroundings(), *numbers):
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return digest.hexdigest()


def _about(model: Model) -> Iterator[bytes]:
    """Yield what a motion depends on of a model, beside the numbers of its members."""
    names = [row.name for row in model.states], [row.name for row in model.parameters]
    formulas: list[Expression] = [tree(model, row) for row in model.accelerations]
    if model.lookup is not None:
        formulas.append(tree(model, model.lookup.place))
        yield model.lookup.table.digest.encode()
    yield repr((names, formulas)).encode()


@cache
def _surroundings() -> tuple[bytes, ...]:
    """Return the code that computes references, the libraries, and what the processor can do."""
    # numpy chooses its functions by the processor
    able = sorted(name for name, has in _features().items() if has)
    libraries = sorted(versions(("numpy", "scipy")).items())
    code = "".join(of_folder(f"vibsim.{room}") for room in ("expression", "models", "simulation"))
    return code.encode(), repr((libraries, platform.machine(), able)).encode()


def _features() -> dict[str, bool]:
    return dict(import_module("numpy._core._multiarray_umath").__cpu_features__)
