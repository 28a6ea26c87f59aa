"""The way into compiled code: arrays as pointers and lengths, numbers as they are.

`kinds` says what a function takes, a word for each argument (`vibsim.native`). Arrays are C-contiguous, of
64 bits an entry.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from typing import Any

_TYPES = {"f": ctypes.c_double, "i": ctypes.c_int64}


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
