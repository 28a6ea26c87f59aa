"""Citations: conversion between one line for readers and fields for programs.

A citation is the name of a text, followed by places in it, in this order and each at most once::

    TEXT, section 10.2, equation (85), figure 3, and exercise 18 b

Numbers are joined by commas, "and" and "to" (``sections 2.3 and 10.1``). Any other line is the name of a whole text.
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
"""Fields of a citation, in the order of its line, with their meaning."""
PLACES = tuple(FIELDS)[1:]
_AND = r"(?:, and |, | and )"
_BETWEEN = re.compile(f"{_AND}| to ")
_NUMBER = r"(?:[A-Z0-9][\w.'-]*(?: [a-z](?!\w))?|[a-z](?!\w))(?:-[a-z](?!\w))?"
_ITEM = rf"(?:{_NUMBER}|\({_NUMBER}\))"
LIST = re.compile(rf"{_ITEM}(?:(?:{_AND}| to ){_ITEM})*")
"""Matches one or several numbers of places."""
_PLACED = f"{_AND}(?:{'|'.join(PLACES)})s? "
_SOURCE = re.compile(
    f"(?P<text>(?:(?!{_PLACED}).)+)"
    + "".join(rf"(?:{_AND}{name}s? (?P<{name}>{LIST.pattern}))?" for name in PLACES),
    re.DOTALL,
)


def fields(source: str | None) -> dict[str, str | None] | None:
    """Return the `FIELDS` of a citation: numbers as in the line, without brackets; None for missing fields."""
    if source is None:
        return None
    match = _SOURCE.fullmatch(source)
    if match is None:
        return {"text": source} | dict.fromkeys(PLACES)
    places = {name: match[name] and re.sub("[()]", "", match[name]) for name in PLACES}
    return {"text": match["text"]} | places


def numbers(several: str) -> list[str]:
    """Return the numbers in a field; for a range its two ends."""
    return _BETWEEN.split(several)


def place(source: Mapping[str, str | None]) -> str:
    """Return the part of a citation within its section: equation, figure and exercise."""
    return line({name: source[name] for name in PLACES[1:]})


def line(source: Mapping[str, str | None]) -> str:
    """Return the line of a citation given by its `FIELDS`."""
    text = source.get("text")
    parts = [text] if text else []
    for name in PLACES:
        if number := source.get(name):
            plural = "s" if len(numbers(number)) > 1 else ""
            if name == "equation":
                number = re.sub(r"\b(?!and\b|to\b)[\w.'-]+", r"(\g<0>)", number)
            parts.append(f"{name}{plural} {number}")
    return ", ".join(parts)
