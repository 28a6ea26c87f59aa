"""Numbers in decimal digits: rounded outward, and as the ends of an interval."""

from __future__ import annotations

import math
from decimal import ROUND_CEILING, ROUND_FLOOR, Context


def round_outward(value: float, digits: int, *, up: bool = True) -> float:
    """Round `value` up, or down, to `digits` significant decimal digits.

    The shortest decimal form of `value` is rounded: 0.1 stays 0.1, although its binary value is slightly larger.
    """
    context = Context(prec=digits, rounding=ROUND_CEILING if up else ROUND_FLOOR)
    return float(context.create_decimal(str(float(value))))


def order_interval(low: float | None, high: float | None) -> tuple[str, ...]:
    """Return the ends of an order's interval as text, with the 3 to 6 decimals that differ; one text if none do.

    The result is empty if an end is unknown.
    """
    if low is None or high is None or not math.isfinite(low + high):
        return ()
    for decimals in range(3, 7):
        ends = f"{low:.{decimals}f}", f"{high:.{decimals}f}"
        if ends[0] != ends[1]:
            return ends
    return (f"{low:.3f}",)
