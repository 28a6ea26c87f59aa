"""How numbers are written in sentences, tables and figures of a study."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

from vibsim.core.decimals import round_outward

PLAIN_DIGITS = 5
"""Integers with up to this number of digits are written without a power of ten."""
MOST_DIGITS = 12
"""Largest number of digits of an extrapolated number in a sentence."""


def number(value: float | None, digits: int) -> str:
    """Write a number with `digits` significant digits, ``3.1e-4``."""
    if value is None:
        return "-"
    text = f"{value:.{digits}g}"
    mantissa, has_power, exponent = text.partition("e")
    if has_power and 0 <= int(exponent) < PLAIN_DIGITS:
        return f"{float(text):.0f}"
    if not has_power and value and abs(value) < 1e-3:
        mantissa, has_power, exponent = f"{value:.{digits - 1}e}".partition("e")
        mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return f"{mantissa}e{int(exponent)}" if has_power else mantissa


def digits_of_values(values: Iterable[float | None]) -> int:
    """Return the number of significant digits, at least 8, that shows the smallest difference of successive values.

    It is relative to these two values: others may have blown up.
    """
    known = [value for value in values if value is not None]
    pairs = [(max(abs(a), abs(b)), abs(a - b)) for a, b in pairwise(known) if a != b]
    digits = [2 + math.log10(size) - math.log10(step) for size, step in pairs]
    return math.ceil(min(max([8.0, *digits]), 17))


def at_most(bound: float) -> str:
    """Write a bound with two digits, rounded up."""
    text = number(bound, 2)
    return text if float(text) >= bound else number(round_outward(bound, 2), 2)


def percent(share: float | None) -> str:
    """Write a share in percent; empty if it is 1 or more: an error as large as the value."""
    return f"{number(100.0 * share, 2)} %" if share and share < 1.0 else ""


def with_bound(value: float, bound: float) -> str:
    """Write a number to the digits that its bound allows, with the bound: ``0.97130, within 2.1e-5``."""
    if not 0.0 < bound < math.inf:
        return number(value, 10)
    places = max(1 - math.floor(math.log10(bound)), 0)
    largest = max(abs(value), bound)
    if 1e-3 <= largest < 1e7 and places <= MOST_DIGITS:
        return f"{value:.{places}f}, within {at_most(bound)}"
    digits = 2 + max(math.floor(math.log10(largest)) - math.floor(math.log10(bound)), 0)
    return f"{number(value, min(digits, MOST_DIGITS))}, within {at_most(bound)}"


def listed(sizes: Sequence[float]) -> str:
    """Write step sizes as a list."""
    return listed_words([number(size, 6) for size in sizes])


def listed_words(words: Sequence[str]) -> str:
    """Write words as a list with ``and``."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} and {words[-1]}"
