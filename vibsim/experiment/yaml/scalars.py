"""Plain YAML scalars by the core schema of YAML 1.2.

`1e-3`, `1.`, `.5` and `1E5` are numbers; `yes`, `no`, `on`, `off`, `1_000` and `1:30` are text; `0o10` is 8 and `0x10`
is 16. `010`, which is 10 there and 8 in YAML 1.1, is refused (`is_ambiguous`).
Source: YAML 1.2.2 (2021), section 10.3.2.
"""

from __future__ import annotations

import re

Scalar = str | int | float | bool | None

MAX_DIGITS = 1000
"""Whole numbers of more digits are read as floats, i.e. as infinity, which is then refused."""

_NULL = frozenset({"", "~", "null", "Null", "NULL"})
_TRUE = frozenset({"true", "True", "TRUE"})
_FALSE = frozenset({"false", "False", "FALSE"})
_INTEGER = re.compile(r"[-+]?[0-9]+")
_ZERO = re.compile(r"[-+]?0[0-9]")
_OCTAL = re.compile(r"0o[0-7]+")
_HEXADECIMAL = re.compile(r"0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INFINITY = re.compile(r"[-+]?\.(inf|Inf|INF)")
_NAN = frozenset({".nan", ".NaN", ".NAN"})


def is_ambiguous(text: str) -> bool:
    """Tell whether a plain scalar is a number that begins with a needless 0."""
    return _ZERO.match(text) is not None and isinstance(resolve(text), int | float)


def resolve(text: str) -> Scalar:
    """Return the value of a plain (unquoted) scalar."""
    if text in _NULL:
        return None
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    if _INTEGER.fullmatch(text):
        return int(text) if len(text) <= MAX_DIGITS else float(text)
    if len(text) <= MAX_DIGITS and _OCTAL.fullmatch(text):
        return int(text[2:], 8)
    if len(text) <= MAX_DIGITS and _HEXADECIMAL.fullmatch(text):
        return int(text[2:], 16)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _INFINITY.fullmatch(text):
        return float("-inf" if text[0] == "-" else "inf")
    return float("nan") if text in _NAN else text
