"""Terms that a student may not know, with explanations for pointer and focus."""

from __future__ import annotations

import re
from typing import Any

GLOSSARY = {
    "observed order": "The power p with which the error shrinks from level to level: error = C dt^p.",
    "95 % interval": "It contains the true order with a probability of 95 % or more. It extends from the measured one "
    "to the powers of dt that explain the levels, often a whole one: with these the measured order is compatible.",
    "asymptotic": "The steps are so small that one power of dt makes up nearly all of the error.",
    "rescaled differences": "Differences between successive levels, multiplied so that they coincide where the error "
    "has the promised order.",
    "finest level": "The run with the smallest time step. A level has twice the steps of the one before it.",
    "finest time step": "The smallest time step. A level has twice the steps of the one before it.",
    "best value": "The value extrapolated over the levels to a step of zero (Richardson), with a bound of its error.",
    "root mean square": "The root of the mean over time of the squared error: a typical size.",
    "round-off": "The error of the arithmetic, which keeps about 16 digits. Finer levels do not reduce it.",
    "w dt": "The natural frequency times the time step. A period has 2 pi/(w dt) steps.",
    "hardest member": "The member of the sweep with the worst verdict; of equal ones that whose order is furthest off.",
    "printed": "The number as the source prints it.",
    "l2 norm": "The root of the integral over time of the squared value.",
    "growth per period": "The amplitude after one period over that before it.",
    "dimensionless": "Without a unit, because it is a ratio of quantities of the same kind.",
    "trap caught": "A check that expects a failure, which occurred.",
    "as claimed": "A statement of a text that holds in this measurement.",
    "shown to be false": "A statement that does not hold, as the experiment expects.",
}  # fmt: skip
"""Term in lower case to its meaning."""
_TERMS = re.compile(
    rf"(?<!\w)({'|'.join(sorted(map(re.escape, GLOSSARY), key=len, reverse=True))})(?!\w)",
    re.IGNORECASE,
)


def explained(text: str) -> Any:
    """Return a text as markup in which the first occurrence of each term of the glossary carries its meaning."""
    from markupsafe import Markup, escape

    explained, pieces, end = set[str](), [], 0
    for match in _TERMS.finditer(text):
        word = match[1].lower()
        if word in explained:
            continue
        explained.add(word)
        pieces += [escape(text[end : match.start()]), term(match[1], GLOSSARY[word])]
        end = match.end()
    return Markup("").join([*pieces, escape(text[end:])])


def term(text: str, meaning: str) -> Any:
    """Return a term as markup that carries its meaning."""
    from markupsafe import Markup

    return Markup('<abbr title="{}" tabindex="0">{}</abbr>').format(meaning, text)
