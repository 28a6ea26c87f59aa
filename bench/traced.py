"""The engine's sine, operation by operation, as text for C and for numba.

A comparison of bits needs the same arithmetic on both sides. The functions of `vibsim.elementary` are run on a
symbol that notes every operation; what is noted is straight-line code. Each comparison is answered as for an argument
in the range of the branch that is wanted.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from vibsim.elementary import ELEMENTARY

_HEADER = """\
/* Written by bench/traced.py from vibsim/engine/elementary. */
#include <math.h>

#define LARGEST 1e5

static inline double sine_near(double x)
{{
{near}
}}

/* Without a branch, for loops over members; not for |x| > LARGEST. */
static inline double sine_n(double x)
{{
{fast}
}}

static inline double sine(double x)
{{
    if (fabs(x) <= 0x1.921fb54442d18p+0)
        return sine_near(x);
    return fabs(x) <= LARGEST ? sine_n(x) : sin(x);
}}
"""


class Symbol:
    """A double that is not known yet; operations on it are noted in `lines`."""

    def __init__(self, name: str, lines: list[str]) -> None:
        self.name, self.lines = name, lines

    def note(self, text: str) -> Symbol:
        """Give the value of an operation a name."""
        name = f"t{len(self.lines)}"
        self.lines.append(f"{name} = {text}")
        return Symbol(name, self.lines)

    def __add__(self, other: Any) -> Symbol:
        return self.note(f"{self.name} + {_name(other)}")

    def __radd__(self, other: Any) -> Symbol:
        return self.note(f"{_name(other)} + {self.name}")

    def __sub__(self, other: Any) -> Symbol:
        return self.note(f"{self.name} - {_name(other)}")

    def __rsub__(self, other: Any) -> Symbol:
        return self.note(f"{_name(other)} - {self.name}")

    def __mul__(self, other: Any) -> Symbol:
        return self.note(f"{self.name} * {_name(other)}")

    def __rmul__(self, other: Any) -> Symbol:
        return self.note(f"{_name(other)} * {self.name}")

    def __neg__(self) -> Symbol:
        return self.note(f"-{self.name}")

    def __abs__(self) -> Symbol:
        # only comparisons ask for it, and they are answered below
        return self

    def __le__(self, other: Any) -> bool:
        return True

    def __lt__(self, other: Any) -> bool:
        return True

    def __ne__(self, other: object) -> bool:
        return True

    def __eq__(self, other: object) -> bool:
        return False

    __hash__ = None  # type: ignore[assignment]


def _name(value: Any) -> str:
    """Write a number with all its digits, in brackets where it is negative."""
    if isinstance(value, Symbol):
        return value.name
    text = repr(float(value))
    return f"({text})" if text.startswith("-") else text


def operations(function: Callable[[Any], Any]) -> list[str]:
    """Return what `function` does to x; the last line returns its value."""
    lines: list[str] = []
    value = function(Symbol("x", lines))
    return [*lines, f"return {value.name}"]


def write_header(folder: Path) -> None:
    """Write sine.h, which the loops in C include."""

    def body(function: Callable[[Any], Any]) -> str:
        lines = operations(function)
        return "\n".join(f"    {'const double ' if '=' in line else ''}{line};" for line in lines)

    found = ELEMENTARY["sin"]
    (folder / "sine.h").write_text(_HEADER.format(near=body(found.full), fast=body(found.fast)))


def fast_sine() -> Callable[[float], float]:
    """Return the sine without branches as one plain Python function, to be compiled."""
    text = "\n    ".join(["def sine(x):", *operations(ELEMENTARY["sin"].fast)])
    namespace: dict[str, Any] = {}
    exec(compile(text, "<sine>", "exec"), namespace)
    found: Callable[[float], float] = namespace["sine"]
    return found
