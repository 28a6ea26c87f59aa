"""Cache of compiled kernels on disk, named by the digest of their text.

An entry is an object file, with its text beside it for human readers. Files are never changed: another text, compiler
or processor makes another file. Loading an object file executes it, so they are kept only in the private cache
(`vibsim.core.private_cache`); without one, kernels are compiled in memory.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable

from vibsim.core import private_cache

Kernel = Callable[..., None]

ENTRY = "kernel"
"""Name of the entry point."""


def load(text: str, kinds: str, written: Callable[[], str] | None = None) -> Kernel:
    """Return the function ``kernel`` of the module `text`, compiled or from the cache.

    Parameters
    ----------
    kinds
        Types of its arguments (`vibsim.native.linking.link`).
    written
        Function that returns the text of the module, if `text` only identifies it.

    Raises `SimulationError` if the text cannot be compiled.
    """
    # imported late: planning, analysis and drawing need no LLVM
    from vibsim.native.linking import identity, link

    name = hashlib.sha256("\n".join((text, kinds, identity())).encode()).hexdigest()

    def make() -> bytes:
        # imported late: a cached kernel needs no compiler
        from vibsim.native.machine import machine_code

        module = written() if written else text
        if folder := private_cache.opened("kernels"):
            folder.put(f"{name}.py", module.encode())
        return machine_code(module, ENTRY, kinds)

    code = private_cache.cached("kernels", f"{name}.o", make, bytes, bytes)
    return link(code, ENTRY, kinds)
