"""Compiled text against the same text in Python: the same bits, and clear words where it cannot be compiled."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from vibsim.elementary import primitives
from vibsim.native.linking import identity, link
from vibsim.native.machine import machine_code
from vibsim.native.source import NativeError
from vibsim.schemes.step_numbers import vector

PLAIN = {"compiled": lambda f: f, "called": lambda f: f, "entry": lambda f: f}
PLAIN |= {name: getattr(primitives, name) for name in primitives.NAMES} | {
    "math": math,
    "vector": vector,
}

FLOATS = [0.0, -0.0, 1.0, -1.5, 2.5, -7.25, 1e300, -1e-300, 0.1, 1 / 3, math.pi, math.inf, math.nan]
WHOLES = [0, 1, -1, 2, 7, -7, 12, 2**40 + 3, -(2**40) - 5]


def compiled(text: str, kinds: str):
    return link(machine_code(text, "entry_point", kinds), "entry_point", kinds)


def plain(text: str):
    scope = dict(PLAIN)
    exec(text, scope)
    return scope["entry_point"]


def same(a: np.ndarray, b: np.ndarray) -> bool:
    assert a.dtype == b.dtype
    bits = a.view(np.int64) == b.view(np.int64)
    # of what kind a NaN is, no one promises
    return bool((bits | (np.isnan(a) & np.isnan(b) if a.dtype == float else bits)).all())


def both(body: str, head: str = "", *, floats=FLOATS, wholes=WHOLES) -> None:
    """Run the statements `body` on x, y (floats), i, j (whole numbers), f (floats) and w (whole numbers) both ways."""
    lines = "\n".join(f"    {line}" for line in body.strip().splitlines())
    text = f"{head}\n@entry\ndef entry_point(x, y, i, j, f, w):\n{lines}\n"
    fast, slow = compiled(text, "f f i i f2 i1"), plain(text)
    choice = random.Random(3)
    for _ in range(60):
        numbers = (
            *(choice.choice(floats) for _ in range(2)),
            *(choice.choice(wholes) for _ in range(2)),
        )
        given = np.arange(12.0).reshape(3, 4), np.arange(5)
        found, wanted = ([array.copy() for array in given] for _ in range(2))
        fast(*numbers, *found)
        slow(*numbers, *wanted)
        for a, b in zip(found, wanted, strict=True):
            assert same(a, b), (numbers, a, b)


SAFE = [value for value in FLOATS if value != 0.0 and math.isfinite(value)]
SMALL = [value for value in WHOLES if value != 0]

SNIPPETS = {
    "arithmetic, rounded after every operation": """
f[0, 0] = x * y + x
f[0, 1] = x - y - x * (y + 0.1)
""",
    "minus, and minus zero": """
f[0, 0] = -x
f[0, 1] = 0.0 - x
w[0] = -i
""",
    "absolute values": """
f[0, 0] = abs(x)
f[0, 1] = math.fabs(y)
w[0] = abs(i)
""",
    "the smaller and the larger": """
f[0, 0] = min(x, y)
f[0, 1] = max(x, y, 1.0)
w[0] = min(i, j)
f[0, 2] = max(i, x)
""",
    "roots, signs": """
f[0, 0] = math.sqrt(abs(x))
f[0, 1] = math.copysign(x, y)
""",
    "whole numbers": """
w[0] = i + 3 * j - (i & 12) + (j | 3)
w[1] = i >> 3
w[2] = (i & 7) << 4
""",
    "comparisons": """
w[0] = (x < y) + 2 * (x <= y) + 4 * (x == y) + 8 * (x != y) + 16 * (i > j) + 32 * (x >= i)
""",
    "chained comparisons": """
w[0] = 1 if 0.0 < x <= y < 3.0 else 2
w[1] = -1 < i < j
""",
    "and, or, not": """
w[0] = 1 if x > 0.0 and not y > 0.0 or i == j else 0
w[1] = not i
""",
    "what stands behind and is left alone": """
if i < 5 and i >= 0 and w[i] > 1:
    w[i] = 100
if i < 0 or i > 4 or w[i] == 0:
    w[1] = 7
""",
    "one of two": "f[0, 0] = x if x > y else 1.0 / (abs(y) + 1.0) if x == y else i",
    "a whole number that becomes a float": """
a = 0
if x > 0.0:
    a = x
f[0, 0] = a
a = i
f[0, 1] = a / 4
""",
    "branches": """
if x > 1.0:
    f[0, 0] = 1.0
elif y > 1.0:
    f[0, 0] = 2.0
else:
    f[0, 0] = 3.0
f[0, 1] = 4.0
""",
    "an early return": """
f[0, 0] = x
if i > 0:
    return
f[0, 1] = y
""",
    "loops": """
s = 0.0
for k in range(4):
    for m in range(1, 3):
        s += k * x + m
f[0, 0] = s
w[0] = k + 10 * m
""",
    "backwards": """
s = 0
for k in range(9, 0, -2):
    s = 10 * s + k
w[0] = s
""",
    "a loop over nothing": """
k = 77
for k in range(3, 3):
    w[0] = 1
w[1] = k
""",
    "a loop whose variable is changed": """
s = 0
for k in range(5):
    s += k
    k = 100
w[0] = s + k
""",
    "break": """
s = 0
for k in range(10):
    if k > 6:
        break
    s += k
w[0] = s
""",
    "while": """
a = abs(i) & 1023
n = 0
while a > 0:
    a >>= 1
    n += 1
w[0] = n
""",
    "tuples": """
a, (b, c) = (x, (y, i))
a, b = (b, a)
f[0, 0] = a
f[0, 1] = b
t = (a, b, c)
f[0, 2] = t[2]
f[0, 3] = t[-2]
""",
    "one of several, found at run time": """
t = (x, y, 3.0)
f[0, 0] = t[w[1] + 1]
for k in range(3):
    f[1, k] = t[k] + TABLE[k]
""",
    "arrays": """
f[1, w[2]] += x
f[2, 3] = f[1, 2] + f[0, 1]
w[3] -= 7
w[4] = f.shape[0] * 100 + f.shape[1]
f[0, 0] = w.shape[0]
""",
    "part of a row": """
row = f[1, 2:]
f[0, 0] = row[0] + row[1] * 10.0 + row.shape[0]
""",
    "several at once": """
a = b = x
a += 1.0
f[0, 0] = a
f[0, 1] = b
""",
    "functions": """
a, b = pair(x, 2)
f[0, 0] = a
f[0, 1] = b
a, b = pair(i, 0.5)
f[1, 0] = a
f[1, 1] = b
put(f, y)
f[0, 2] = far(x, y)
""",
    "numbers of the module": """
f[0, 0] = HALF * x + DEEP[1][0]
if CHOSEN:
    f[0, 1] = 5.0
else:
    f[0, 1] = undefined + 1.0
""",
    "turned into each other": """
w[0] = int(x > y)
f[0, 0] = float(i)
f[0, 1] = float(x > y)
f[0, 2] = (not i) + (not x)
""",
}

HEAD = """
HALF = 0.5
CHOSEN = True
TABLE = (10, 20, 30)
DEEP = ((1.0, 2.0), (3.5, 4))

@compiled
def pair(a, b):
    if a > b:
        return (a * b, b)
    return (b, a - b)

@compiled
def put(array, value):
    array[2, 2] = value

@called
def far(a, b):
    if a < b:
        return a
    return 2.0 * b
"""


@pytest.mark.parametrize("name", SNIPPETS)
def test_compiled_text_does_what_python_does(name: str) -> None:
    both(SNIPPETS[name], HEAD)


def test_division_rounds_down_as_in_python() -> None:
    both("w[0] = i // j\nw[1] = i % j\nf[0, 0] = i / j\nf[0, 1] = x / y", floats=SAFE, wholes=SMALL)
    both("w[0] = math.floor(x / 1e300)\nw[1] = int(x / 1e299)", floats=SAFE)


def test_parts_of_doubles() -> None:
    sizes = [2.0**-1022, 1.0, 1.5, 3.0, math.pi * 1e200, np.nextafter(2.0, 0.0)]
    both(
        "f[0, 0] = exponent_of(x)\nf[0, 1] = mantissa_of(x)\nf[0, 2] = two_to(float(i))",
        floats=sizes,
        wholes=[-1022, 0, 5, 1023],
    )


def test_tuples_of_floats_are_vectors() -> None:
    both(
        """
a, b = vector(x, y), vector(y, 0.5)
for k in range(2):
    f[0, k] = (a + b)[k]
    f[1, k] = (-(x * a - b * y) / 3.0)[k]
f[2, 0] = abs(a - b)
f[2, 1] = (SHIFT + (a if x < y else SHIFT))[1]
""",
        head="SHIFT = vector(0.25, 1.5)",
    )


def test_division_by_zero_is_no_error() -> None:
    text = "@entry\ndef entry_point(x, f):\n    f[0] = 1.0 / x\n    f[1] = x / x\n    f[2] = -1.0 / x\n"
    found = np.empty(3)
    compiled(text, "f f1")(0.0, found)
    assert found.tolist()[::2] == [math.inf, -math.inf]
    assert math.isnan(found[1])


FORMS = [
    *("({a} + {b})", "({a} - {b})", "({a} * {b})", "-({a})", "abs({a})", "min({a}, {b})"),
    *("max({a}, {b}, {c})", "({a} if {b} < {c} else {a} * 0.5)", "float({a} < {b} <= {c})"),
    *("math.sqrt(abs({a}))", "(1.0 if {a} > 0.0 and {b} < 1.0 or not {c} else {b})"),
    "math.copysign({a}, {b})",
]


def expression(choice: random.Random, depth: int) -> str:
    """Return an expression at random over floats: a whole number knows no minus zero."""
    if depth == 0:
        return choice.choice(
            ["x", "y", "float(i)", "0.1", "3.0", "-2.5", "x*x", "float(x < y)", "HALF"]
        )
    a, b, c = (expression(choice, depth - 1) for _ in range(3))
    form = choice.choice(FORMS)
    return form.format(a=a, b=b, c=c)


@pytest.mark.slow
def test_expressions_at_random_have_the_bits_of_python() -> None:
    choice = random.Random(11)
    small = [value for value in WHOLES if abs(value) < 20]
    finite = [value for value in FLOATS if abs(value) < 1e9]
    for _ in range(12):
        lines = [f"f[{k // 4}, {k % 4}] = {expression(choice, 3)}" for k in range(12)]
        both("\n".join(lines), HEAD, floats=finite, wholes=small)


def test_products_are_not_contracted_and_sums_not_reordered() -> None:
    text = """
@entry
def entry_point(a, f):
    s = 0.0
    for k in range(a.shape[0]):
        s += a[k] * a[k]
    f[0] = s
"""
    a = np.random.default_rng(0).standard_normal(1001) * np.logspace(9, -9, 1001)
    found = np.empty(1)
    compiled(text, "f1 f1")(a, found)
    wanted = 0.0
    for value in a.tolist():
        wanted += value * value
    assert found[0] == wanted


REFUSED = {
    "a, b = x": "it cannot hold a float",
    "f[0, 0] = unknown": "this cannot be compiled",
    "f[0, 0] = unknown(x)": "there is no function unknown; there are abs, ",
    "f[0] = x": "as many whole numbers as it has dimensions",
    "f[0, x] = y": "as many whole numbers as it has dimensions",
    "f[0, 0] = x[1]": "a float has no entries",
    "f[0, 0] = (x, y)[2]": "there are 2 entries",
    "f[0, 0] = (x, y)": "only an entry of an array can be given a number",
    "f[0, 0] = x // y": "have no such operation",
    "f[0, 0] = x ** 2": "have no such operation",
    "f[0, 0] = ~i": "has no such operation",
    "f[0, 0] = math.sqrt(x, y)": "math.sqrt takes 1 number",
    "f[0, 0] = abs(f)": "abs takes 1 number",
    "f[0, 0] = abs()": "abs takes 1 number",
    "f[0, 0] = max()": "max takes some numbers",
    "f[0, 0] = pair(x)": "it takes 2 arguments, not 1",
    "f[0, 0] = pair(a=x, b=y)": "by their places alone",
    "a = x\na = (x, y)": "it would be a float here and a",
    "for k in w:\n    i += 1": "there is no such statement",
    "for k in pair(x, y):\n    i += 1": "a loop goes over a range",
    "for k in range(0, 3, i):\n    i += 1": "the step of a range",
    "for k in range(x):\n    i += 1": "a range is between whole numbers",
    "with f:\n    pass": "there is no such statement",
    "f[0, 0] = ends(x)": "it can end without a result",
    "f[0, 0] = 'word'": "this cannot be compiled",
    "f[0, 0] = again(x)": "a function cannot call itself",
    "f[0, 0] = (lambda: x)()": "there is no function",
}

ENDS = """
@compiled
def ends(a):
    if a > 0.0:
        return a

@called
def again(a):
    return again(a)
"""


@pytest.mark.parametrize("body", REFUSED)
def test_what_cannot_be_compiled_is_refused_with_its_line(body: str) -> None:
    lines = "\n".join(f"    {line}" for line in body.splitlines())
    text = f"{HEAD}{ENDS}\n@entry\ndef entry_point(x, y, i, j, f, w):\n{lines}\n"
    with pytest.raises(NativeError) as raised:
        machine_code(text, "entry_point", "f f i i f2 i1")
    message = str(raised.value)
    assert REFUSED[body] in message
    assert message.startswith("line ")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("import os\n", "functions and numbers alone"),
        ("x = y = 1\n", "functions and numbers alone"),
        ("def entry_point(f):\n    pass\n", "marked as one of compiled, called, entry"),
        ("@entry\ndef entry_point(f=1):\n    pass\n", "by their places alone"),
    ],
)
def test_a_module_of_something_else_is_refused(text: str, why: str) -> None:
    with pytest.raises(NativeError, match=why):
        machine_code(text, "entry_point", "f")


def test_the_same_text_gives_the_same_code() -> None:
    text = HEAD + "\n@entry\ndef entry_point(f):\n    put(f, far(1.0, 2.0))\n"
    assert machine_code(text, "entry_point", "f2") == machine_code(text, "entry_point", "f2")
    assert "LLVM" in identity()


def test_a_function_named_as_one_of_the_c_library_is_not_taken_for_it() -> None:
    names = ("round", "floor", "sin", "exp", "sqrt", "fabs", "pow", "memset", "fmod", "hypot")
    head = "".join(f"@called\ndef {name}(a, b):\n    return a * 3.0 + b\n\n" for name in names)
    both("\n".join(f"f[{k // 4}, {k % 4}] = {name}(x, y)" for k, name in enumerate(names)), head)
    head = "".join(f"@called\ndef {name}(a):\n    return a * 3.0\n\n" for name in names)
    both("\n".join(f"f[{k // 4}, {k % 4}] = {name}(x)" for k, name in enumerate(names)), head)
