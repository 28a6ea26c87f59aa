"""Facts in, words out: a sentence and an advice for every reason of a verdict on any ladder."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import Any

from vibsim.core.vocabulary import ORDER_TOLERANCE


@dataclass(frozen=True)
class Facts:
    """What the words on a ladder are made from; numbers are None where there are none."""

    quantity: str
    status: str
    reason: str
    h: tuple[float, ...]
    """Of all levels, the coarsest first."""
    order: float | None = None
    low: float | None = None
    high: float | None = None
    expected: float | None = None
    at_least: float | None = None
    error: float | None = None
    error_bound: float | None = None
    relative_error: float | None = None
    best: float | None = None
    best_bound: float | None = None
    is_exact_known: bool = False
    is_number: bool = True
    has_noise: bool = False
    """Whether the user stated the noise of the levels."""
    not_finite: tuple[float, ...] = ()
    """Step sizes of the levels that are not finite."""
    sizes: tuple[str, ...] = ("h",)
    is_proportional: bool = True
    interpolation: tuple[str, int] | None = None
    """Kind and order of an interpolation that hides the order."""
    notes: tuple[str, ...] = ()
    """What else may be wrong, where it does not pass."""
    parts: tuple[str, ...] = ()
    """Which part of the points is compared."""
    is_constant: bool = False
    """Whether all levels are the same, to the last digit."""


PLAIN_DIGITS = 5
"""Whole numbers of so many digits are written without a power of ten."""
MOST_DIGITS = 12
"""Of an extrapolated number in a sentence."""
LOOK_FOR = (
    "Look for a part of lower order, such as the first step, a formula at a boundary, a limiter, or an iteration that "
    "stops too early"
)
SENTENCES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "asymptotic": ("{quantity} converges with order {order}{as_expected}.", ""),
        "exact": (
            "The levels of {quantity} differ by {noise} only, so there is no order to measure.",
            "",
        ),
        "match": ("{quantity} is as expected.", ""),
        "order_low": (
            "{quantity} converges more slowly than expected, with order {order} instead of {wanted}.",
            LOOK_FOR + ". If the method promises no more here, expect that order.",
        ),
        "order_high": (
            "{quantity} converges faster than expected, with order {order} instead of {wanted}.",
            "Check the expected order. The leading error may vanish by symmetry here; other data would show it.",
        ),
        "mismatch": ("{quantity} is not as expected.", "Compare the expectation with the levels."),
        "wrong_limit": (
            "The levels of {quantity} approach each other, but not the exact {value}.",
            "Check the equation, its parameters and conditions, and the exact {value}. Finer levels will not help.",
        ),
        "unstable": (
            "{quantity} grows from level to level instead of approaching a limit.",
            "Check whether the step sizes are within the stability limit of the method.",
        ),
        "non_finite": (
            "{quantity} is not finite at {not_finite}.",
            "Find out why the solver breaks down there, or leave {these} out.",
        ),
        "pre_asymptotic": (
            "The levels of {quantity} do not show a settled order yet{estimate}.",
            "Add a finer level, such as {size} = {finer}.",
        ),
        "growing": (
            "The differences of {quantity} grow towards the finer levels{estimate}.",
            "Check that {size} is a step size, not a number of cells or steps. If it is a step size, add a finer "
            "level, such as {size} = {finer}.",
        ),
        "round_off": (
            "The differences of {quantity} have reached {floor}, so they do not show its order{estimate}.",
            "Use coarser levels, or compute {quantity} with less noise.",
        ),
        "oscillating": (
            "The differences of {quantity} change sign from level to level, so no order can be read from them.",
            "Add a finer level, such as {size} = {finer}, or judge another quantity.",
        ),
        "non_smooth": (
            "The differences of {quantity} follow no power of {size}{estimate}.",
            "Compare where the solution is smooth, or expect the order that a kink or jump allows.",
        ),
        "too_few_levels": (
            "{count} too few to judge the convergence of {quantity}. Three are needed, and four are better.",
            "Add a level, such as {size} = {finer}.",
        ),
        "not_applicable": (
            "{quantity} has no order to judge.",
            "Judge another quantity.",
        ),
        "interpolation": (
            "The order of {quantity} is hidden, because the {kind} interpolation to common points has order {own} "
            "itself{estimate}.",
            "{other_points}.",
        ),
    }
)
"""Reason to the templates of sentence and advice; ``interpolation`` is a case of ``not_applicable``, ``growing`` one of
``pre_asymptotic``."""


def describe(facts: Facts) -> tuple[str, str]:
    """Return the sentence on a ladder, and the advice; the advice on one that passed is empty."""
    key = "interpolation" if facts.interpolation else facts.reason
    if key == "pre_asymptotic" and facts.order is not None and facts.order < 0.0:
        key = "growing"
    phrases = _phrases(facts)
    sentence, advice = (template.format_map(phrases) for template in SENTENCES[key])
    more = [
        _higher_part(facts),
        _interval(facts),
        _error(facts),
        _best(facts),
        _together(facts),
        *facts.parts,
        _constant(facts),
    ]
    if facts.status == "PASS":
        return _joined([sentence, *more]), ""
    return _joined([sentence, *more]), _joined([advice, *facts.notes])


def _joined(parts: Sequence[str]) -> str:
    return " ".join(part for part in parts if part)


def _phrases(facts: Facts) -> dict[str, Any]:
    kind, own = facts.interpolation or ("", 0)
    count = len(facts.h)
    finer = facts.h[-1] * (facts.h[-1] / facts.h[-2] if count > 1 else 0.5)
    points = "Take levels that have the coarsest points in common (restrict: subset)"
    return {
        "quantity": facts.quantity,
        "order": order_with_interval(facts),
        "as_expected": _as_expected(facts),
        "wanted": _wanted(facts),
        "value": "value" if facts.is_number else "values",
        "noise": "the stated noise" if facts.has_noise else "round-off",
        "floor": "the stated noise" if facts.has_noise else "round-off or other noise",
        "not_finite": f"{facts.sizes[0]} = {listed(facts.not_finite)}",
        "these": "this level" if len(facts.not_finite) == 1 else "these levels",
        "estimate": f" (the last estimate is {number(facts.order, 3)})"
        if facts.order is not None
        else "",
        "size": facts.sizes[0],
        "finer": number(finer, 3),
        "count": "One level is" if count == 1 else f"{count} levels are",
        "kind": kind,
        "own": own,
        "other_points": f"{points}, or use restrict: cubic" if kind == "linear" else points,
    }


def order_with_interval(facts: Facts) -> str:
    """Write an order with its interval, ``2.00 (1.97 to 2.03)``."""
    if facts.order is None:
        return "unknown"
    if facts.low is None or facts.high is None:
        return f"{facts.order:.2f}"
    places = 3 if facts.high - facts.low < 0.02 else 2
    return f"{facts.order:.{places}f} ({facts.low:.{places}f} to {facts.high:.{places}f})"


def _as_expected(facts: Facts) -> str:
    if facts.expected is not None:
        return ", as expected"
    return f", at least {facts.at_least:g} as expected" if facts.at_least is not None else ""


def higher_part(order: float, expected: float, tolerance: float) -> str:
    """Say why the measured order is away from the one that dominates; empty where it is near."""
    if abs(order - expected) <= tolerance:
        return ""
    moves = "raises" if order > expected else "lowers"
    return f"A part of the error of higher order is still seen. It {moves} the measured order."


def _higher_part(facts: Facts) -> str:
    if facts.reason != "asymptotic" or facts.expected is None or facts.order is None:
        return ""
    return higher_part(facts.order, facts.expected, ORDER_TOLERANCE)


def _wanted(facts: Facts) -> str:
    if facts.expected is not None:
        return f"{facts.expected:g}"
    return f"at least {facts.at_least:g}" if facts.at_least is not None else "another one"


def _interval(facts: Facts) -> str:
    """Say between which orders the levels leave it open."""
    if facts.reason != "pre_asymptotic" or facts.low is None or facts.high is None:
        return ""
    return f"They are consistent with orders from {facts.low:.2f} to {facts.high:.2f}."


def _constant(facts: Facts) -> str:
    """Doubt levels that do not differ at all."""
    if facts.reason != "exact" or not facts.is_constant:
        return ""
    return (
        f"All levels are the same to the last digit. Check that the solver used {facts.sizes[0]}."
    )


def _error(facts: Facts) -> str:
    """Say the error of the finest level with its bound."""
    if facts.error is None:
        return ""
    if facts.reason == "exact" and facts.error_bound is not None:
        return f"The error of the finest level is at most {at_most(facts.error_bound)}."
    size = number(abs(facts.error), 2)
    share = percent(facts.relative_error)
    share = f" ({share})" if share else ""
    bound = facts.error_bound
    limit = "" if facts.is_exact_known or bound is None else f", at most {at_most(bound)}"
    return f"The error of the finest level is {size}{share}{limit}."


def _best(facts: Facts) -> str:
    """Say the extrapolated number with its bound."""
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


def _together(facts: Facts) -> str:
    """Say what an order counts where sizes are refined together, but not in proportion."""
    if facts.is_proportional:
        return ""
    first, *others = facts.sizes
    verb = "is" if len(others) == 1 else "are"
    return f"The order counts powers of {first}; {listed_words(others)} {verb} refined with it, not in proportion."


def number(value: float | None, digits: int) -> str:
    """Write a number with so many significant digits, ``3.1e-4``."""
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
    """Return how many significant digits show the smallest difference of neighbouring values, 8 at least."""
    known = [value for value in values if value is not None]
    steps = [abs(a - b) for a, b in pairwise(known) if a != b]
    if not steps:
        return 8
    digits = 2 + math.log10(max(map(abs, known))) - math.log10(min(steps))
    return math.ceil(min(max(8, digits), 17))


def at_most(bound: float) -> str:
    """Write a bound with two digits, rounded up."""
    if not 0.0 < bound < math.inf:
        return number(bound, 2)
    text = number(bound, 2)
    if float(text) >= bound:
        return text
    power = math.floor(math.log10(bound)) - 1
    return number((round(bound / 10.0**power) + 1) * 10.0**power, 2)


def percent(share: float | None) -> str:
    """Write a share in percent; empty where an error is as large as what it belongs to."""
    return f"{number(100.0 * share, 2)} %" if share and share < 1.0 else ""


def with_bound(value: float, bound: float) -> str:
    """Write a number as far as its bound allows, with the bound: ``0.97130, within 2.1e-5``."""
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
