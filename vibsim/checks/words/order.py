"""What was measured of a convergence, in a sentence that a student understands, by the reason of its verdict.

What to change in the YAML is in `vibsim.checks.words.order_advice`.
"""

from __future__ import annotations

import math

from vibsim.checks.words.notation import growth_in_words
from vibsim.checks.words.order_context import (
    Corner,
    Story,
    due,
    first_stable,
    is_adaptive,
    may_hide,
    promises_less,
    promises_more,
)
from vibsim.checks.words.order_details import cause_in_words, trend_in_words
from vibsim.schemes.base import is_on_the_mesh

HIGHEST = 12.0
"""An estimate above is the order of no scheme."""
FAR_DOWN = 1.0
"""An interval that reaches further below its order holds a lower power of the expansion as well."""


def _measured(s: Story) -> str:
    """Return the stated order with its interval and levels; empty where there is none."""
    if math.isnan(s.order):
        return ""
    known = math.isfinite(s.low) and math.isfinite(s.high)
    between = f" (between {s.low:.3f} and {s.high:.3f})" if known else ""
    return f"order {s.order:.3f}{between} on levels {s.first} to {s.last}"


def _due(s: Story) -> str:
    """Say whose the order is: the scheme's, or that of the check alone, where theory has none or another one."""
    if not s.has_promise or promises_less(s) or promises_more(s):
        return "expected"
    return "promised"


def tell(s: Story) -> str:
    """Say what was measured of a convergence, in one sentence."""
    measured, promised = _measured(s), f"order {s.number(s.expected)}"
    if s.reason == "order_low" and math.isinf(s.expected):
        so_far = f": with {measured}" if measured else ""
        return f"{s.subject} is promised to be exact, but the levels differ by more than round-off{so_far}."
    match s.reason:
        case "asymptotic":
            return (
                f"{s.subject} converges with {measured}, as {_due(s)} ({promised}). The rescaled "
                f"differences coincide.{_doubt(s)}{_unseen(s)}"
            )
        case "exact":
            return (
                f"{s.subject} is exact: the levels differ by round-off only, and there is no order "
                f"to measure.{_unseen(s)}"
            )
        case "order_low" | "order_high":
            word = "slower" if s.reason == "order_low" else "faster"
            return f"{s.subject} converges {word} than {promised}, with {measured}.{cause_in_words(s)}{s.parts}"
        case "wrong_limit":
            return (
                f"The levels of {s.what} approach each other, but not the exact solution. The "
                "error that remains is larger than their differences allow."
            )
        case "unstable":
            return _unstable(s)
        case "non_finite":
            return f"The calculation of {s.what} met a number that is not finite{_place_of_failure(s)}."
        case "round_off":
            kept = f"; before it, {measured} is all that is left" if s.order > 0.0 else ""
            if s.cause == "noise":
                return (
                    f"The finest differences of {s.what} look like noise, but are larger than the predicted "
                    f"round-off. They say nothing about the scheme{kept}."
                )
            stored = " of the single precision that it is stored in" if s.cause == "stored" else ""
            return (
                f"The differences of {s.what} have reached the floor of round-off{stored}, where they say "
                f"nothing about the scheme{kept}."
            )
        case "oscillating":
            return (
                f"The differences of {s.what} oscillate from level to level, so no order can "
                "be read from them."
            )
        case "non_smooth" | "pre_asymptotic" if s.cause == "pulse":
            return _missed(s)
        case "pre_asymptotic" if s.cause == "decay":
            return _decays(s)
        case "non_smooth":
            return _not_smooth(s)
        case "too_few_levels":
            count = len(s.levels)
            return (
                f"{count} level{'s are' if count > 1 else ' is'} too few to judge the convergence of "
                f"{s.what}: three are needed, four are better."
            )
        case "not_applicable":
            return _nothing_to_judge(s)
        case _ if s.cause == "still":
            return (
                f"{s.subject} lies still at every common time, while the exact solution moves: the step is still too "
                "coarse to see that."
            )
    return f"{_too_coarse(s, measured)}{s.parts}"


def _unseen(s: Story) -> str:
    """Say what levels that approach each other do not tell."""
    if s.has_exact:
        return ""
    return " There is no exact solution, so convergence to a wrong answer would go unnoticed."


def _too_coarse(s: Story, measured: str) -> str:
    """Say that levels show no order yet; where it is none that an expansion has, what they show instead."""
    if s.order <= 0.0:
        return (
            f"The differences of {s.what} grow from level to level ({measured}): the step is still too coarse to "
            f"tell an order, or level {s.last} is not of one kind with those before it."
        )
    if s.order > HIGHEST:
        return (
            f"The step is still too coarse to tell the order of {s.what}: its differences fall faster on levels "
            f"{s.first} to {s.last} than those of any power of dt, as where the coarser ones have nothing to do with "
            "the solution."
        )
    so_far = f": the last estimate is {measured}{trend_in_words(s, due(s))}" if measured else ""
    return f"The step is still too coarse to tell the order of {s.what}{so_far}.{_hidden(s)}"


def _hidden(s: Story) -> str:
    """Say which power may take over on finer levels; empty where none is known to."""
    if not may_hide(s):
        return ""
    return (
        f" Scheme {s.scheme} has an error of order {s.number(s.promised)} here, which may still be too small "
        "to be seen: finer levels decide."
    )


def _doubt(s: Story) -> str:
    """Say of an order that passes why its interval reaches far down; empty where it does not."""
    if not s.order - s.low > FAR_DOWN:
        return ""
    return (
        f" A small error of lower order cannot be ruled out, so the interval extends down to order {s.low:.1f}. Add a "
        "level to settle it."
    )


def _place_of_failure(s: Story) -> str:
    """Say where a calculation broke down, as far as it is known."""
    if s.culprit < 0:
        return ""
    where = f" at level {s.culprit}"
    if s.singular == 0.0:
        return f"{where}, in its first step, and so does every finer level"
    if not math.isnan(s.singular):
        return f"{where}, and finer ones do not avoid it: level {s.levels[-1]} met one at t = {s.number(s.singular, 4)}"
    at = s.failures[s.levels.index(s.culprit)] if s.culprit in s.levels and s.failures else math.nan
    return where if math.isnan(at) else f"{where}, at t = {s.number(at, 4)}"


def _unstable(s: Story) -> str:
    """Say from which level on a run is stable; of a solution that grows within its limit, that it does."""
    if math.isfinite(s.omega_dt) and s.omega_dt > s.limit:
        return (
            f"The run is unstable: at level {s.culprit}, w dt = {s.number(s.omega_dt, 4)} is beyond the limit "
            f"{s.number(s.limit)} of scheme {s.scheme}{growth_in_words(*s.growth, s.growth_of, s.notation)}; level "
            f"{first_stable(s)} is the first within it."
        )
    return (
        f"{s.subject} is unstable: the solution grows where the exact one does not, and finer levels "
        "do not remove that."
    )


def _not_smooth(s: Story) -> str:
    """Say what leaves an error without a regular expansion."""
    if is_on_the_mesh(s.options):
        return (
            f"Scheme {s.scheme} leaves events to the mesh, which notices them up to a step late, wherever they lie "
            f"between two points: the error of {s.what} has no regular expansion in powers of dt."
        )
    if s.has_corners:
        return (
            "Between the points of its table the force is a straight line, and its corners lie within steps, at "
            f"each level elsewhere: the error of {s.what} has no regular expansion in powers of dt."
        )
    if s.corner:
        return _cornered(s, s.corner)
    return f"{s.subject} is not smooth, so its error has no regular expansion in powers of dt."


def _missed(s: Story) -> str:
    """Say where the force has a pulse between the points of every level."""
    time, width = s.pulse
    what = ", between two jumps or corners" if s.reason == "non_smooth" else ""
    return (
        f"Near t = {s.number(time, 6)} the force has a pulse of length {s.number(width, 1)} or so{what}, which lies "
        f"between two points of every level (the shortest step is {s.number(s.shortest, 2)}). No level sees it, so the "
        f"differences between levels do not show the error of {s.what}."
    )


def _decays(s: Story) -> str:
    """Say that a velocity is gone within a step."""
    return (
        f"The damping takes a velocity away at a rate of up to {s.number(s.decay, 2)}, within a time of "
        f"{s.number(1.0 / s.decay, 2)}. That is less than the shortest step, {s.number(s.shortest, 2)}: no level sees "
        "how the motion decays there, so the "
        f"differences between levels do not show the error of {s.what}."
    )


def _cornered(s: Story, corner: Corner) -> str:
    """Say where the first corner of the force lies, and the order that it leaves."""
    measured = _measured(s) if s.order > 0.0 else ""
    so_far = f"; the last estimate is {measured}" if measured else ""
    if promises_less(s):
        so_far += (
            f". Scheme {s.scheme} promises no more than order {s.number(s.promised)} without it"
        )
    if corner.on_a_point:
        return (
            f"{s.subject} cannot show order {s.number(s.expected)}, because the force jumps at a grid point: "
            f"{corner.words} at t = {s.number(corner.time, 4)}, and the steps on both sides use the same value there. "
            f"Expect order 1{so_far}."
        )
    jump = {1.0: "the force jumps", 2.0: "the force has a corner"}
    what = jump.get(corner.power, "a derivative of the force jumps")
    return (
        f"{s.subject} cannot show order {s.number(s.expected)}, because {what} within a step: {corner.words} at "
        f"t = {s.number(corner.time, 4)}. Expect order {s.number(corner.power)}{so_far}."
    )


def _nothing_to_judge(s: Story) -> str:
    """Say why a quantity has no order."""
    if is_adaptive(s):
        return (
            f"Scheme {s.scheme} is adaptive: it chooses its own steps, whatever the level, so an order of "
            f"{s.what} does not exist."
        )
    if s.cause == "still":
        return (
            f"{s.subject} does not change after the start, or too little for an error to show: the levels agree "
            "whatever the scheme does, and there is nothing to judge."
        )
    return f"{s.subject} does not exist here, so there is nothing to judge."
