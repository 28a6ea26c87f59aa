"""Directed rounding to a number of decimal digits."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Context


def round_outward(value: float, digits: int, *, up: bool = True) -> float:
    """Round `value` up, or down, to `digits` significant decimal digits.

    The shortest decimal form of `value` is rounded: 0.1 stays 0.1, although its binary value is slightly larger.
    """
    context = Context(prec=digits, rounding=ROUND_CEILING if up else ROUND_FLOOR)
    return float(context.create_decimal(str(float(value))))
