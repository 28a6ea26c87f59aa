"""Where something stands in a text: one line that people read, and the same in fields for programs.

A source is the name of a text and what of it is meant, in this order, each at most once::

    TEXT, section 10.2, equation (85), figure 3, and exercise 18 b

Numbers are joined by commas, "and" and "to" (``sections 2.3 and 10.1``). Any other line names a text as a whole.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

FIELDS = {
    "text": "What the text is called.",
    "section": "Number of the section, or several.",
    "equation": "Number of the equation, or several.",
    "figure": "Number of the figure, or several.",
    "exercise": "Number of the exercise, or several.",
}
"""What a source may name, in the order of its line, with the meaning."""
PLACES = tuple(FIELDS)[1:]
_AND = r"(?:, and |, | and )"
_BETWEEN = re.compile(f"{_AND}| to ")
_NUMBER = r"(?:[A-Z0-9][\w.'-]*(?: [a-z](?!\w))?|[a-z](?!\w))(?:-[a-z](?!\w))?"
_ITEM = rf"(?:{_NUMBER}|\({_NUMBER}\))"
LIST = re.compile(rf"{_ITEM}(?:(?:{_AND}| to ){_ITEM})*")
"""One or several numbers of places."""
_PLACED = f"{_AND}(?:{'|'.join(PLACES)})s? "
_SOURCE = re.compile(
    f"(?P<text>(?:(?!{_PLACED}).)+)"
    + "".join(rf"(?:{_AND}{name}s? (?P<{name}>{LIST.pattern}))?" for name in PLACES),
    re.DOTALL,
)


def fields(source: str | None) -> dict[str, str | None] | None:
    """Return a source by its `FIELDS`: numbers as written, without brackets; None for what it does not name."""
    if source is None:
        return None
    found = _SOURCE.fullmatch(source)
    if found is None:
        return {"text": source} | dict.fromkeys(PLACES)
    places = {name: found[name] and re.sub("[()]", "", found[name]) for name in PLACES}
    return {"text": found["text"]} | places


def numbers(several: str) -> list[str]:
    """Return the numbers that a field names; of a range its two ends."""
    return _BETWEEN.split(several)


def place(source: Mapping[str, str | None]) -> str:
    """Return what a source names within its section: equation, figure and exercise."""
    return line({name: source[name] for name in PLACES[1:]})


def line(source: Mapping[str, str | None]) -> str:
    """Return the line of a source that is given by its `FIELDS`."""
    text = source.get("text")
    parts = [text] if text else []
    for name in PLACES:
        if number := source.get(name):
            plural = "s" if len(numbers(number)) > 1 else ""
            if name == "equation":
                number = re.sub(r"\b(?!and\b|to\b)[\w.'-]+", r"(\g<0>)", number)
            parts.append(f"{name}{plural} {number}")
    return ", ".join(parts)
