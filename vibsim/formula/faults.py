"""What is wrong with a formula, where, and what to write instead."""

from __future__ import annotations

import ast
import re

from vibsim.core.errors import VibsimError

MAX_DEPTH = 100
TOO_DEEP = f"must not nest deeper than {MAX_DEPTH} operations"
_JOINED = re.compile(r"(?<![A-Za-z0-9_.])(\d+\.?\d*|\.\d+)(?=[A-Za-z_])(?![eE][+-]?\d)")
"""A number that runs into a name: a forgotten ``*``."""
_UNFINISHED = re.compile(r"([+\-*/<>=!,(]|\b(and|or|not|if|else))$")
INSTEAD = {
    "^": "write ** for a power",
    "%": "write mod(x, y)",
    "&": "write and",
    "|": "write or",
    "\u00d7": "write *",
    "\u00b7": "write *",
    "\u22c5": "write *",
    "\u2212": "write -",
    "\u2013": "write -",
    "\u00f7": "write /",
    "\u00b2": "write **2",
    "\u00b3": "write **3",
    "\u03c0": "write pi",
}
"""What to write for a character that is not allowed."""
REFUSED: dict[type[ast.AST], str] = {
    ast.Attribute: "attribute access is not allowed",
    ast.Tuple: "a list of values is not allowed",
    ast.Lambda: "'lambda' is not allowed",
    ast.Starred: "'*' is not allowed before an argument",
    ast.NamedExpr: "':=' is not allowed",
    ast.FloorDiv: "'//' is not allowed; use floor(a/b)",
}
"""What is refused by its name."""
OTHER_NAMES = {
    **{f"arc{name}": f"a{name}" for name in ("cos", "cosh", "sin", "sinh", "tan", "tan2", "tanh")},
    **{"Abs": "abs", "fabs": "abs", "ln": "log", "fmod": "mod", "rint": "round", "pow": "a**b"},
    **{"step": "heaviside", "Heaviside": "heaviside"},
    **{"maximum": "max", "minimum": "min", "power": "a**b", "sgn": "sign"},
}
"""What functions are called elsewhere."""


class ExpressionError(VibsimError):
    """A formula that is refused.

    Parameters
    ----------
    text
        The formula.
    position
        Where in `text`, from 0.
    rule
        What is wrong, or what was expected there.
    hint
        The nearest valid choice; may be empty.
    """

    def __init__(self, text: str, position: int, rule: str, hint: str = "") -> None:
        self.text = text
        self.position = position
        self.rule = rule
        self.hint = hint
        super().__init__(text, position, rule, hint)

    def __str__(self) -> str:
        where = f"formula '{shorten(self.text)}', character {self.position + 1}"
        return ": ".join(part for part in (where, self.rule, self.hint) if part)


def shorten(text: str, length: int = 60) -> str:
    """Return `text`, cut to `length` characters."""
    return text if len(text) <= length else text[: length - 3] + "..."


def place_of_fault(body: str, error: SyntaxError) -> tuple[int, str, str]:
    """Return where a text is no formula, what was expected there, and a hint: Python's messages speak of programs."""
    if joined := _JOINED.search(body):
        hint = f"write {joined.group()}*{body[joined.end()]}..."
        return joined.end(), "expected an operator", hint
    lonely = unpaired(body)
    if lonely is not None:
        return lonely, "has a parenthesis without its partner", ""
    if "too many nested" in str(error.msg):
        return 0, TOO_DEEP, ""
    # a text that is cut short is reported at its beginning, or past its end
    if _UNFINISHED.search(body):
        return len(body), "ends where a number, a name or '(' was expected", ""
    position = min(max((error.offset or 1) - 1, 0), len(body) - 1)
    return position, "expected an operator, a number, a name or a parenthesis here", ""


def unpaired(text: str) -> int | None:
    """Return where a parenthesis without its partner stands, None where there is none."""
    opened: list[int] = []
    for position, character in enumerate(text):
        if character == "(":
            opened.append(position)
        elif character == ")" and not opened:
            return position
        elif character == ")":
            opened.pop()
    return opened[-1] if opened else None
