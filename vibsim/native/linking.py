"""An object file in memory, ready to be called; and what its code depends on."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import Any

from llvmlite import binding

_KEPT: list[Any] = []
"""What must live as long as the code that is called."""


def link(code: bytes, name: str) -> int:
    """Load an object file and return where its function `name` stands."""
    engine = _engine()
    engine.add_object_file(binding.ObjectFileRef.from_data(code))
    engine.finalize_object()
    _KEPT.append(engine)
    return int(engine.get_function_address(name))


def _engine() -> Any:
    make_ready()
    target = binding.Target.from_default_triple().create_target_machine()
    return binding.create_mcjit_compiler(binding.parse_assembly(""), target)


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
