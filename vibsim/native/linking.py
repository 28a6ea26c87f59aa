"""Loading of object files as callable functions, and the identity of the compiler and processor."""

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
"""Engines that must live as long as their code may be called."""


def link(code: bytes, name: str, kinds: str) -> Callable[..., None]:
    """Load an object file and return its function `name`, which releases the GIL.

    The function takes numbers, and C-contiguous arrays with 64-bit entries.

    Parameters
    ----------
    kinds
        Types of its arguments, as in `vibsim.native.machine.machine_code`.
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
    """Return the address of the data of an array."""
    try:
        return ctypes.addressof(ctypes.c_char.from_buffer(array))
    except (TypeError, ValueError):  # read-only, or empty
        return int(array.__array_interface__["data"][0])


@cache
def make_ready() -> None:
    """Initialise LLVM for this machine."""
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()


@cache
def identity() -> str:
    """Return everything that machine code depends on except its text: processor and features, LLVM, this compiler."""
    make_ready()
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(file.read_bytes())
    features = binding.get_host_cpu_features().flatten()
    llvm = ".".join(map(str, binding.llvm_version_info))
    return f"{binding.get_host_cpu_name()} {features} LLVM {llvm} {digest.hexdigest()}"
