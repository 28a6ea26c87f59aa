"""Fast and full, plain and compiled: the same bits; and vector instructions from the fast ones."""

import math
import re

import numpy as np
import pytest
from elementary_arguments import arguments
from thinned import thinned

from vibsim.elementary import ELEMENTARY, primitives
from vibsim.engine import text
from vibsim.native.linking import link
from vibsim.native.machine import machine_code, optimised

LOOP = """
@entry
def loop({columns}, values):
    for i in range(values.shape[0]):
        values[i] = function({entries})
"""

REDUCED = 1e5
STATED = {
    "atan2": lambda y, x: (abs(y) > 1e-99 * abs(x)) & np.isfinite(y) & np.isfinite(x),
    "cos": lambda x: abs(x) <= REDUCED,
    "mod": lambda x, y: (
        (abs(x) <= 1e15 * np.fmin(abs(y), 1e270)) & (abs(y) >= 1e-270) & (abs(y) <= 1e270)
    ),
    "power": lambda x, y: np.isfinite(x) & (x > 0.0) & (abs(y) <= 1e9),
    "sin": lambda x: abs(x) <= REDUCED,
    "tan": lambda x: abs(x) <= REDUCED,
}
"""Where a fast function promises its value; the others do so everywhere."""


def compiled(function, count):
    """Return the text of a loop over `function` of `count` arguments, out of what a kernel would hold."""
    module = text.Module("", given=primitives.NAMES)
    text.collect(module, function, "function", {})
    return loop_over(module.text, count)


def loop_over(definition, count):
    names = [f"x_{i}" for i in range(count)]
    loop = LOOP.format(columns=", ".join(names), entries=", ".join(f"{n}[i]" for n in names))
    return definition + loop, "f1 " * (count + 1)


def run(loop, columns):
    text, kinds = loop
    values = np.empty(len(columns[0]))
    link(machine_code(text, "loop", kinds), "loop", kinds)(*columns, values)
    return values


def plain(function, columns):
    return np.array([function(*row) for row in zip(*map(np.ndarray.tolist, columns), strict=True)])


def same(a, b):
    return (a.view(np.int64) == b.view(np.int64)) | (np.isnan(a) & np.isnan(b))


@pytest.mark.parametrize("count", [1_000, pytest.param(20_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", thinned(ELEMENTARY, 3))
def test_fast_and_full_plain_and_compiled(name, count):
    columns = arguments(name, count)
    function = ELEMENTARY[name]
    full = plain(function.full, columns)
    fast = plain(function.fast, columns) if function.fast is not function.full else full
    full_loop, fast_loop = (compiled(f, len(columns)) for f in (function.full, function.fast))
    assert same(run(full_loop, columns), full).all()
    assert same(run(fast_loop, columns), fast).all()
    assert (same(fast, full) | np.isnan(fast)).all()
    promised = STATED[name](*columns) if name in STATED else True
    assert not (np.isnan(fast) & ~np.isnan(full) & promised).any()
    assert_loop_is_vectors(fast_loop)


def assert_loop_is_vectors(loop):
    """The loop that LLVM made from it has a body on vectors of doubles, and calls nothing outside."""
    text, kinds = loop
    code = str(optimised(text, "loop", kinds))
    body = re.search(r"^vector\.body.*?(?=^\S+:\s)", code, re.MULTILINE | re.DOTALL)
    assert body, "the loop was not vectorised"
    assert re.search(r"store <\d+ x double>", body.group())
    called = re.findall(r"call .*?@([\w.]+)", body.group())
    assert all(target.startswith("llvm.") for target in called), called


@pytest.mark.parametrize("name", ELEMENTARY)
def test_nan_in_is_nan_out_of_a_fast_function(name):
    fast = ELEMENTARY[name].fast
    count = len(arguments(name, 100))
    for i in range(1 if name == "where" else count):
        row = [1.5] * count
        row[i] = math.nan
        assert math.isnan(fast(*row))


def test_primitives_of_both_lanes_agree():
    (sizes,) = arguments("sqrt", 20_000)
    sizes = sizes[(sizes >= np.finfo(float).tiny) & np.isfinite(sizes)]
    stated = dict.fromkeys(primitives.NAMES, sizes) | {"two_to": np.arange(-1022.0, 1024.0)}
    for name, column in stated.items():
        function = f"@compiled\ndef function(x):\n    return {name}(x)\n"
        values = run(loop_over(function, 1), (column,))
        assert same(values, plain(getattr(primitives, name), (column,))).all()


@pytest.mark.parametrize("is_called", [False, True])
def test_all_functions_fit_into_one_kernel(is_called):
    module = text.Module("", given=primitives.NAMES)
    for name, function in ELEMENTARY.items():
        text.collect(module, function.full, name, {}, is_called=is_called)
        text.collect(module, function.fast, f"{name}_fast", {})
    assert {*ELEMENTARY, *(f"{name}_fast" for name in ELEMENTARY)} <= set(module.parts)


def test_a_loop_with_branches_is_no_vectors():
    loop = compiled(ELEMENTARY["sin"].full, 1)
    with pytest.raises(AssertionError, match="not vectorised"):
        assert_loop_is_vectors(loop)
