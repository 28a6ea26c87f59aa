"""The grammar of a number with a unit: split into formula and unit names, which are not interpreted here.

A quantity is a constant formula followed by a unit, ``2*pi/30 rad``. A unit consists of names with integer exponents
(``s^2``, ``s**2``, ``s2``, ``s-2``), multiplied by ``*`` or a blank and divided by ``/``. There are no parentheses,
and no blank may follow a ``/``, because ``J/kg K`` is ambiguous.
"""

from __future__ import annotations

import keyword
import re
from typing import NamedTuple

from vibsim.core.errors import VibsimError
from vibsim.formula import CONSTANTS, FUNCTIONS

MAX_UNIT = 200  # largest number of characters of a unit
MAX_EXPONENT = 9

_LETTERS = "A-Za-z\u00b5\u03bc\u03a9\u2126\u00b0%"
NAME = re.compile(rf"[{_LETTERS}][{_LETTERS}_]*")
_TOKEN = re.compile(
    rf"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[{_LETTERS}][{_LETTERS}_0-9]*)|(?P<other>\S)"
)
_FACTOR = re.compile(rf"({NAME.pattern})(?:\s*(?:\^|\*\*)\s*([+-]?\d+)|([+-]?\d+))?")
_JOINT = re.compile(r"\s*(/|\*(?!\*))\s*|\s+")


class UnitError(VibsimError):
    """An invalid unit, or an invalid number with a unit."""

    def __init__(self, rule: str, hint: str = "") -> None:
        self.rule = rule
        self.hint = hint
        super().__init__(rule, hint)

    def __str__(self) -> str:
        return f"{self.rule}: {self.hint}" if self.hint else self.rule


class Factor(NamedTuple):
    """A factor of a unit: name and exponent."""

    name: str
    exponent: int


def split(text: str) -> tuple[str, str] | None:
    """Return the formula and the unit of `text`; None if no name directly follows a number.

    Constants and functions of formulas are not units: ``2 pi`` is a formula with a missing ``*``.
    """
    depth, ends_value = 0, False
    for match in _TOKEN.finditer(text):
        token = match.group()
        if match.lastgroup == "name" and ends_value and depth == 0:
            is_call = token in FUNCTIONS and text[match.end() :].lstrip().startswith("(")
            if token in CONSTANTS or is_call or keyword.iskeyword(token):
                return None
            return text[: match.start()].strip(), text[match.start() :].strip()
        depth += (token == "(") - (token == ")")
        ends_value = match.lastgroup != "other" or token == ")"
    return None


def factors(text: str) -> tuple[Factor, ...]:
    """Return the factors of a unit; raise `UnitError` if the text is not a unit."""
    if len(text) > MAX_UNIT:
        raise UnitError(f"a unit must have at most {MAX_UNIT} characters, has {len(text)}")
    result: list[Factor] = []
    place, joint, has_divided = 0, "", False
    while True:
        match = _FACTOR.match(text, place)
        if match is None:
            raise _fault(text, place)
        exponent = int(match[2] or match[3] or 1)
        if not 0 < abs(exponent) <= MAX_EXPONENT:
            rule = f"an exponent of a unit must be -{MAX_EXPONENT} to {MAX_EXPONENT}, and not 0"
            raise UnitError(rule)
        result.append(Factor(match[1], -exponent if joint == "/" else exponent))
        place = match.end()
        if place == len(text):
            return tuple(result)
        between = _JOINT.match(text, place)
        if between is None:
            raise _fault(text, place)
        joint, place = between[1] or " ", between.end()
        if joint == " " and has_divided:
            hint = "write * or / between all names, or exponents: kg-1"
            raise UnitError("a unit must not have a blank after a '/'", hint)
        has_divided |= joint == "/"


def _fault(text: str, place: int) -> UnitError:
    rule = "a unit consists of names with whole exponents, * and /"
    if place >= len(text):
        return UnitError(f"{rule}; a name must follow at its end")
    return UnitError(f"{rule}, not of {text[place]!r}", "e.g. m/s^2 or m s-2")
