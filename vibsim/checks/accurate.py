"""The check ``accurate``: whether the error of the finest level is within the accuracy that the check requires.

The error is measured in the L2 norm over time. It is the true error if the exact solution is known. Otherwise it is
estimated by extrapolation, and decides only if the order of the quantity is known: a bound that rests on levels without
a known order is unreliable.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from vibsim.checks.fields import LEVEL, Field, Measured
from vibsim.checks.notation import PLAIN, Notation, beside
from vibsim.checks.number_units import unit_of_quantity
from vibsim.checks.outcome import Judged, as_expected
from vibsim.checks.sentences import (
    FINER,
    MOST_FINER,
    NOT_FINITE,
    WRONG_LIMIT_ADVICE,
    Description,
    MemberFacts,
    add_levels,
    cost_in_words,
)
from vibsim.comparison.finest_error import FinestError, error_of_finest
from vibsim.comparison.order_verdict import judgement
from vibsim.comparison.quantity_comparison import Compared, Comparison
from vibsim.convergence.reasons import code, first_reason, is_one_of, is_open
from vibsim.convergence.verdict import Judgement
from vibsim.core.array_types import Codes
from vibsim.core.record import Record
from vibsim.core.vocabulary import ERROR_FACTS, REASON_NAMES, TYPICAL_NORM
from vibsim.elementary import on_arrays
from vibsim.experiment import Experiment
from vibsim.experiment.schema.checks import AccurateCheck
from vibsim.observe.member_block import MemberBlock

BASES = ("none", "exact", "extrapolated")
"""References of an error; files store an index into this tuple."""
NONE, EXACT, EXTRAPOLATED = range(len(BASES))
_TEXTS = (
    "L2 norm over time of the error of the finest level, in the unit of the quantity times the square root of s",
    "upper bound of the error of the finest level, in the unit of that error",
    "error of the finest level over the L2 norm of the solution",
)
ERROR = dict(zip(ERROR_FACTS, map(Field, _TEXTS), strict=True))
FIELDS = {
    **ERROR,
    "size": Field("L2 norm over time of the solution, in the unit of the error"),
    "accuracy": Field("error that is allowed, relative or absolute as the check asks", dims=()),
    "basis": Field("what the error is measured against", np.int8, BASES),
    "order_reason": Field("reason of the verdict on the promised order", np.int8, REASON_NAMES),
    "level": LEVEL,
    "level_needed": Field(
        "level that probably reaches the accuracy by the measured order, -1 unknown",
        np.int16,
        none=-1,
    ),
}
ORDER_KNOWN = "asymptotic", "exact", "order_low", "order_high"
"""Reasons of verdicts that state an order."""


def measure(block: MemberBlock, compared: Compared, check: AccurateCheck) -> Measured:
    """Return the measured fields of a check."""
    quantity = compared[check.accurate]
    finest, judged = error_of_finest(quantity), judgement(quantity, TYPICAL_NORM)
    # an adaptive scheme has no order, but may have a true error
    without_error = (judged.reason == code("not_applicable")) & ~(
        block.adaptive[:, None] & finest.is_true
    )
    basis = np.select([without_error, finest.is_true], [NONE, EXACT], EXTRAPOLATED)
    return {
        **facts_of_error(finest),
        "size": finest.size,
        "accuracy": check.accuracy,
        "basis": basis,
        "order_reason": judged.reason,
        "level": block.grid.levels[-1],
        "level_needed": _level_needed(block.grid.levels[-1], finest, judged, check),
    }


def facts_of_error(finest: FinestError) -> dict[str, Any]:
    """Return the values of `ERROR`."""
    with np.errstate(all="ignore"):
        relative = np.where(finest.size > 0.0, finest.error / finest.size, np.nan)
    return {"error": finest.error, "error_bound": finest.bound, "relative_error": relative}


def known_error(q: Comparison) -> dict[str, Any]:
    """Return the values of `ERROR` where the error of a quantity is reliable, NaN elsewhere."""
    finest, reason = error_of_finest(q), judgement(q, TYPICAL_NORM).reason
    is_reliable = finest.is_true & ~is_one_of(reason, "unstable", "non_finite", "not_applicable")
    is_reliable |= is_one_of(reason, *ORDER_KNOWN)
    facts = facts_of_error(finest)
    return {name: np.where(is_reliable, values, np.nan) for name, values in facts.items()}


def error_in_words(f: MemberFacts, quantity: str, norm: str) -> str:
    """State the root-mean-square error over time of the finest level; empty if it is unknown.

    It includes the last point, even if the norm of the check excludes it.
    """
    error, bound, relative = (f.fact(name) for name in ERROR)
    if not math.isfinite(bound):
        return ""
    number, (rms, largest) = f.notation.number, (_mean_square(f, x) for x in (error, bound))
    unit = unit_of_quantity(f.record, quantity)
    where = ", its last point included," if norm == "linf_interior" else ""
    sentence = f" The root-mean-square error of the finest level{where} is {number(rms, 2)} {unit}"
    sentence = sentence.rstrip()
    if math.isfinite(relative):
        sentence += f" ({number(relative, 2)} of its size)"
    # the bound of a true error has the same digits
    if number(largest, 2) != number(rms, 2):
        sentence += f", at most {number(largest, 2)}"
    return f"{sentence}."


def _mean_square(f: MemberFacts, error: float) -> float:
    """Return the root mean square over time of an error, from its L2 norm."""
    duration = f.record.step(-1, f.case) * f.experiment.steps(int(f.record["level"][-1]))
    return error / math.sqrt(duration)


def _level_needed(last: int, finest: FinestError, judged: Judgement, check: AccurateCheck) -> Codes:
    """Return the level whose bound probably reaches the accuracy, shape (scheme, case); -1 if unknown."""
    with np.errstate(all="ignore"):
        allowed = check.accuracy * (finest.size if check.is_relative else 1.0)
        steps = np.ceil(on_arrays.log2(finest.bound / allowed) / judged.order)
        # round-off and a wrong limit do not vanish with the step
        known = (judged.order > 0.0) & (steps >= 1.0) & (steps <= MOST_FINER)
        known &= (finest.round_off < allowed) & (judged.reason != code("wrong_limit"))
    return np.where(known, last + np.where(known, steps, 0.0), -1.0).astype(np.int16)


def judge(experiment: Experiment, record: Record, check: AccurateCheck, facts: Measured) -> Judged:
    """Compare the error of the finest level with the required accuracy."""
    error, bound, order_reason = (facts["error"], facts["error_bound"], facts["order_reason"])
    is_true, size = facts["basis"] == EXACT, facts["size"]
    allowed = facts["accuracy"] * (size if check.is_relative else np.ones_like(size))
    # lower bound, as far below the error as the upper bound is above it
    least = np.maximum(2.0 * error - bound, 0.0)
    is_reliable = is_true | is_one_of(order_reason, *ORDER_KNOWN)
    # a coarse level may be unstable although the finest one follows the solution
    is_unstable = is_one_of(order_reason, "unstable") & ~(is_true & (error < size))
    cases = [
        (is_unstable | is_one_of(order_reason, "non_finite"), order_reason),
        ((facts["basis"] == NONE) | ~(allowed > 0.0), "not_applicable"),
        (is_reliable & (bound < allowed), "match"),
        (is_reliable & (least > allowed), "mismatch"),
        (is_true, "round_off"),
        (is_open(order_reason), order_reason),
    ]
    reason = first_reason(cases, "pre_asymptotic")
    with np.errstate(all="ignore"):
        away = bound / allowed
    return Judged(reason, away, as_expected(check.expect, reason))


def rule(check: AccurateCheck, notation: Notation = PLAIN) -> str:
    """Say which accuracy is required."""
    accuracy = notation.number(check.accuracy)
    return f"accurate to {accuracy} of its size" if check.is_relative else f"accurate to {accuracy}"


def describe(f: MemberFacts, check: AccurateCheck) -> Description:
    """State the error, and what to change if it is not small enough."""
    s = _Phrases(f, check)
    what = s.what
    match f.reason:
        case "match":
            return Description(
                f"{s.subject} is accurate to {s.error()} at level {s.level}{s.bound('at most', s.most())}, as asked "
                f"({s.asked}).{s.mean()}",
                "",
                f"{s.error()} at level {s.level}{s.bound('at most', s.most())}",
            )
        case "mismatch":
            return Description(
                f"{s.subject} is not as accurate as asked ({s.asked}). The error at level {s.level} is {s.error()}"
                f"{s.bound('at least', s.least())}.{s.mean()}",
                s.finer(),
                f"{s.error()} at level {s.level}{s.bound('at least', s.least())}",
            )
        case "unstable":
            return Description(
                f"{s.subject} is unstable, so it is not accurate.",
                "Start `levels:` at a finer level, or take another scheme (`schemes:`).",
            )
        case "non_finite":
            return Description(NOT_FINITE[0].format(s.subject), NOT_FINITE[1])
        case "not_applicable" if f.word("basis") == "none":
            return Description(
                f"{s.subject} has no error to judge here, because it does not change, does not exist, or its scheme "
                "chooses its own steps.",
                "Choose a quantity (`accurate:`), `initial:` values and `schemes:` with a motion to judge.",
            )
        case "not_applicable":
            return Description(
                f"The solution for {what} is 0, so there is no relative error.",
                "Give `absolute:` in place of `relative:`.",
            )
        case "round_off":
            if f.word("basis") == "exact":
                return Description(
                    f"{s.open()} Round-off alone may be as large.",
                    f"Change `{check.key}:`, or take an arithmetic with less round-off (`arithmetic: compensated`).",
                )
    if f.word("order_reason") in ORDER_KNOWN:
        return Description(s.open(), s.finer())
    return Description(
        f"{s.subject} may or may not be as accurate as asked ({s.asked}). The order is not known, so the estimate of "
        f"the error at level {s.level}{s.estimate()} cannot be trusted.",
        s.more_levels(),
    )


class _Phrases:
    """Phrases of sentences on an error."""

    def __init__(self, f: MemberFacts, check: AccurateCheck) -> None:
        self.f, self.check = f, check
        self.what = f.notation.quantity(check.accurate)
        self.subject = f.notation.opening(self.what)
        self.level: int = f.fact("level")
        self.asked = f.notation.number(check.accuracy)
        self.cost = partial(cost_in_words, f.experiment)

    def _counted(self, error: float) -> str:
        """Write an error, relative or absolute as in the check."""
        if self.check.is_relative:
            size = self.f.fact("size")
            error = error / size if size > 0.0 else math.nan
        return beside(self.f.notation, error, self.check.accuracy)

    def mean(self) -> str:
        """State the root-mean-square error in the unit of the quantity, for a check of an absolute norm."""
        if self.check.is_relative:
            return ""
        mean = self.f.notation.number(_mean_square(self.f, self.f.fact("error")), 2)
        unit = unit_of_quantity(self.f.record, self.check.accurate)
        sentence = f" These are L2 norms over time. The root-mean-square error is {mean} {unit}"
        return f"{sentence.rstrip()}."

    def error(self) -> str:
        """Write the error."""
        phrase = self._counted(self.f.fact("error"))
        return f"{phrase} of its size" if self.check.is_relative else phrase

    def most(self) -> str:
        return self._counted(self.f.fact("error_bound"))

    def least(self) -> str:
        return self._counted(max(2.0 * self.f.fact("error") - self.f.fact("error_bound"), 0.0))

    def bound(self, word: str, limit: str) -> str:
        """Write a bound of the error; empty if its digits are those of the error, which is known that well."""
        return "" if limit == self._counted(self.f.fact("error")) else f" ({word} {limit})"

    def open(self) -> str:
        """Say that the required accuracy lies between the bounds of the error."""
        return (
            f"{self.subject} may or may not be as accurate as asked ({self.asked}). The error at level {self.level} is "
            f"{self.error()}, between {self.least()} and {self.most()}.{self.mean()}"
        )

    def estimate(self) -> str:
        return f" ({self.error()})" if math.isfinite(self.f.fact("error")) else ""

    def finer(self) -> str:
        """Name the level that probably reaches the accuracy, if it is known."""
        change, needed = f"hange `{self.check.key}:`", self.f.fact("level_needed")
        if self.f.word("order_reason") == "wrong_limit":
            return WRONG_LIMIT_ADVICE.format(scheme=self.f.scheme_name)
        if needed < 0:
            return f"Take finer `levels:` or a scheme of higher order (`schemes:`), or c{change}."
        add = add_levels(self.level, needed - self.level, self.cost)
        return f"A{add}, which is probably enough by the measured order, or c{change}."

    def more_levels(self) -> str:
        """Say how to find the order."""
        ask = f"The check `{{converges: {self.check.accurate}}}` says what its order needs"
        if self.f.reason in ("pre_asymptotic", "too_few_levels", "oscillating"):
            return f"A{add_levels(self.level, FINER, self.cost)}. {ask}."
        return f"{ask}. The bound of the error rests on it."
