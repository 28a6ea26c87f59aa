"""An object file in memory, ready to be called; and what its code depends on."""

from __future__ import annotations

import ctypes
import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from llvmlite import binding

_TYPES = {"f": ctypes.c_double, "i": ctypes.c_int64}
_KEPT: list[Any] = []
"""What must live as long as the code that is called."""


def link(code: bytes, name: str, kinds: str) -> Callable[..., None]:
    """Load an object file and return its function `name`, which lets go of the interpreter.

    It takes numbers as they are, and arrays, C-contiguous with 64 bits an entry, as pointers and lengths.

    Parameters
    ----------
    kinds
        What it takes, as `vibsim.native.machine.machine_code` has it.
    """
    make_ready()
    target = binding.Target.from_default_triple().create_target_machine()
    engine = binding.create_mcjit_compiler(binding.parse_assembly(""), target)
    engine.add_object_file(binding.ObjectFileRef.from_data(code))
    engine.finalize_object()
    _KEPT.append(engine)
    dims = [int(word[1:] or 0) for word in kinds.split()]
    types: list[Any] = []
    for word, of_array in zip(kinds.split(), dims, strict=True):
        types += [ctypes.c_void_p] + [ctypes.c_int64] * of_array if of_array else [_TYPES[word]]
    function = ctypes.CFUNCTYPE(None, *types)(engine.get_function_address(name))

    def call(*values: Any) -> None:
        flat: list[Any] = []
        for of_array, value in zip(dims, values, strict=True):
            if of_array:
                flat.append(_address(value))
                flat.extend(value.shape)
            else:
                flat.append(value)
        function(*flat)

    return call


def _address(array: Any) -> int:
    """Return where the data of an array stand, the quick way where it is open."""
    try:
        return ctypes.addressof(ctypes.c_char.from_buffer(array))
    except (TypeError, ValueError):  # read-only, or empty
        return int(array.__array_interface__["data"][0])


@cache
def make_ready() -> None:
    """Make LLVM ready for this machine."""
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()


@cache
def identity() -> str:
    """Say what machine code depends on beside its text: the processor and what it can do, LLVM, and this compiler."""
    make_ready()
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(file.read_bytes())
    features = binding.get_host_cpu_features().flatten()
    llvm = ".".join(map(str, binding.llvm_version_info))
    return f"{binding.get_host_cpu_name()} {features} LLVM {llvm} {digest.hexdigest()}"
