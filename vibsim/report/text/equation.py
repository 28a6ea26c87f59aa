"""An equation of motion as MathML: its names as letters, its powers raised, everything else in the order written."""

from __future__ import annotations

import re

LETTERS = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "theta": "θ", "mu": "μ", "omega": "ω",
    "phi": "φ",
}  # fmt: skip
"""Names of Greek letters; other names stand as they are."""
_TOKEN = re.compile(
    r"(?P<name>[A-Za-z]\w*)(?P<primes>'*)|(?P<number>\d+(?:\.\d+)?(?:e-?\d+)?)|(?P<space>\s+)|(?P<sign>->|.)"
)
_SIGNS = {"-": "−", "*": "·", "->": "→"}


def mathml(text: str) -> str:
    """Return a formula such as ``u'' + w^2 u = 0`` as an element ``math``, ready for a page."""
    from markupsafe import Markup, escape

    pieces: list[str] = []
    is_power = False
    for found in _TOKEN.finditer(text):
        if found["space"]:
            pieces += ['<mspace width="0.2em"/>'] if pieces else []
            continue
        if found["name"]:
            piece = _name(found["name"], found["primes"])
        elif found["number"]:
            piece = f"<mn>{found['number']}</mn>"
        elif found["sign"] == "^" and pieces:
            is_power = True
            continue
        else:
            sign = found["sign"]
            is_bracket = ' stretchy="false"' if sign in "()" else ""
            piece = f"<mo{is_bracket}>{escape(_SIGNS.get(sign, sign))}</mo>"
        if is_power:
            piece, is_power = f"<msup>{pieces.pop()}{piece}</msup>", False
        pieces.append(piece)
    return Markup(f"<math>{''.join(pieces)}</math>")


def _name(name: str, primes: str) -> str:
    """Return a name, its index lowered, with the marks of its derivatives."""
    head, _, index = name.partition("_")
    piece = f"<mi>{LETTERS.get(head, head)}</mi>"
    if index:
        piece = f"<msub>{piece}<mi>{LETTERS.get(index, index)}</mi></msub>"
    marks = {1: "′", 2: "″", 3: "‴"}.get(len(primes), primes)
    return f'<mrow>{piece}<mo lspace="0" rspace="0">{marks}</mo></mrow>' if primes else piece
