"""Why an order is another one than expected, by the options of the scheme, else by the data; and where orders go."""

from __future__ import annotations

import math
from itertools import pairwise

from vibsim.checks.words.order_context import (
    Story,
    ends_low,
    promises_less,
    promises_more,
    shows_promise,
    starts_low,
)
from vibsim.schemes.base import is_on_the_mesh


def cause_in_words(s: Story) -> str:
    """Say why an order is lower or higher than expected; empty where nothing tells."""
    if s.reason == "order_high" and promises_more(s) and shows_promise(s):
        promised = f"order {s.number(s.promised)}" if math.isfinite(s.promised) else "to be exact"
        return f" Scheme {s.scheme} promises {promised} here."
    if s.reason == "order_high":
        return _WHY_HIGH.get(s.cause, "").format(s.what, s.scheme, s.norm)
    if is_on_the_mesh(s.options):
        return " The likely cause is `events: mesh`: an event is noticed up to a step late."
    if s.has_corners:
        return " The likely cause is the table: the force has corners at its points, which lie within steps."
    if promises_less(s) and shows_promise(s):
        damping = ": it takes the damping backward" if "backward_damping" in s.kind else ""
        return (
            f" Scheme {s.scheme} promises no more than order {s.number(s.promised)} here{damping}."
        )
    if starts_low(s):
        return " The likely cause is the first step: `start: first_order` leaves its dt^2 term out."
    if ends_low(s):
        return (
            f" The likely cause is the last point: `end_velocity: {s.options['end_velocity']}` is a one-sided "
            "formula of lower order."
        )
    return _WHY_LOW.get(s.cause, "").format(s.what, s.scheme)


_WHY_LOW = {
    "last_point": (
        " Without the last point the order is the expected one: what is of lower order is a formula at the end."
    ),
    "one_quantity": " Another state has the expected order: what is of lower order is how {0} is made, not the step.",
    "everything": (
        " It is so in every state and at every time, so that it is a term of the step of scheme {1}, of its start, or "
        "of the force that it evaluates."
    ),
}
_WHY_HIGH = {
    "special_times": (
        " All common times are turning points of {0}: most of an error is a shift in time, which does not show there. "
        "This is no higher order."
    ),
    "theory": " The theory of scheme {1} has that order on this linear model, too.",
    "one_norm": " In another norm than {2} the order is the expected one: errors cancel in this one.",
    "one_quantity": " Another state has the expected order: the leading error vanishes in {0}, not in every state.",
    "everything": " It is so in every state and every norm.",
}


TOLD = 4
"""So many of the last orders are looked at, and told."""
APART = 0.3
"""Orders this near to the one that is due need no word on where they go."""


def trend_in_words(s: Story, due: float) -> str:
    """Say where orders go, as the end of a sentence; empty where it is not known, or they are near.

    Parameters
    ----------
    due
        The order that levels should approach.
    """
    known = [order for order in s.orders if math.isfinite(order)][-TOLD:]
    if not known or not math.isfinite(due) or abs(known[-1] - due) <= APART:
        return ""
    is_above = known[-1] > due
    why = "a higher power of dt still outweighs that one" if is_above else ""
    if len(known) == 1:
        return f", which is above order {s.number(due)}: {why}" if is_above else ""
    told = ", ".join(f"{order:.2f}" for order in known)
    steps = {math.copysign(1.0, b - a) for a, b in pairwise(known)}
    same_side = all((order > due) == is_above for order in known)
    if len(steps) > 1 or not same_side:
        return f"; from level to level the estimates are {told}, which do not settle"
    if (steps == {-1.0}) != is_above:
        return f"; from level to level the estimates move away from order {s.number(due)} ({told})"
    way = "fall" if is_above else "rise"
    end = f": {why}" if why else ""
    return f"; from level to level the estimates {way} towards order {s.number(due)} ({told}){end}"
