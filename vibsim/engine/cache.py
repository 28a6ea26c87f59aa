"""Compiled kernels on disk: machine code under the digest of the text that it was compiled from.

What is kept is an object file, and beside it its text, to be read by people. A file is written once and never changed:
a kernel of other text, another compiler or another processor is another file. Jobs that want the same kernel at the
same time wait for the first one to compile it.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path

from vibsim import sealed
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
        with path.with_suffix(".lock").open("w") as lock, sealed.held(lock):
            # damaged code would give wrong numbers
            code = sealed.read(path)
            if code is None:
                sealed.put(path.with_suffix(".py"), text.encode())
                code = _compile(text, kinds)
                sealed.write(path, code)
            return bind(link(code, ENTRY), kinds)
    except OSError as error:
        raise SimulationError(
            f"compiled kernels cannot be kept: {error}; "
            "set VIBSIM_CACHE_DIR to a folder that can be written"
        ) from error


def _compile(text: str, kinds: str) -> bytes:
    # what finds its kernel needs no compiler
    from vibsim.native.machine import machine_code

    return machine_code(text, ENTRY, kinds)
