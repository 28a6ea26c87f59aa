"""A number with a unit as text: taken apart by a grammar of its own, with no meaning yet.

A quantity is a constant formula and a unit behind it, ``2*pi/30 rad``. A unit consists of names with whole exponents
(``s^2``, ``s**2``, ``s2``, ``s-2``), multiplied by ``*`` or a blank and divided by ``/``. There are no parentheses,
and no blank after a ``/``: in ``J/kg K`` nobody knows where the K belongs.
"""

from __future__ import annotations

import keyword
import re
from typing import NamedTuple

from vibsim.core.errors import VibsimError
from vibsim.formula import CONSTANTS, FUNCTIONS

MAX_UNIT = 200
"""Characters of a unit."""
MAX_EXPONENT = 9

_LETTERS = "A-Za-z\u00b5\u03bc\u03a9\u2126\u00b0%"
NAME = re.compile(rf"[{_LETTERS}][{_LETTERS}_]*")
_TOKEN = re.compile(
    rf"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[{_LETTERS}][{_LETTERS}_0-9]*)|(?P<other>\S)"
)
_FACTOR = re.compile(rf"({NAME.pattern})(?:\s*(?:\^|\*\*)\s*([+-]?\d+)|([+-]?\d+))?")
_JOINT = re.compile(r"\s*(/|\*(?!\*))\s*|\s+")


class UnitError(VibsimError):
    """A unit, or a number with one, that is refused."""

    def __init__(self, rule: str, hint: str = "") -> None:
        self.rule = rule
        self.hint = hint
        super().__init__(rule, hint)

    def __str__(self) -> str:
        return f"{self.rule}: {self.hint}" if self.hint else self.rule


class Factor(NamedTuple):
    """One name of a unit."""

    name: str
    exponent: int


def split(text: str) -> tuple[str, str] | None:
    """Return the formula and the unit of `text`; None where no name follows directly on a number.

    A constant or a function of formulas is no unit there: ``2 pi`` is a formula that lacks its ``*``.
    """
    depth, ends_value = 0, False
    for found in _TOKEN.finditer(text):
        token = found.group()
        if found.lastgroup == "name" and ends_value and depth == 0:
            is_call = token in FUNCTIONS and text[found.end() :].lstrip().startswith("(")
            if token in CONSTANTS or is_call or keyword.iskeyword(token):
                return None
            return text[: found.start()].strip(), text[found.start() :].strip()
        depth += (token == "(") - (token == ")")
        ends_value = found.lastgroup != "other" or token == ")"
    return None


def factors(text: str) -> tuple[Factor, ...]:
    """Return the names of a unit with their exponents; UnitError where the text is no unit."""
    if len(text) > MAX_UNIT:
        raise UnitError(f"a unit must have at most {MAX_UNIT} characters, has {len(text)}")
    found: list[Factor] = []
    place, joint, has_divided = 0, "", False
    while True:
        match = _FACTOR.match(text, place)
        if match is None:
            raise _fault(text, place)
        exponent = int(match[2] or match[3] or 1)
        if not 0 < abs(exponent) <= MAX_EXPONENT:
            rule = f"an exponent of a unit must be -{MAX_EXPONENT} to {MAX_EXPONENT}, and not 0"
            raise UnitError(rule)
        found.append(Factor(match[1], -exponent if joint == "/" else exponent))
        place = match.end()
        if place == len(text):
            return tuple(found)
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
