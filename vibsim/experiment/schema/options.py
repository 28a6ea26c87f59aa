"""Options of schemes as values: a word, a number, or a flag, each of its own type wherever it comes from.

Read by jobs, and therefore free of the libraries that read files.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

FLAGS: Mapping[bool, str] = {False: "false", True: "true"}
"""How a flag that is swept is written among the values of a sweep."""


def as_option(known: str | float | bool, value: Any) -> str | float | bool:
    """Return `value`, an entry of a column of a sweep, as the option of which `known` is a value."""
    if isinstance(known, bool):
        return str(value) == FLAGS[True]
    return str(value) if isinstance(known, str) else float(value)


def tolerance_name(name: str, tolerance: float) -> str:
    """Return the name of one of several schemes that differ in their tolerance alone: ``dop853_1e-04``."""
    texts = (f"{tolerance:.{digits}e}" for digits in range(17))
    return f"{name}_{next((text for text in texts if float(text) == tolerance), repr(tolerance))}"
