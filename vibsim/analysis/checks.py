"""The checks of an experiment: what was measured, what was expected, and whether they agree.

A check is decided by its worst result: FAIL before INCONCLUSIVE before PASS. A number that is not finite never passes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis import values
from vibsim.analysis.converges import converges, judge_check
from vibsim.analysis.outcome import FAIL, PASS, Outcome, number_at
from vibsim.analysis.valued import valued
from vibsim.errors import VibsimError
from vibsim.record import Record
from vibsim.vocabulary import REASON_NAMES, STATUSES

if TYPE_CHECKING:
    import xarray

    from vibsim.spec import Experiment
    from vibsim.spec.checks import ClaimCheck, ConvergesCheck, ValueCheck

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Result:
    """What was measured of one scheme and one member."""

    scheme: str
    case: int
    """Global index of the member."""
    status: str
    """The measured one, whatever was expected."""
    reason: str
    order: float | None
    interval: tuple[float, float] | None
    levels: tuple[int, int] | None
    """First and last level that the order rests on."""
    value: float | None


@dataclass(frozen=True)
class Verdict:
    """The verdict on one check."""

    id: str
    kind: str
    text: str
    quantity: str | None
    expected: str
    status: str
    reason: str
    advice: str
    """One sentence on what to change in the YAML; empty for a PASS."""
    results: tuple[Result, ...]
    """Worst first."""
    counts: dict[str, int]
    """Number of results by status, compared with what was expected."""


def verdicts(experiment: Experiment, convergence: xarray.Dataset | Record) -> list[Verdict]:
    """Decide every check of an experiment.

    Parameters
    ----------
    convergence
        What `analyse` returned for the same experiment.

    Raises
    ------
    VibsimError
        Where `convergence` was made without one of the checks.
    """
    record = convergence if isinstance(convergence, Record) else Record.from_xarray(convergence)
    known = record.words("check") if "check" in record else []
    missing = [check.id for check in experiment.checks if check.id not in known]
    if missing:
        raise VibsimError(f"the analysis knows {known}, not {missing}: analyse the levels again")
    return [
        _claim(experiment, record, check, known.index(check.id))
        if check.kind == "claim"
        else _verdict(check, _measure(experiment, record, check, known.index(check.id)))
        for check in experiment.checks
    ]


def measured_numbers(
    experiment: Experiment, record: Record, levels: Mapping[int, Record]
) -> Floats:
    """Return the number behind every check, shape (check, scheme, case).

    Parameters
    ----------
    record
        Convergence Record without ``check_value``.
    levels
        The level Records that it was made from.
    """
    shape = (len(record["scheme"]), len(record["case"]))
    numbers = np.full((len(experiment.checks), *shape), np.nan)
    for i, check in enumerate(experiment.checks):
        inner = check.measured
        if inner.kind == "converges":
            numbers[i] = judge_check(experiment, record, inner)[0].order
        else:
            at = inner.at
            place = values.Place(record, levels, inner.quantity or "", at.level, at.t, at.step)
            numbers[i] = values.value(inner.value, place)
    return numbers


def _measure(
    experiment: Experiment, record: Record, check: ConvergesCheck | ValueCheck, index: int
) -> Outcome:
    if check.kind == "converges":
        return converges(experiment, record, check)
    return valued(record, check, record["check_value"][index])


def _verdict(check: ConvergesCheck | ValueCheck, outcome: Outcome) -> Verdict:
    """Decide a check by its worst result."""
    if not outcome.schemes or not outcome.case_index:
        raise VibsimError(
            f"check {check.id}: it applies to no scheme or no member of the experiment"
        )
    scheme, case = outcome.worst()
    status = int(outcome.compared[scheme, case])
    reason = _compared_reason(outcome, scheme, case)
    return Verdict(
        id=check.id,
        kind=check.kind,
        text=_told(outcome, scheme, case, reason),
        quantity=outcome.quantity,
        expected=outcome.expected,
        status=STATUSES[status],
        reason=reason,
        advice="" if status == PASS else outcome.advise(scheme, case) or _CORRECT,
        results=tuple(_results(outcome)),
        counts=outcome.counts(),
    )


_CORRECT = "Correct what the check expects (`expect:`), or find out why it turned out otherwise."


def _compared_reason(outcome: Outcome, scheme: int, case: int) -> str:
    """Return the measured reason where a PASS was expected, else whether the outcome is the expected one."""
    status, measured = int(outcome.compared[scheme, case]), int(outcome.status[scheme, case])
    if status == PASS and not outcome.expects_pass:
        return "match"
    if status == FAIL and (not outcome.expects_pass or measured == PASS):
        return "mismatch"
    return REASON_NAMES[int(outcome.reason[scheme, case])]


def _told(outcome: Outcome, scheme: int, case: int, reason: str) -> str:
    """Say what was measured where it decides, and of how many results that is so."""
    told = outcome.tell(scheme, case)
    if outcome.value is None and reason == "match":
        told += f" That is what the check expects ({outcome.expected})."
    elif outcome.value is None and reason == "mismatch":
        told += f" The check expects {outcome.expected}."
    total = len(outcome.schemes) * len(outcome.case_index)
    if total == 1:
        return told
    status = STATUSES[int(outcome.compared[scheme, case])]
    where = f"scheme {outcome.schemes[outcome.scheme_index.index(scheme)]}"
    if len(outcome.case_index) > 1:
        where += f", case {int(outcome.cases[case])}"
    return f"{status} in {outcome.counts()[status]} of {total} results; {where} decides: {told}"


def _results(outcome: Outcome) -> list[Result]:
    judged = outcome.judged

    def one(scheme: int, case: int) -> Result:
        order = low = high = None
        levels = None
        if judged is not None and np.isfinite(judged.order[scheme, case]):
            order, low, high = (
                number_at(a, scheme, case) for a in (judged.order, judged.low, judged.high)
            )
            levels = int(judged.first[scheme, case]), int(judged.last[scheme, case])
        return Result(
            scheme=outcome.schemes[outcome.scheme_index.index(scheme)],
            case=int(outcome.cases[case]),
            status=STATUSES[int(outcome.status[scheme, case])],
            reason=REASON_NAMES[int(outcome.reason[scheme, case])],
            order=order,
            interval=None if low is None or high is None else (low, high),
            levels=levels,
            value=number_at(outcome.value, scheme, case),
        )

    return [one(scheme, case) for scheme, case in outcome.ranking()]


def _claim(experiment: Experiment, record: Record, check: ClaimCheck, index: int) -> Verdict:
    """Compare the measured truth of a statement with what is held of it."""
    inner = _verdict(check.that, _measure(experiment, record, check.that, index))
    truth = "true" if inner.status == "PASS" else "false"
    status, reason, advice = inner.status, inner.reason, inner.advice
    # a number that broke down shows neither a statement nor its opposite
    unmeasured = check.that.kind == "value" and inner.reason == "non_finite"
    if inner.status != "INCONCLUSIVE" and not unmeasured:
        right = (inner.status == "PASS") == check.holds
        status = "PASS" if right else "FAIL"
        reason = (inner.reason if check.holds else "match") if right else "mismatch"
        told = f"Measured: the statement is {truth}."
        advice = (
            "" if right else inner.advice or f"Set `holds: {truth}` if the measurement is right."
        )
    else:
        told = "Measured: the statement cannot be decided."
    return Verdict(
        id=check.id,
        kind=check.kind,
        text=f"Claim: {check.claim}. {told} {inner.text}",
        quantity=inner.quantity,
        expected="true" if check.holds else "false",
        status=status,
        reason=reason,
        advice=advice,
        results=inner.results,
        counts=inner.counts,
    )
