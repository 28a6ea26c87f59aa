"""What is decided of the levels of a solver: a check of a quantity, of one member, with its facts and its words."""

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
from vibsim.convergence.study.judgement import verdicts
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
    """What was decided of one check and one member."""

    member: int
    verdict: LadderVerdict
    """With status, reason, sentence and advice of the check."""
    compared: str
    """The status after comparison with what was expected."""
    facts: dict[str, Any]
    away: float
    """How far the outcome is from what was asked; larger is worse."""


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
        (found,) = verdicts(
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
        key = fault.key if fault.key.startswith("level") else _place(values, restrict) + fault.key
        parts = (str(check.about), key, fault.value, fault.rule, fault.hint)
        raise VibsimError(": ".join(dict.fromkeys(filter(None, parts)))) from None
    if isinstance(check, SolverAccurateCheck):
        found, facts, away = _accuracy(check, found)
    else:
        facts, away = _order(experiment, check, found)
    (status,) = as_expected(check.expect, np.array([code(found.reason)]))
    return SolverResult(member, found, STATUSES[status], facts, away)


def _exact(
    quantity: QuantitySection, parameters: Mapping[str, Any], dims: Sequence[str]
) -> Callable[..., Floats] | Floats | None:
    """Return the exact values of a quantity of a member, as a function of its coordinates where it has some."""
    if quantity.exact is None:
        return None
    numbers = {name: value for name, value in parameters.items() if not isinstance(value, str)}
    tree = parse(quantity.exact, (*(quantity.coordinates or ()), *numbers))

    def at(*points: Floats) -> Floats:
        return formula_values(tree, {**numbers, **dict(zip(dims, points, strict=True))})

    return at if dims else at()


def _place(values: Sequence[GridValues], restrict: str) -> str:
    """Name the first level that cannot be compared with the coarsest one; empty where each can."""
    for level in range(1, len(values)):
        try:
            common_values([values[0], values[level]], restrict, None)
        except InputError:
            return f"level {level} beside level 0: "
    return ""


def _promise(experiment: SolverExperiment, check: SolverCheck) -> SolverConvergesCheck | None:
    """Return the check that says which order is expected: of an accuracy another one of the same quantity, if any."""
    if isinstance(check, SolverConvergesCheck):
        return check
    for other in experiment.checks:
        is_ours = other.about == check.about and other.expect == Expect()
        if is_ours and isinstance(other, SolverConvergesCheck):
            return other
    return None


def _steps(experiment: SolverExperiment) -> dict[str, tuple[float, ...]]:
    """Return the sizes that fall with the step size; others, such as numbers of cells, are no sizes of steps."""
    falling = {
        name: values
        for name, values in experiment.sizes.items()
        if min(values) > 0.0 and all(np.diff(values) < 0.0)
    }
    return {experiment.step: experiment.sizes[experiment.step], **falling}


def _order(
    experiment: SolverExperiment, check: SolverConvergesCheck, found: LadderVerdict
) -> tuple[dict[str, Any], float]:
    """Return the facts on an order, and how far it is from the expected one."""
    places = [experiment.sizes[experiment.step].index(h) for h in found.h_used]
    wanted = check.order or check.at_least
    facts = {name: getattr(found, name, None) for name in SOLVER_FACTS["converges"]}
    facts |= {
        "promised": wanted,
        "levels": [places[0], places[-1]] if places else None,
        "h_used": list(found.h_used),
    }
    if found.reason == "exact":
        # no order that could be hard to reach
        return facts, 0.0
    return facts, math.inf if found.order is None else abs(found.order - (wanted or found.order))


def _accuracy(
    check: SolverAccurateCheck, found: LadderVerdict
) -> tuple[LadderVerdict, dict[str, Any], float]:
    """Return the verdict on an error, its facts, and the bound of the error over what is allowed."""
    size = abs(found.levels[-1].value or 0.0)
    allowed = check.accuracy * (size if check.is_relative else 1.0)
    error = None if found.error is None else abs(found.error)
    bound = found.error_bound
    is_error_known = found.is_exact_known or found.reason in ORDER_KNOWN
    decides = is_error_known and error is not None and bound is not None
    if found.reason == "non_finite":
        reason = "non_finite"
    elif not allowed > 0.0:
        reason = "not_applicable"
    elif decides and error is not None and bound is not None:
        # as far below the error as the bound is above it
        least = max(2.0 * error - bound, 0.0)
        reason = "match" if bound < allowed else "mismatch" if least > allowed else "pre_asymptotic"
    else:
        reason = found.reason
    facts = {name: getattr(found, name, None) for name in SOLVER_FACTS["accurate"]}
    facts |= {"size": size, "accuracy": check.accuracy}
    sentence, advice = _words(check, found, reason, size, decides)
    changed = replace(
        found, status=REASONS[reason], reason=reason, sentence=sentence, advice=advice
    )
    away = math.inf if bound is None or not allowed > 0.0 else bound / allowed
    return changed, facts, away


def _words(
    check: SolverAccurateCheck, found: LadderVerdict, reason: str, size: float, decides: bool
) -> tuple[str, str]:
    """Return sentence and advice of a verdict on an error."""
    unit, of_size = (size, " of its size") if check.is_relative else (1.0, "")
    accuracy = f"as asked ({number(check.accuracy, 3)}{of_size})"
    name, h = found.quantity, f"{found.size_name} = {number(found.levels[-1].h, 6)}"
    if reason == "non_finite":
        return found.sentence, found.advice
    if reason == "not_applicable":
        return (
            f"{name} is 0, so it has no relative error.",
            "Give `absolute:` in place of `relative:`.",
        )
    if not decides:
        finding = f"{name} may or may not be as accurate {accuracy}. {found.sentence}"
        return finding, found.advice or "Add a finer level."
    error, bound = abs(found.error or 0.0) / unit, (found.error_bound or 0.0) / unit
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
    """Say what a check expects."""
    if isinstance(check, SolverAccurateCheck):
        of_size = " of its size" if check.is_relative else ""
        wanted = f"accurate to {number(check.accuracy, 3)}{of_size}"
    elif check.order is not None:
        wanted = f"order {check.order:g}"
    elif check.at_least is not None:
        wanted = f"order {check.at_least:g} at least"
    else:
        wanted = "an order that can be believed"
    expect = check.expect
    if (expect.status, expect.reason) == ("PASS", None):
        return wanted
    reason = f" ({expect.reason})" if expect.reason else ""
    return f"{wanted}: {expect.status}{reason}"
