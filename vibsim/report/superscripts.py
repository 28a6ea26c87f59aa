"""Exponents in Unicode."""

from __future__ import annotations

RAISE = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
"""Digits to superscripts."""


def power(exponent: int) -> str:
    """Write a power of ten in Unicode."""
    return "10" + str(exponent).translate(RAISE)
