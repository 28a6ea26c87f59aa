"""The loops in C: built with the compiler of the machine, as they would be by hand."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench import traced

Floats = NDArray[np.float64]

STRICT = ("-O3", "-march=native", "-ffp-contract=off")
WIDE = (*STRICT, "-mprefer-vector-width=512")
CONTRACTED = ("-O3", "-march=native", "-ffp-contract=fast")
FAST_MATH = ("-O3", "-march=native", "-ffast-math")
LIBMVEC = (*STRICT, "-fno-math-errno", "-DLIBMVEC")


class NotHereError(Exception):
    """Something that a contestant needs is not on this machine; the text says what."""


def compiler() -> str:
    """Return the name of the C compiler."""
    found = shutil.which("gcc") or shutil.which("cc")
    if found is None:
        raise NotHereError("no C compiler")
    return found


def build(source: str, folder: Path, flags: Sequence[str], *libraries: str) -> ctypes.CDLL:
    """Compile a file of this folder and load it."""
    traced.write_header(folder)
    library = folder / f"{source}_{abs(hash(tuple(flags)))}.so"
    command = [compiler(), *flags, "-shared", "-fPIC", f"-I{folder}"]
    command += [str(Path(__file__).with_name(f"{source}.c")), "-o", str(library)]
    command += [f"-l{name}" for name in libraries]
    done = subprocess.run([*command, "-lm"], capture_output=True, text=True, check=False)
    if done.returncode:
        raise NotHereError(f"{source}.c cannot be compiled: {done.stderr.strip().splitlines()[-1]}")
    return ctypes.CDLL(str(library))


def call(library: ctypes.CDLL, name: str, *arguments: Any) -> Any:
    """Call a function that takes doubles, whole numbers (long) and arrays of doubles, and returns a double."""
    function = getattr(library, name)
    function.restype = ctypes.c_double
    return function(*map(_argument, arguments))


def _argument(value: float | int | Floats) -> Any:
    if isinstance(value, np.ndarray):
        return value.ctypes.data_as(ctypes.c_void_p)
    return ctypes.c_long(value) if isinstance(value, int) else ctypes.c_double(value)


def version() -> str:
    """Return the first line of what the compiler says of itself."""
    try:
        done = subprocess.run([compiler(), "--version"], capture_output=True, text=True, check=True)
    except NotHereError as error:
        return str(error)
    return done.stdout.splitlines()[0]
