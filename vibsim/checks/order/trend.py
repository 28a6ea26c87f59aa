"""What the orders of successive levels do where they have not settled: approach the order that is due, or not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from vibsim.checks.numbers_in_words import number

TOLD = 4
"""So many of the last orders are looked at, and told."""
APART = 0.3
"""Orders this near to the one that is due need no word on where they go."""


def trend_in_words(orders: Sequence[float], due: float) -> str:
    """Say where orders go, as the end of a sentence; empty where it is not known, or they are near.

    Parameters
    ----------
    orders
        Of successive levels, the coarsest first; NaN where there is none.
    due
        The order that levels should approach.
    """
    known = [order for order in orders if math.isfinite(order)][-TOLD:]
    if not known or not math.isfinite(due) or abs(known[-1] - due) <= APART:
        return ""
    is_above = known[-1] > due
    why = "a higher power of dt still outweighs that one" if is_above else ""
    if len(known) == 1:
        return f", which is above order {number(due)}: {why}" if is_above else ""
    told = ", ".join(f"{order:.2f}" for order in known)
    steps = {math.copysign(1.0, b - a) for a, b in pairwise(known)}
    same_side = all((order > due) == is_above for order in known)
    if len(steps) > 1 or not same_side:
        return f"; from level to level the estimates are {told}, which do not settle"
    if (steps == {-1.0}) != is_above:
        return f"; from level to level the estimates move away from order {number(due)} ({told})"
    way = "fall" if is_above else "rise"
    end = f": {why}" if why else ""
    return f"; from level to level the estimates {way} towards order {number(due)} ({told}){end}"
