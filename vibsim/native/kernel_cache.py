"""Compiled kernels on disk: machine code under the digest of the text that it was compiled from.

What is kept is an object file, and beside it its text, to be read by people. A file is written once and never changed:
a kernel of other text, another compiler or another processor is another file. Loading one runs it, so that they lie in
the private cache alone (`vibsim.core.private_cache`); without one, kernels are compiled in memory.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable

from vibsim.core import private_cache

Kernel = Callable[..., None]

ENTRY = "kernel"
"""Name of the function that is called."""


def load(text: str, kinds: str, written: Callable[[], str] | None = None) -> Kernel:
    """Return the function ``kernel`` of the module `text`, compiled now or before.

    Parameters
    ----------
    kinds
        Kinds of its arguments (`vibsim.native.linking.link`).
    written
        Writes the module, where `text` is only what it is made of.

    Raises `SimulationError` where the text cannot be compiled.
    """
    # what only plans, analyses or draws needs no LLVM
    from vibsim.native.linking import identity, link

    name = hashlib.sha256("\n".join((text, kinds, identity())).encode()).hexdigest()

    def make() -> bytes:
        # what finds its kernel needs no compiler
        from vibsim.native.machine import machine_code

        module = written() if written else text
        if folder := private_cache.opened("kernels"):
            folder.put(f"{name}.py", module.encode())
        return machine_code(module, ENTRY, kinds)

    code = private_cache.cached("kernels", f"{name}.o", make, bytes, bytes)
    return link(code, ENTRY, kinds)
