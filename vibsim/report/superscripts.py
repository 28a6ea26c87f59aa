"""Exponents in Unicode."""

from __future__ import annotations

_SUPERSCRIPTS = "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"
RAISE = str.maketrans("-0123456789", _SUPERSCRIPTS)
"""Digits to superscripts."""
LOWER = str.maketrans(_SUPERSCRIPTS, "-0123456789")
"""Superscripts to digits."""


def power(exponent: int) -> str:
    """Write a power of ten in Unicode."""
    return "10" + str(exponent).translate(RAISE)
