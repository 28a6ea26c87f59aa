"""Sentence and advice for every reason that a verdict on levels alone has, made from facts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from vibsim.convergence.study.notation import (
    at_most,
    listed,
    listed_words,
    number,
    percent,
    with_bound,
)
from vibsim.convergence.thresholds import LEAST_RATIO
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER, ORDER_TOLERANCE

if TYPE_CHECKING:
    from vibsim.convergence.study.verdict import LadderVerdict


@dataclass(frozen=True)
class Setting:
    """Facts beside the verdict that the words on a ladder use."""

    is_noise_stated: bool = False
    """Whether the user states the noise of the levels."""
    is_noise_seen: bool = False
    """Whether the finest difference may be noise, so that a finer level would not help."""
    are_digits_few: bool = False
    """Whether the rounding of the values to their last digit may hide the order."""
    sizes: tuple[str, ...] = ("h",)
    """Names of the sizes that are refined together."""
    is_proportional: bool = True
    """Whether all of them are proportional to the first."""
    interpolation: tuple[str, int] | None = None
    """Kind and order of the interpolation, if it hides the order."""
    is_contradicted: bool = False
    """Whether levels finer than those of the order contradict it."""
    is_growing: bool = False
    """Whether levels without an order differ far more at the finest step than before."""
    logarithm: float | None = None
    """The power that a logarithm multiplies in the error, if the levels show one."""
    are_sizes_rounded: bool = False
    """Whether the rounding of the sizes may change the order by more than the tolerance."""
    notes: tuple[str, ...] = ()
    """Other possible faults, for a ladder that does not pass with an expected order above 1."""
    parts: tuple[str, ...] = ()
    """Sentences on what was compared: points, levels left out, rounding."""


BEYOND_ROUND_OFF = 1e-10
"""A difference above this part of the values is not round-off."""
BLOW_UP = 1e3
"""A finest level this factor larger than every other one may be that of an unstable solver."""
APART = 1e-3
"""Growing differences above this part of the values mean levels that move apart, unless a noise is stated."""
LOOK_FOR = (
    "Look for a part of lower order, such as the first step, a formula at a boundary, a limiter, or an iteration that "
    "stops too early"
)
ROUNDED = (
    "If the step sizes were rounded to the digits that they have, that alone may change the order."
)
MORE_DIGITS = "Give {size} with more digits, such as 1/n for n cells. If it has no more, {finer}."
SENTENCES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "asymptotic": ("{quantity} converges with order {order}{as_expected}.", ""),
        "exact": (
            "The levels of {quantity} differ by {noise} only, so there is no order to measure.",
            "",
        ),
        "order_low": (
            "{quantity} converges more slowly than expected, with order {order} instead of {wanted}.",
            LOOK_FOR + ". If the method promises no more here, expect that order.",
        ),
        "order_high": (
            "{quantity} converges faster than expected, with order {order} instead of {wanted}.",
            "Check the expected order. The leading error may vanish by symmetry here; other data would show it.",
        ),
        "wrong_limit": (
            "The levels of {quantity} approach each other, but not the exact {value}.",
            "Check the solver's code, the equation, its parameters and conditions, and the exact {value}. Finer levels "
            "will not help.",
        ),
        "non_finite": (
            "{quantity} is not finite at {not_finite}.",
            "Find out why the solver breaks down there, or leave {these} out.",
        ),
        "pre_asymptotic": (
            "The levels of {quantity} do not show a settled order yet{estimate}.",
            "{finer}.",
        ),
        "rounded": (
            "The levels of {quantity} do not show a settled order yet{estimate}. The rounding of the values to their "
            "last digit may hide it.",
            "{finer}.",
        ),
        "contradicted": (
            "The levels of {quantity} down to {size} = {last_used} fit order {order}, but finer ones contradict them: "
            "they differ by more than the levels before them.",
            "Check the step size, the last step and the input of the finest runs. If they are right, {finer}.",
        ),
        "logarithm": (
            "The levels of {quantity} fit an error like {term} log {size}, as singularities leave it. Its "
            "order{estimate} comes near {power} only slowly.",
            "Remove the singularity, or expect a lower order. Finer levels hardly change this order.",
        ),
        "growing": (
            "The differences of {quantity} grow towards the finer levels{estimate}.",
            "Check that {size} is a step size, not a number of cells or steps, and that each level has its own. If so, "
            "{finer}.",
        ),
        "blown_up": (
            "{quantity} grows towards the finer levels, as with an unstable solver.",
            "Check the limit of stability of the solver, such as the longest time step for a cell size, and that "
            "{size} is a step size.",
        ),
        "round_off": (
            "The finest differences of {quantity} look like {floor}, so they do not show its order{estimate}.",
            "Use coarser levels, or {less_noise}.",
        ),
        "same": (
            "All levels of {quantity} are the same to the last digit that they have, so they do not show its order.",
            "Check that the solver used {size}. If it did, use coarser levels, or {to_see}.",
        ),
        "oscillating": (
            "The differences of {quantity} change sign from level to level, so no order can be read from them.",
            "{finer}, or judge another quantity.",
        ),
        "too_few_levels": (
            "{count} too few to judge the convergence of {quantity}. Three are needed, and four are better.",
            "Add a level{such_as}.",
        ),
        "interpolation": (
            "The order of {quantity} is hidden, because the {kind} interpolation to common points has order {own} "
            "itself{estimate}.",
            "{other_points}.",
        ),
    }
)
"""Templates of sentence and advice by the reasons that levels alone show. ``interpolation`` is the only case of
``not_applicable``; ``rounded``, ``contradicted`` and ``logarithm`` are cases of ``pre_asymptotic``, and ``growing`` and
``blown_up`` are cases of this and of ``round_off``, and so is ``same`` of the latter."""


def describe(facts: LadderVerdict, setting: Setting) -> tuple[str, str]:
    """Return sentence and advice on a ladder; the advice is empty if it passed."""
    key = "interpolation" if setting.interpolation else facts.reason
    if _is_growth(facts, setting):
        key = "blown_up" if _is_blown_up(facts) else "growing"
    elif key == "pre_asymptotic" and setting.is_contradicted and facts.order is not None:
        key = "contradicted"
    elif key == "pre_asymptotic" and setting.are_digits_few:
        key = "rounded"
    elif key == "pre_asymptotic" and setting.logarithm is not None:
        key = "logarithm"
    elif key == "round_off" and not any(level.difference for level in facts.levels):
        key = "same"
    phrases = _phrases(facts, setting)
    is_moved = key == "pre_asymptotic" or bool(_higher_part(facts))
    sentence, advice = (template.format_map(phrases) for template in SENTENCES[key])
    more = [
        ROUNDED if is_moved and setting.are_sizes_rounded else _higher_part(facts),
        opposite_part(
            facts.reason, facts.order, facts.expected if facts.at_least is None else facts.at_least
        ),
        "" if key in ("contradicted", "growing", "blown_up", "logarithm") else _interval(facts),
        _error(facts),
        _best(facts),
        _together(setting),
        *setting.parts,
        _finer(facts),
        _copies(facts),
    ]
    if facts.status == "PASS":
        # points that do not match make an error of order 1, which a confirmed higher order rules out
        confirmed = (facts.expected or 0.0) > 1.0 + ORDER_TOLERANCE
        return _joined([sentence, *more, *(() if confirmed else setting.notes)]), ""
    if is_moved and setting.are_sizes_rounded:
        advice = MORE_DIGITS.format_map(phrases)
    return _joined([sentence, *more]), _joined([advice[:1].upper() + advice[1:], *setting.notes])


def _is_growth(facts: LadderVerdict, setting: Setting) -> bool:
    """Say whether differences grow because levels move apart, and not because of noise."""
    # an estimate of coarser levels, behind which differences change sign, says nothing of the finest ones
    is_last = facts.levels[-LEVELS_OF_AN_ORDER:][0].order is not None
    is_negative = facts.order is not None and round(facts.order, 3) < 0.0
    if not setting.is_growing and not (is_negative and is_last):
        return False
    if facts.reason != "round_off":
        return facts.reason == "pre_asymptotic"
    finest = facts.levels[-2:][0]
    size = abs(finest.value or 0.0)
    return not setting.is_noise_stated and abs(finest.difference or 0.0) > APART * size > 0.0


def _is_blown_up(facts: LadderVerdict) -> bool:
    *others, finest = (abs(level.value) for level in facts.levels if level.value is not None)
    return finest > BLOW_UP * max(others) > 0.0


def _joined(parts: Sequence[str]) -> str:
    return " ".join(part for part in parts if part)


def _phrases(facts: LadderVerdict, setting: Setting) -> dict[str, Any]:
    kind, own = setting.interpolation or ("", 0)
    h, count = [level.h for level in facts.levels], len(facts.levels)
    # a verdict leaves out levels that are closer together
    ratio = h[-2] / h[-1] if count > 1 else 0.0
    finer = number(h[-1] / (ratio if ratio >= LEAST_RATIO else 2.0), 6)
    # sizes near the limits of double precision may have no finer one
    such_as = f", such as {facts.size_name} = {finer}" if 0.0 < float(finer) < h[-1] else ""
    not_finite = [level.h for level in facts.levels if level.value is None]
    these = "this level" if len(not_finite) == 1 else "these levels"
    if len(not_finite) == count and not facts.is_number:
        these = "these points"
    if facts.expected is not None:
        wanted, as_expected = f"{facts.expected:g}", ", as expected"
    elif facts.at_least is not None:
        wanted = f"at least {facts.at_least:g}"
        as_expected = f", {wanted} as expected"
    else:
        wanted, as_expected = "another one", ""
    value = "value" if facts.is_number else "values"
    less_noise = (
        f"give {facts.quantity} with more digits"
        if setting.are_digits_few
        else f"compute {facts.quantity} with less noise"
    )
    power = f"{setting.logarithm:g}" if setting.logarithm else ""
    points = "Take levels that have the coarsest points in common (restrict: subset)"
    return {
        "quantity": facts.quantity,
        "order": order_with_interval(facts),
        "power": power,
        "term": facts.size_name if power == "1" else f"{facts.size_name}^{power}",
        "last_used": number(facts.h_used[-1], 6) if facts.h_used else "",
        "as_expected": as_expected,
        "wanted": wanted,
        "value": value,
        "noise": "the stated noise" if setting.is_noise_stated else "round-off",
        "floor": "the stated noise" if setting.is_noise_stated else "round-off or other noise",
        "less_noise": less_noise,
        "to_see": less_noise if setting.are_digits_few else "state the exact " + value,
        "finer": f"use coarser levels, or {less_noise}"
        if setting.is_noise_seen or setting.are_digits_few
        else f"add a finer level{such_as}",
        "not_finite": f"{facts.size_name} = {listed(not_finite)}",
        "these": these,
        "estimate": f" (the last estimate is {number(round(facts.order, 3) + 0.0, 3)})"
        if facts.order is not None
        else "",
        "size": facts.size_name,
        "such_as": such_as,
        "count": "One level is" if count == 1 else f"{count} levels are",
        "kind": kind,
        "own": own,
        "other_points": f"{points}, or use restrict: cubic" if kind == "linear" else points,
    }


def order_with_interval(facts: LadderVerdict) -> str:
    """Write an order with its interval, ``2.00 (1.97 to 2.03)``."""
    if facts.order is None:
        return "unknown"
    if facts.order_low is None or facts.order_high is None:
        return f"{facts.order:.2f}"
    places = 3 if facts.order_high - facts.order_low < 0.02 else 2
    return (
        f"{facts.order:.{places}f} ({facts.order_low:.{places}f} to {facts.order_high:.{places}f})"
    )


def higher_part(order: float, expected: float, tolerance: float) -> str:
    """Say why the measured order differs from the dominant one; empty if it does not."""
    if abs(order - expected) <= tolerance:
        return ""
    moves = "raises" if order > expected else "lowers"
    return f"A part of the error of higher order is still seen. It {moves} the measured order."


def opposite_part(reason: str, order: float | None, wanted: float | None) -> str:
    """Say why an order fails as too low or too high although the measured one is not; otherwise empty."""
    if order is None or wanted is None or not math.isfinite(wanted):
        return ""
    if reason == "order_low" and order >= wanted:
        return "The largest part of the error has a lower order. Another part still raises the measured order."
    if reason == "order_high" and order <= wanted:
        return "The largest part of the error has a higher order. Another part still lowers the measured order."
    return ""


def _higher_part(facts: LadderVerdict) -> str:
    if facts.reason != "asymptotic" or facts.expected is None or facts.order is None:
        return ""
    return higher_part(facts.order, facts.expected, ORDER_TOLERANCE)


def _interval(facts: LadderVerdict) -> str:
    """Say which orders are consistent with the levels of an open verdict."""
    if facts.reason != "pre_asymptotic" or facts.order_low is None or facts.order_high is None:
        return ""
    # an order just below 0 is 0
    low, high = (round(x, 2) + 0.0 for x in (facts.order_low, facts.order_high))
    if facts.order_high - facts.order_low >= ORDER_TOLERANCE:
        return f"They are consistent with orders from {low:.2f} to {high:.2f}."
    orders = f"order {low:.2f}" if low == high else f"orders {low:.2f} to {high:.2f}"
    return f"They fit {orders} alone, but may do so by accident."


def _finer(facts: LadderVerdict) -> str:
    """Say from which level on a decided order is not visible."""
    decided = facts.reason in ("asymptotic", "order_low", "order_high")
    if not decided or not facts.h_used or facts.h_used[-1] == facts.levels[-1].h:
        return ""
    last = number(facts.h_used[-1], 6)
    return f"The levels finer than {facts.size_name} = {last} do not show this order."


def _copies(facts: LadderVerdict) -> str:
    """Question neighbouring levels that are equal although the levels beside them differ by more than round-off."""
    levels, size = facts.levels, facts.size_name
    sizes = [abs(level.difference or 0.0) for level in levels[:-1]]
    if facts.reason == "exact" and sizes and not any(sizes):
        return f"All levels are the same to the last digit. Check that the solver used {size}."
    for i, level in enumerate(levels[:-1]):
        beside = max([*sizes[max(i - 1, 0) : i], *sizes[i + 1 : i + 2]], default=0.0)
        if level.difference == 0.0 and beside > BEYOND_ROUND_OFF * abs(level.value or 0.0):
            same = listed([level.h, levels[i + 1].h])
            return (
                f"The levels {size} = {same} are the same to the last digit. Check that the solver used {size}, and "
                "that no digits were cut off."
            )
    return ""


def _error(facts: LadderVerdict) -> str:
    """State the error of the finest level with its bound."""
    if facts.error is None:
        return ""
    if facts.reason == "exact" and facts.error_bound is not None:
        return f"The error of the finest level is at most {at_most(facts.error_bound)}."
    size = number(abs(facts.error), 2)
    share = percent(facts.relative_error)
    share = f" ({share})" if share else ""
    bound = facts.error_bound
    limit = "" if facts.is_exact_known or bound is None else f", at most {at_most(bound)}"
    presumed = " if the levels converge" if limit and facts.status == "INCONCLUSIVE" else ""
    return f"The error of the finest level is {size}{share}{limit}{presumed}."


def _best(facts: LadderVerdict) -> str:
    """State the extrapolated number with its bound."""
    if (
        facts.best is None
        or facts.is_exact_known
        or facts.status == "FAIL"
        or facts.reason == "exact"
    ):
        return ""
    if facts.best_bound is None:
        return f"The extrapolated value is {number(facts.best, 6)}."
    return f"The extrapolated value is {with_bound(facts.best, facts.best_bound)}."


def _together(setting: Setting) -> str:
    """Say what the order refers to if sizes are refined together, but not in proportion."""
    if setting.is_proportional:
        return ""
    first, *others = setting.sizes
    verb = "is" if len(others) == 1 else "are"
    return f"The order counts powers of {first}; {listed_words(others)} {verb} refined with it, not in proportion."
