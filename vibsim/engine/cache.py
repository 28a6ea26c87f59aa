"""Compiled kernels on disk: machine code under the digest of the text that it was compiled from.

numba compiles a kernel once; what is kept is the object file that LLVM made of it. Loading one takes LLVM alone, 40 ms
instead of the 0.6 s that numba takes to be imported and to get ready. A file is written once and never changed: a
kernel of other text, another numba or another processor is another file. Jobs that want the same kernel at the same
time wait for the first one to compile it.
"""

from __future__ import annotations

import ctypes
import fcntl
import hashlib
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from vibsim.engine import compiler
from vibsim.engine.entry import ENTRY, bind, entry_text
from vibsim.errors import SimulationError
from vibsim.plan.versions import versions

Kernel = Callable[..., None]

_UNREACHABLE = (
    *("NRT_Free", "NRT_MemInfo_call_dtor", "NRT_decref", "NRT_incref", "NRT_Allocate"),
    *("numba_do_raise", "numba_gil_ensure", "numba_gil_release", "numba_unpickle"),
    "numba_runtime_build_excinfo_struct",
)
"""What numba's code calls where a Python exception is raised, which no kernel does."""


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
    key = "\n".join((text, kinds, versions(("numba",))["numba"], platform.python_version(), _cpu()))
    name = f"kernel_{hashlib.sha256(key.encode()).hexdigest()[:24]}"
    try:
        home = folder()
        home.mkdir(parents=True, exist_ok=True)
        path = home / f"{name}.o"
        with _lock(path.with_suffix(".lock")):
            code = _whole(path)
            if code is None:
                module = path.with_suffix(".py")
                _write(module, (text + entry_text(kinds)).encode())
                code = _compile(module)
                _write(path, code + hashlib.sha256(code).digest())
            return bind(_link(code), kinds)
    except OSError as error:
        raise SimulationError(
            f"compiled kernels cannot be kept: {error}; "
            "set VIBSIM_CACHE_DIR to a folder that can be written"
        ) from error


@cache
def _cpu() -> str:
    """Name the processor and what it can do: a folder may be shared by machines of different kinds."""
    from llvmlite import binding

    return f"{binding.get_host_cpu_name()} {binding.get_host_cpu_features().flatten()}"


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


def _compile(path: Path) -> bytes:
    """Compile the module at `path`; return what `vibsim.engine.compiler` writes."""
    command = [sys.executable, "-I", str(Path(compiler.__file__)), str(path), ENTRY]
    done = subprocess.run(command, capture_output=True, check=False)
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip()
        raise SimulationError(f"a kernel cannot be compiled ({path}):\n{said}")
    return done.stdout


_KEPT: list[Any] = []
"""What must live as long as the code that is called."""


def _link(code: bytes) -> int:
    """Load what `_compile` returned and return where its entry stands."""
    name, _, content = code.partition(b"\n")
    binding = _linker()
    target = binding.Target.from_default_triple().create_target_machine()
    engine = binding.create_mcjit_compiler(binding.parse_assembly(""), target)
    engine.add_object_file(binding.ObjectFileRef.from_data(content))
    engine.finalize_object()
    _KEPT.append(engine)
    return int(engine.get_function_address(name.decode()))


@cache
def _linker() -> Any:
    """Return LLVM, ready to load code."""
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    abort = ctypes.cast(ctypes.CDLL(None).abort, ctypes.c_void_p).value
    for name in _UNREACHABLE:
        if binding.address_of_symbol(name) is None:
            binding.add_symbol(name, abort)
    return binding


@contextmanager
def _lock(path: Path) -> Iterator[None]:
    """Hold the lock file `path`; it goes with the process, so that a killed job leaves nothing locked."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
