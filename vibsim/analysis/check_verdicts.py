"""The checks of an experiment: what was measured, what was expected, and whether they agree.

`tolerance:` adds one verdict: whether the tolerance was reached.
A check is decided by its worst result: FAIL before INCONCLUSIVE before PASS. A number that is not finite never passes.
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
    """Number of results by status, compared with what was expected."""
    where: dict[str, Any]
    """For every status but PASS, where in a sweep its results lie; see `vibsim.checks.sweep_regions`."""
    note: str | None = None
    """What the experiment says to a reader of a claim."""
    source: str | None = None
    """Where a claim stands."""


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
    found = [
        _verdict(experiment, record, check, judge(experiment, record, check.measured, check.id))
        for check in experiment.checks
    ]
    if experiment.tolerance is not None:
        found.append(
            _verdict(experiment, record, None, experiment_tolerance.judge(experiment, record))
        )
    return found


def _verdict(
    experiment: Experiment, record: Record, check: Check | None, outcome: Outcome
) -> Verdict:
    """Decide a check by its worst result; None stands for the tolerance of the experiment."""
    id_, measured = (BY_TOLERANCE, None) if check is None else (check.id, check.measured)
    if not outcome.total:
        raise VibsimError(f"check {id_}: it applies to no scheme or no member of the experiment")
    results, counts, found = Results(outcome), outcome.counts(), sweep_regions(record, outcome)
    decisive = next(results.worst(1))
    status = worst(name for name, count in counts.items() if count)
    reason = compared_reason(measured, status, decisive.status, decisive.reason)
    wording = Wording(experiment, record, check)
    text = wording.text(decisive, counts, found)
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
        where=found,
        note=getattr(check, "note", None),
        source=getattr(check, "source", None),
    )
