"""References on disk, so that the jobs of an experiment's levels do not compute the same one again.

An entry of the private cache (`vibsim.core.private_cache`) is named by the digest of all that its numbers depend on:
the model, the numbers of its members, the code that computes it, the libraries and the processor. One that is damaged,
or no entry at all, is computed again.
"""

from __future__ import annotations

import hashlib
import io
import platform
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core import private_cache
from vibsim.formula import Expression
from vibsim.models import Model, tree
from vibsim.plan.code_digest import of_folder
from vibsim.plan.versions import versions

Arrays = Mapping[str, NDArray[Any]]


def kept(digest: str, compute: Callable[[], Arrays]) -> Arrays:
    """Return the arrays of an entry: those on disk, or what `compute` returns, which is kept."""
    return private_cache.kept("references", digest, compute, _dump, _load)


def _dump(arrays: Arrays) -> bytes | None:
    # arrays that are not kept need no copy either
    if sum(array.nbytes for array in arrays.values()) > private_cache.MOST_OF_ENTRY:
        return None
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def _load(content: bytes) -> Arrays:
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        return dict(arrays)


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
    code = "".join(of_folder(f"vibsim.{room}") for room in ("formula", "models", "simulation"))
    return code.encode(), repr((libraries, platform.machine(), able)).encode()


def _features() -> dict[str, bool]:
    return dict(import_module("numpy._core._multiarray_umath").__cpu_features__)
