"""An equation of motion as MathML: letters for names, superscripts for powers, everything else as written."""

from __future__ import annotations

import re

LETTERS = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "theta": "θ", "mu": "μ", "omega": "ω",
    "phi": "φ",
}  # fmt: skip
"""Name to its Greek letter; other names stay as they are."""
_TOKEN = re.compile(
    r"(?P<name>[A-Za-z]\w*)(?P<primes>'*)|(?P<number>\d+(?:\.\d+)?(?:e-?\d+)?)|(?P<space>\s+)|(?P<sign>->|\*\*|.)"
)
_SIGNS = {"-": "−", "*": "·", "->": "→"}
LONG = 60
"""A page may break formulas of more characters before a sign."""


def mathml(text: str) -> str:
    """Return a formula such as ``u'' + w^2 u = 0`` as ``math`` elements, between which a page may break the line.

    There is one for each equation; in a long formula one for each term, also within the outer brackets.
    """
    from markupsafe import Markup, escape

    parts: list[list[str]] = [[]]
    depth, is_power = 0, False
    for token in _TOKEN.finditer(text):
        pieces, sign = parts[-1], token["sign"]
        depth += {"(": 1, ")": -1}.get(sign, 0)
        if sign in ("+", "-") and len(text) > LONG and depth < 2 and text[token.end()].isspace():
            parts.append(pieces := [])
        if token["space"]:
            pieces += ['<mspace width="0.2em"/>'] if pieces else []
            continue
        if token["name"]:
            piece = _name(token["name"], token["primes"])
        elif token["number"]:
            piece = f"<mn>{token['number']}</mn>"
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
    """Return a name with its index as a subscript and its primes."""
    head, _, index = name.partition("_")
    piece = f"<mi>{LETTERS.get(head, head)}</mi>"
    if index:
        piece = f"<msub>{piece}<mi>{LETTERS.get(index, index)}</mi></msub>"
    prime = {1: "′", 2: "″", 3: "‴"}.get(len(primes), primes)
    return f'<mrow>{piece}<mo lspace="0" rspace="0">{prime}</mo></mrow>' if primes else piece
