"""Decimal digits of numbers: rounding to fewer of them that goes one way."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Context


def round_outward(value: float, digits: int, *, up: bool = True) -> float:
    """Return the next number of so many significant digits that is no smaller than `value`, or else no larger.

    What a number has are its shortest decimal digits: 0.1 stays 0.1, though its binary digits are a little more.
    """
    context = Context(prec=digits, rounding=ROUND_CEILING if up else ROUND_FLOOR)
    return float(context.create_decimal(str(float(value))))
