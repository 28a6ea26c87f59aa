"""An equation of motion as MathML: its names as letters, its powers raised, everything else in the order written."""

from __future__ import annotations

import re

LETTERS = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "theta": "θ", "mu": "μ", "omega": "ω",
    "phi": "φ",
}  # fmt: skip
"""Names of Greek letters; other names stand as they are."""
_TOKEN = re.compile(
    r"(?P<name>[A-Za-z]\w*)(?P<primes>'*)|(?P<number>\d+(?:\.\d+)?(?:e-?\d+)?)|(?P<space>\s+)|(?P<sign>->|\*\*|.)"
)
_SIGNS = {"-": "−", "*": "·", "->": "→"}


LONG = 60
"""Letters of a formula beyond which a page may break it before a sign."""


def mathml(text: str) -> str:
    """Return a formula such as ``u'' + w^2 u = 0`` as elements ``math``, between which a page may break it.

    One for each equation; of a long formula one for each term, also within its outer brackets.
    """
    from markupsafe import Markup, escape

    parts: list[list[str]] = [[]]
    depth, is_power = 0, False
    for found in _TOKEN.finditer(text):
        pieces, sign = parts[-1], found["sign"]
        depth += {"(": 1, ")": -1}.get(sign, 0)
        if sign in ("+", "-") and len(text) > LONG and depth < 2 and text[found.end()].isspace():
            parts.append(pieces := [])
        if found["space"]:
            pieces += ['<mspace width="0.2em"/>'] if pieces else []
            continue
        if found["name"]:
            piece = _name(found["name"], found["primes"])
        elif found["number"]:
            piece = f"<mn>{found['number']}</mn>"
        elif sign in ("^", "**") and pieces:
            is_power = True
            continue
        else:
            is_bracket = ' stretchy="false"' if sign in "()" else ""
            piece = f"<mo{is_bracket}>{escape(_SIGNS.get(sign, sign))}</mo>"
        if is_power:
            piece, is_power = f"<msup>{pieces.pop()}{piece}</msup>", False
        pieces.append(piece)
        if sign == "," and depth == 0:
            parts.append([])
    return Markup(" ".join(f"<math>{''.join(pieces)}</math>" for pieces in parts if pieces))


def _name(name: str, primes: str) -> str:
    """Return a name, its index lowered, with the marks of its derivatives."""
    head, _, index = name.partition("_")
    piece = f"<mi>{LETTERS.get(head, head)}</mi>"
    if index:
        piece = f"<msub>{piece}<mi>{LETTERS.get(index, index)}</mi></msub>"
    marks = {1: "′", 2: "″", 3: "‴"}.get(len(primes), primes)
    return f'<mrow>{piece}<mo lspace="0" rspace="0">{marks}</mo></mrow>' if primes else piece
