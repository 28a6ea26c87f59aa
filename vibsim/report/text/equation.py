"""An equation of motion as MathML: letters for names, superscripts for powers, everything else as written."""

from __future__ import annotations

import re

from vibsim.report.words import LETTERS

_TOKEN = re.compile(
    r"(?P<name>[A-Za-z]\w*)(?P<primes>'*)|(?P<number>\d+(?:\.\d+)?(?:e-?\d+)?)|(?P<space>\s+)|(?P<sign>->|\*\*|.)"
)
_EXPONENT = re.compile(r"\s*[-+]?\s*(?:[A-Za-z]\w*'*|\d+(?:\.\d+)?(?:e-?\d+)?)?")
_SIGNS = {"-": "−", "*": "·", "->": "→"}
LONG = 60  # a page may break a formula with more characters than this before a sign


def mathml(text: str) -> str:
    """Return a formula such as ``u'' + w^2 u = 0`` as ``math`` elements, between which a page may break the line.

    There is one for each equation; in a long formula one for each term, also within the outer brackets.
    """
    from markupsafe import Markup

    parts = _parts(text, is_broken=len(text) > LONG)
    return Markup(" ".join(f"<math>{''.join(pieces)}</math>" for pieces in parts if pieces))


def _parts(text: str, *, is_broken: bool) -> list[list[str]]:
    """Return the MathML of each equation of a formula, or of each of its terms, as a list of elements."""
    from markupsafe import escape

    parts: list[list[str]] = [[]]
    depth = position = 0
    while token := _TOKEN.match(text, position):
        pieces, sign, position = parts[-1], token["sign"], token.end()
        depth += {"(": 1, ")": -1}.get(sign, 0)
        if (
            sign in ("+", "-")
            and is_broken
            and depth < 2
            and text[position : position + 1].isspace()
        ):
            parts.append(pieces := [])
        if token["space"]:
            pieces += ['<mspace width="0.2em"/>'] if pieces else []
        elif token["name"]:
            pieces.append(_name(token["name"], token["primes"]))
        elif token["number"]:
            pieces.append(f"<mn>{token['number']}</mn>")
        elif sign in ("^", "**") and pieces:
            end = _end_of_exponent(text, position)
            pieces.append(f"<msup>{pieces.pop()}{_exponent(text[position:end])}</msup>")
            position = end
        else:
            attribute = ' stretchy="false"' if sign in "()" else ""
            pieces.append(f"<mo{attribute}>{escape(_SIGNS.get(sign, sign))}</mo>")
        if sign == "," and depth == 0:
            parts.append([])
    return parts


def _end_of_exponent(text: str, start: int) -> int:
    """Return the end of the exponent at `start`: a name or number with its sign, a bracket, or a function of one."""
    match = _EXPONENT.match(text, start)
    end = match.end() if match else start
    depth = 0
    for i in range(end, len(text) if text[end : end + 1] == "(" else end):
        depth += {"(": 1, ")": -1}.get(text[i], 0)
        if depth == 0:
            return i + 1
    return end


def _exponent(text: str) -> str:
    """Return an exponent as a single MathML element, without its outer brackets."""
    text = text.strip()
    if text.startswith("("):
        text = text[1:-1]
    (pieces,) = _parts(text, is_broken=False)
    return pieces[0] if len(pieces) == 1 else f"<mrow>{''.join(pieces)}</mrow>"


def _name(name: str, primes: str) -> str:
    """Return a name with its index as a subscript and its primes."""
    head, _, index = name.partition("_")
    piece = f"<mi>{LETTERS.get(head, head)}</mi>"
    if index:
        piece = f"<msub>{piece}<mi>{LETTERS.get(index, index)}</mi></msub>"
    prime = {1: "′", 2: "″", 3: "‴"}.get(len(primes), primes)
    return f'<mrow>{piece}<mo lspace="0" rspace="0">{prime}</mo></mrow>' if primes else piece
