"""Decide the checks of an experiment by comparing measured with expected values.

The worst result decides a check, in the order FAIL, INCONCLUSIVE, PASS. A value that is not finite never passes. An
experiment with `tolerance:` has one more verdict: whether the tolerance was reached.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from vibsim.checks import experiment_tolerance
from vibsim.checks.kinds import definition, judge
from vibsim.checks.outcome import Outcome, Results, compared_reason, truth
from vibsim.checks.sweep_regions import sweep_regions
from vibsim.checks.verdict_text import Wording, expectation
from vibsim.core.errors import VibsimError
from vibsim.core.record import Record
from vibsim.core.vocabulary import BY_TOLERANCE, worst

if TYPE_CHECKING:
    import xarray

    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import Check


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
    """Number of results by status."""
    where: dict[str, Any]
    """Where in a sweep the results of each status except PASS lie; see `vibsim.checks.sweep_regions`."""
    note: str | None = None
    """The experiment's comment on a claim."""
    source: str | None = None
    """Where the text makes the claim."""


def verdicts(experiment: Experiment, convergence: xarray.Dataset | Record) -> list[Verdict]:
    """Decide every check of an experiment, and finally whether it reached its tolerance, if it has one.

    Parameters
    ----------
    convergence
        The result of `analyse` for the same experiment.

    Raises
    ------
    VibsimError
        Where `convergence` lacks one of the checks, or was made with other checks.
    """
    record = convergence if isinstance(convergence, Record) else Record.from_xarray(convergence)
    known = record.words("check") if "check" in record else []
    missing = [check.id for check in experiment.checks if check.id not in known]
    if missing:
        raise VibsimError(f"the analysis knows {known}, not {missing}: analyse the levels again")
    if record.attrs["checks"] != definition(experiment):
        raise VibsimError("the checks are not those of the analysis: analyse the levels again")
    decided = [
        _verdict(experiment, record, check, judge(experiment, record, check.measured, check.id))
        for check in experiment.checks
    ]
    if experiment.tolerance is not None:
        decided.append(
            _verdict(experiment, record, None, experiment_tolerance.judge(experiment, record))
        )
    return decided


def _verdict(
    experiment: Experiment, record: Record, check: Check | None, outcome: Outcome
) -> Verdict:
    """Decide a check by its worst result; a check of None stands for the tolerance of the experiment."""
    id_, measured = (BY_TOLERANCE, None) if check is None else (check.id, check.measured)
    if not outcome.total:
        raise VibsimError(f"check {id_}: it applies to no scheme or no member of the experiment")
    results, counts, regions = Results(outcome), outcome.counts(), sweep_regions(record, outcome)
    decisive = next(results.worst(1))
    status = worst(name for name, count in counts.items() if count)
    reason = compared_reason(measured, status, decisive.status, decisive.reason)
    wording = Wording(experiment, record, check)
    text = wording.text(decisive, counts, regions)
    if check is not None and check.kind == "claim":
        text = f"Claim: {check.claim.rstrip().removesuffix('.')}. {text}"
        is_true = truth(check, status, decisive.reason)
        if is_true is not None:
            is_right = is_true == check.holds
            status = "PASS" if is_right else "FAIL"
            reason = (reason if check.holds else "match") if is_right else "mismatch"
    return Verdict(
        id=id_,
        kind=BY_TOLERANCE if check is None else check.kind,
        text=text,
        quantity=None if measured is None else measured.about,
        expected=expectation(experiment, check),
        status=status,
        reason=reason,
        advice=wording.advice(status, decisive, counts),
        results=results,
        counts=counts,
        where=regions,
        note=getattr(check, "note", None),
        source=getattr(check, "source", None),
    )
