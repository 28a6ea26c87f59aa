"""The checks of an experiment: what was measured, what was expected, and whether they agree.

An experiment with a tolerance has one verdict more than it names checks: whether the tolerance was reached.
A check is decided by its worst result: FAIL before INCONCLUSIVE before PASS. A number that is not finite never passes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from vibsim.analysis.check_variables import definition
from vibsim.checks import energy, equal, stable
from vibsim.checks.order.judge import converges
from vibsim.checks.outcome import FAIL, PASS, Outcome
from vibsim.checks.results import Results
from vibsim.checks.sweep_regions import where
from vibsim.checks.tolerance_check import reached
from vibsim.checks.value.judge import valued
from vibsim.core.errors import VibsimError
from vibsim.core.record import Record
from vibsim.core.vocabulary import BY_TOLERANCE, REASON_NAMES, STATUSES

if TYPE_CHECKING:
    import xarray

    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import Check, ClaimCheck, Measurement


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
    results: Results
    """Worst first."""
    counts: dict[str, int]
    """Number of results by status, compared with what was expected."""
    where: dict[str, Any]
    """For every status but PASS, where in a sweep its results lie; see `vibsim.checks.sweep_regions`."""
    note: str | None = None
    """What the experiment says to a reader of a claim."""


def verdicts(experiment: Experiment, convergence: xarray.Dataset | Record) -> list[Verdict]:
    """Decide every check of an experiment, and last whether it reached its tolerance, where it has one.

    Parameters
    ----------
    convergence
        What `analyse` returned for the same experiment.

    Raises
    ------
    VibsimError
        Where `convergence` was made without one of the checks, or for other ones.
    """
    record = convergence if isinstance(convergence, Record) else Record.from_xarray(convergence)
    known = record.words("check") if "check" in record else []
    missing = [check.id for check in experiment.checks if check.id not in known]
    if missing:
        raise VibsimError(f"the analysis knows {known}, not {missing}: analyse the levels again")
    if record.attrs["checks"] != definition(experiment):
        raise VibsimError("the checks are not those of the analysis: analyse the levels again")
    found = [_of_check(experiment, record, check) for check in experiment.checks]
    if experiment.tolerance is not None:
        found.append(_verdict(record, BY_TOLERANCE, BY_TOLERANCE, reached(experiment, record)))
    return found


def _of_check(experiment: Experiment, record: Record, check: Check) -> Verdict:
    if check.kind == "claim":
        return _claim(experiment, record, check)
    return _verdict(record, check.id, check.kind, _judge(experiment, record, check, check.id))


def _judge(experiment: Experiment, record: Record, check: Measurement, id_: str) -> Outcome:
    match check.kind:
        case "converges":
            return converges(experiment, record, check, id_)
        case "value":
            return valued(experiment, record, check, id_)
        case "stable":
            return stable.judge(experiment, record, check, id_)
        case "conserves":
            return energy.judge(experiment, record, check, id_)
    return equal.judge(experiment, record, check, id_)


def _verdict(record: Record, id_: str, kind: str, outcome: Outcome) -> Verdict:
    """Decide a check by its worst result."""
    if not outcome.total:
        raise VibsimError(f"check {id_}: it applies to no scheme or no member of the experiment")
    scheme, case = outcome.position(outcome.worst(1)[0])
    found = where(record, outcome)
    status = int(outcome.compared[scheme, case])
    reason = _compared_reason(outcome, scheme, case)
    return Verdict(
        id=id_,
        kind=kind,
        text=_told(outcome, scheme, case, reason, found),
        quantity=outcome.quantity,
        expected=outcome.expected,
        status=STATUSES[status],
        reason=reason,
        advice="" if status == PASS else outcome.advise(scheme, case) or _CORRECT,
        results=Results(outcome),
        counts=outcome.counts(),
        where=found,
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


def _told(outcome: Outcome, scheme: int, case: int, reason: str, found: Mapping[str, Any]) -> str:
    """Say what was measured where it decides, and of how many results that is so."""
    told = outcome.tell(scheme, case)
    if outcome.value is None and reason == "match":
        told += f" That is what the check expects ({outcome.expected})."
    elif outcome.value is None and reason == "mismatch":
        told += f" The check expects {outcome.expected}."
    if outcome.total == 1:
        return told
    status = STATUSES[int(outcome.compared[scheme, case])]
    place = f"scheme {outcome.schemes[outcome.scheme_index.index(scheme)]}"
    if len(outcome.case_index) > 1:
        place += f", case {int(outcome.cases[case])}"
    many = (
        found[status]["text"]
        if status in found
        else f"{status} in {outcome.counts()[status]} of {outcome.total} results"
    )
    return f"{many}; {place} decides: {told}"


def _claim(experiment: Experiment, record: Record, check: ClaimCheck) -> Verdict:
    """Compare the measured truth of a statement with what is held of it."""
    outcome = _judge(experiment, record, check.that, check.id)
    inner = _verdict(record, check.id, check.that.kind, outcome)
    truth = "true" if inner.status == "PASS" else "false"
    status, reason, advice = inner.status, inner.reason, inner.advice
    # a number that broke down shows neither a statement nor its opposite
    unmeasured = check.that.kind != "converges" and inner.reason == "non_finite"
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
        where=inner.where,
        note=check.note,
    )
