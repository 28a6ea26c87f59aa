"""The way into compiled code: arrays as pointers and lengths, numbers as they are.

`kinds` says what a function takes, a word for each argument: ``f3`` is an array of floats with three dimensions, ``i2``
one of integers with two, ``f`` and ``i`` are a float and an integer. Arrays are C-contiguous, of 64 bits an entry.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from typing import Any

ENTRY = "vibsim_kernel"
"""Name of the function that is called from outside."""

_TYPES = {"f": ctypes.c_double, "i": ctypes.c_int64}
_NAMES = {"f": "float64", "i": "int64"}


def entry_text(kinds: str) -> str:
    """Write the function that takes pointers and lengths and calls ``kernel`` with arrays."""
    names, types, arguments = [], [], []
    for i, kind in enumerate(kinds.split()):
        letter, dims = kind[0], int(kind[1:] or 0)
        lengths = [f"n_{i}_{d}" for d in range(dims)]
        names += [f"a_{i}", *lengths]
        types += [f"CPointer({_NAMES[letter]})" if dims else _NAMES[letter], *["int64"] * dims]
        shape = "".join(f"{length}, " for length in lengths)
        arguments.append(f"carray(a_{i}, ({shape}))" if dims else f"a_{i}")
    return (
        f'\n@cfunc("void({", ".join(types)})", error_model="numpy")\n'
        f"def {ENTRY}({', '.join(names)}):\n    kernel({', '.join(arguments)})\n"
    )


def bind(address: int, kinds: str) -> Callable[..., None]:
    """Return the code at `address` as a function of arrays and numbers; it lets go of the interpreter."""
    words = kinds.split()
    types = [t for word in words for t in _types(word)]
    code = ctypes.CFUNCTYPE(None, *types)(address)

    def call(*values: Any) -> None:
        flat: list[Any] = []
        for word, value in zip(words, values, strict=True):
            if len(word) > 1:
                flat += (_address(value), *value.shape)
            else:
                flat.append(value)
        code(*flat)

    return call


def _address(array: Any) -> int:
    """Return where the data of an array stand, the quick way where it is open."""
    try:
        return ctypes.addressof(ctypes.c_char.from_buffer(array))
    except (TypeError, ValueError):  # read-only, or empty
        return int(array.__array_interface__["data"][0])


def _types(kind: str) -> Iterator[Any]:
    dims = int(kind[1:] or 0)
    yield ctypes.c_void_p if dims else _TYPES[kind]
    for _ in range(dims):
        yield ctypes.c_int64
