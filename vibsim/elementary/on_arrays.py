"""The elementary functions on arrays, with the same bits on every machine, for numbers that are stored.

The functions of numpy and the C library differ in the last digit between processors. Here the functions of this package
are compiled, one kernel each: a branch-free loop, which LLVM vectorises, then a loop over entries for which the first
gave NaN.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.elementary import (
    ELEMENTARY,
    circular,
    doubled,
    error_function,
    exact,
    exponential,
    hyperbolic,
    inverse,
)
from vibsim.native.kernel_cache import Kernel, load

_TEXTS = (circular, doubled, error_function, exact, exponential, hyperbolic, inverse)
MOST_PLAIN = 20_000
"""Number of values that take as long in plain Python as loading LLVM, which also takes 60 MB. [measured]"""
_PLAIN = {"numbers": 0}
"""Number of values computed in plain Python by this process."""
_NUMBERS = (int, float)
_LOOP = """
@entry
def kernel({names}, found):
    for i in range(found.shape[0]):
        found[i] = {fast}({entries})
    for i in range(found.shape[0]):
        if found[i] != found[i]:
            found[i] = {full}({entries})
"""


def _is_plain(count: int) -> bool:
    """Tell whether `count` more values are computed in plain Python, with the same bits, because LLVM is not loaded."""
    if "llvmlite" in sys.modules:
        return False
    _PLAIN["numbers"] += count
    return _PLAIN["numbers"] <= MOST_PLAIN


def named(name: str) -> Callable[..., Any]:
    """Return a function of `vibsim.elementary.ELEMENTARY` for numbers and arrays, which broadcast."""
    full = ELEMENTARY[name].full

    def function(*arguments: Any) -> Any:
        if all(isinstance(x, _NUMBERS) for x in arguments):
            # a numpy number, whose division by zero does not raise
            return np.float64(full(*map(float, arguments)))
        arrays = [np.asarray(x, dtype=np.float64, order="C") for x in arguments]
        if len(arrays) > 1:
            arrays = _of_one_shape(arrays)
        found = np.empty(arrays[0].shape)
        flat = found.reshape(-1)
        if _is_plain(found.size):
            rows = zip(*(x.ravel().tolist() for x in arrays), strict=True)
            flat[:] = [full(*row) for row in rows]
        else:
            _kernel(name)(*[x.reshape(-1) for x in arrays], flat)
        return found[()]

    return function


def _of_one_shape(arrays: list[Floats]) -> list[Floats]:
    """Return arrays that broadcast as contiguous arrays of one shape."""
    shape = np.broadcast(*arrays).shape
    result = []
    for array in arrays:
        if array.shape != shape:
            # for small arrays several times as fast as `np.broadcast_to`
            array, source = np.empty(shape), array
            array[...] = source
        result.append(array)
    return result


acos, asin, atan, atan2, cos, sin, tan = map(
    named, ("acos", "asin", "atan", "atan2", "cos", "sin", "tan")
)
cosh, sinh, tanh, hypot, power = map(named, ("cosh", "sinh", "tanh", "hypot", "power"))
exp, expm1, log, log1p, log2, log10 = map(named, ("exp", "expm1", "log", "log1p", "log2", "log10"))
LN_2 = exponential.log(2.0)


def complex_of(real: Any, imaginary: Any) -> Any:
    """Return complex numbers with these parts, which may be infinite."""
    found = np.empty(np.broadcast_shapes(np.shape(real), np.shape(imaginary)), dtype=complex)
    found.real, found.imag = real, imaginary
    return found[()]


def complex_product(a: Any, b: Any) -> Any:
    """Return the product of complex numbers; numpy's uses fused operations on some processors."""
    x, y, u, v = np.real(a), np.imag(a), np.real(b), np.imag(b)
    return complex_of(x * u - y * v, x * v + y * u)


def complex_exp(z: Any) -> Any:
    """Return ``e^z`` of complex numbers."""
    size, angle = exp(np.real(z)), np.imag(z)
    return complex_of(size * cos(angle), size * sin(angle))


def complex_expm1(z: Any) -> Any:
    """Return ``e^z - 1`` of complex numbers, without cancellation near 0."""
    x, angle = np.real(z), np.imag(z)
    half = sin(0.5 * angle)
    return complex_of(expm1(x) * cos(angle) - 2.0 * half * half, exp(x) * sin(angle))


def complex_size(z: Any) -> Any:
    """Return the absolute value of complex numbers."""
    return hypot(np.real(z), np.imag(z))


@cache
def _kernel(name: str) -> Kernel:
    """Return the function that fills an array with values."""
    function = ELEMENTARY[name]
    names = function.full.__code__.co_varnames[: function.full.__code__.co_argcount]
    loop = _LOOP.format(
        names=", ".join(names),
        entries=", ".join(f"{x}[i]" for x in names),
        fast=function.fast.__name__,
        full=function.full.__name__,
    )
    # the module is only written if it is not cached, because writing takes longer than loading
    return load(_texts() + loop, "f1 " * (len(names) + 1), lambda: _module() + loop)


@cache
def _texts() -> str:
    """Return the source files of all functions, joined."""
    return "\n".join(Path(str(module.__file__)).read_text(encoding="utf-8") for module in _TEXTS)


@cache
def _module() -> str:
    """Return all functions as the text of a module that can be compiled."""
    constants = {
        name: value
        for module in _TEXTS
        for name, value in vars(module).items()
        if isinstance(value, int | float | tuple) and not name.startswith("__")
    }
    parts = [f"{name} = {value!r}" for name, value in constants.items()]
    functions = (x for x in ast.parse(_texts()).body if isinstance(x, ast.FunctionDef))
    return "\n".join(["import math", *parts, *map(_plain, functions)])


def _plain(function: ast.FunctionDef) -> str:
    """Return the text of a function without docstring and annotations, with the decorator for its compilation."""
    has_loop = any(isinstance(node, ast.For | ast.While) for node in ast.walk(function))
    function.body, function.returns = function.body[1:], None
    for argument in function.args.args:
        argument.annotation = None
    return f"@{'called' if has_loop else 'compiled'}\n{ast.unparse(function)}"
