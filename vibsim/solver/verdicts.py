"""Decide a check on the levels of a user's solver, for one member: the verdict, its facts and its sentences."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vibsim.checks.accurate import ORDER_KNOWN
from vibsim.checks.outcome import as_expected
from vibsim.checks.solver_facts import SOLVER_FACTS
from vibsim.convergence import LadderVerdict
from vibsim.convergence.reasons import code
from vibsim.convergence.study.common_points import common_values
from vibsim.convergence.study.grid_values import GridValues
from vibsim.convergence.study.judge import verdicts
from vibsim.convergence.study.notation import at_most, number
from vibsim.core.array_types import Floats
from vibsim.core.errors import InputError, VibsimError
from vibsim.core.vocabulary import REASONS, STATUSES
from vibsim.experiment.schema.checks import Expect
from vibsim.experiment.schema.solver import (
    QuantitySection,
    SolverAccurateCheck,
    SolverCheck,
    SolverConvergesCheck,
)
from vibsim.experiment.solver import SolverExperiment
from vibsim.formula import parse
from vibsim.formula import values as formula_values


@dataclass(frozen=True)
class SolverResult:
    """The result of one check for one member."""

    member: int
    verdict: LadderVerdict
    """Verdict with the status, reason, sentence and advice of the check."""
    compared: str
    """The status after comparison with the expected one."""
    facts: dict[str, Any]
    away: float
    """Distance of the outcome from the expectation; larger is worse."""


def judge(
    experiment: SolverExperiment, check: SolverCheck, member: int, values: Sequence[GridValues]
) -> SolverResult:
    """Judge the levels of a quantity, the coarsest first.

    Raises
    ------
    VibsimError
        Where the levels have no common points.
    """
    promise = _promise(experiment, check)
    quantity = experiment.quantities[str(check.about)]
    restrict = quantity.restrict
    try:
        (verdict,) = verdicts(
            _steps(experiment),
            values,
            quantity=check.about,
            order=promise.order if promise else None,
            at_least=promise.at_least if promise else None,
            exact=_exact(quantity, experiment.parameters_of(member), values[0].dims),
            noise=quantity.noise,
            restrict=restrict,
        )
    except InputError as error:
        fault = error.faults[0]
        key = fault.key if fault.key.startswith("level") else _misfit(values, restrict) + fault.key
        parts = (str(check.about), key, fault.value, fault.rule, fault.hint)
        raise VibsimError(": ".join(dict.fromkeys(filter(None, parts)))) from None
    if isinstance(check, SolverAccurateCheck):
        verdict, facts, away = _accuracy(check, verdict)
    else:
        facts, away = _order(experiment, check, verdict)
    (status,) = as_expected(check.expect, np.array([code(verdict.reason)]))
    return SolverResult(member, verdict, STATUSES[status], facts, away)


def _exact(
    quantity: QuantitySection, parameters: Mapping[str, Any], dims: Sequence[str]
) -> Callable[..., Floats] | Floats | None:
    """Return the exact value of a quantity, as a function of its coordinates if it has any; None if unknown."""
    if quantity.exact is None:
        return None
    numbers = {name: value for name, value in parameters.items() if not isinstance(value, str)}
    tree = parse(quantity.exact, (*(quantity.coordinates or ()), *numbers))

    def at(*points: Floats) -> Floats:
        return formula_values(tree, {**numbers, **dict(zip(dims, points, strict=True))})

    return at if dims else at()


def _misfit(values: Sequence[GridValues], restrict: str) -> str:
    """Return the first level that cannot be compared with the coarsest one, as text; empty if all can."""
    for level in range(1, len(values)):
        try:
            common_values([values[0], values[level]], restrict, None)
        except InputError:
            return f"level {level} beside level 0: "
    return ""


def _promise(experiment: SolverExperiment, check: SolverCheck) -> SolverConvergesCheck | None:
    """Return the check with the expected order: for an `accurate` check, another check of the same quantity, if any."""
    if isinstance(check, SolverConvergesCheck):
        return check
    for other in experiment.checks:
        matches = other.about == check.about and other.expect == Expect()
        if matches and isinstance(other, SolverConvergesCheck):
            return other
    return None


def _steps(experiment: SolverExperiment) -> dict[str, tuple[float, ...]]:
    """Return the step size, and other sizes that decrease with it; numbers of cells, for example, do not."""
    falling = {
        name: values
        for name, values in experiment.sizes.items()
        if min(values) > 0.0 and all(np.diff(values) < 0.0)
    }
    return {experiment.step: experiment.sizes[experiment.step], **falling}


def _order(
    experiment: SolverExperiment, check: SolverConvergesCheck, verdict: LadderVerdict
) -> tuple[dict[str, Any], float]:
    """Return the facts on an order, and its distance from the expected one."""
    levels = [experiment.sizes[experiment.step].index(h) for h in verdict.h_used]
    promised = check.order or check.at_least
    facts = {name: getattr(verdict, name, None) for name in SOLVER_FACTS["converges"]}
    facts |= {
        "promised": promised,
        "levels": [levels[0], levels[-1]] if levels else None,
        "h_used": list(verdict.h_used),
    }
    order = verdict.order
    if verdict.reason == "exact":
        # an exact result has no order to compare
        return facts, 0.0
    return facts, math.inf if order is None else abs(order - (promised or order))


def _accuracy(
    check: SolverAccurateCheck, verdict: LadderVerdict
) -> tuple[LadderVerdict, dict[str, Any], float]:
    """Return the verdict on an error, its facts, and the ratio of the error bound to the allowed error."""
    size = abs(verdict.levels[-1].value or 0.0)
    allowed = check.accuracy * (size if check.is_relative else 1.0)
    error = None if verdict.error is None else abs(verdict.error)
    bound = verdict.error_bound
    is_error_known = verdict.is_exact_known or verdict.reason in ORDER_KNOWN
    decides = is_error_known and error is not None and bound is not None
    if verdict.reason == "non_finite":
        reason = "non_finite"
    elif not allowed > 0.0:
        reason = "not_applicable"
    elif decides and error is not None and bound is not None:
        # the lower bound is as far below the error as the upper bound is above it
        least = max(2.0 * error - bound, 0.0)
        reason = "match" if bound < allowed else "mismatch" if least > allowed else "pre_asymptotic"
    else:
        reason = verdict.reason
    facts = {name: getattr(verdict, name, None) for name in SOLVER_FACTS["accurate"]}
    facts |= {"size": size, "accuracy": check.accuracy}
    sentence, advice = _words(check, verdict, reason, size, decides)
    decided = replace(
        verdict, status=REASONS[reason], reason=reason, sentence=sentence, advice=advice
    )
    away = math.inf if bound is None or not allowed > 0.0 else bound / allowed
    return decided, facts, away


def _words(
    check: SolverAccurateCheck, verdict: LadderVerdict, reason: str, size: float, decides: bool
) -> tuple[str, str]:
    """Return sentence and advice of a verdict on an error."""
    unit, of_size = (size, " of its size") if check.is_relative else (1.0, "")
    accuracy = f"as asked ({number(check.accuracy, 3)}{of_size})"
    name, h = verdict.quantity, f"{verdict.size_name} = {number(verdict.levels[-1].h, 6)}"
    if reason == "non_finite":
        return verdict.sentence, verdict.advice
    if reason == "not_applicable":
        return (
            f"{name} is 0, so it has no relative error.",
            "Give `absolute:` in place of `relative:`.",
        )
    if not decides:
        # the sentence on the order states a bound of the error, which holds only if the levels converge
        why = (
            verdict.sentence
            if verdict.error is None
            else (
                f"The order is not known, so the estimate of the error at {h} ({number(abs(verdict.error) / unit, 2)}"
                f"{of_size}) cannot be trusted."
            )
        )
        finding = f"{name} may or may not be as accurate {accuracy}. {why}"
        return finding, verdict.advice or "Add a finer level."
    error, bound = abs(verdict.error or 0.0) / unit, (verdict.error_bound or 0.0) / unit
    least = max(2.0 * error - bound, 0.0)
    finding = f"The error at {h} is {number(error, 2)}{of_size}"
    finer = f"Add a finer level, or change `{check.key}:`."
    if reason == "match":
        return f"{name} is accurate {accuracy}. {finding}, at most {at_most(bound)}.", ""
    if reason == "mismatch":
        return f"{name} is not accurate {accuracy}. {finding}, at least {number(least, 2)}.", finer
    between = f"between {number(least, 2)} and {at_most(bound)}"
    return f"{name} may or may not be as accurate {accuracy}. {finding}, {between}.", finer


def expected(check: SolverCheck) -> str:
    """Return the expectation of a check in words."""
    if isinstance(check, SolverAccurateCheck):
        of_size = " of its size" if check.is_relative else ""
        text = f"accurate to {number(check.accuracy, 3)}{of_size}"
    elif check.order is not None:
        text = f"order {check.order:g}"
    elif check.at_least is not None:
        text = f"order {check.at_least:g} at least"
    else:
        text = "an order that can be believed"
    expect = check.expect
    if (expect.status, expect.reason) == ("PASS", None):
        return text
    reason = f" ({expect.reason})" if expect.reason else ""
    return f"{text}: {expect.status}{reason}"
