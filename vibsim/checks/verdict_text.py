"""The verdict on a check in words: the result that decides it, the counts, and what to change.

The text is made from facts: those of the summary or of a verdict, and the variables of ``convergence.nc``. The module
of each kind of check chooses the sentence on a result by its reason.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from vibsim.checks import accurate, equal, experiment_tolerance, value_text
from vibsim.checks.kinds import KINDS
from vibsim.checks.notation import PLAIN, Notation
from vibsim.checks.outcome import Result, compared_reason, truth
from vibsim.checks.sentences import Description, MemberFacts
from vibsim.core.record import Record
from vibsim.core.vocabulary import BY_TOLERANCE, worst
from vibsim.experiment import Experiment
from vibsim.experiment.schema.checks import Check, Expect, Measurement
from vibsim.experiment.sweep_columns import recorded_columns

CORRECT = "Correct `expect:`, or find out why the outcome differs."


def expectation(experiment: Experiment, check: Check | None, notation: Notation = PLAIN) -> str:
    """Say what a check expects; None is the tolerance of the experiment."""
    if check is None:
        return experiment_tolerance.rule(experiment, notation)
    match check.kind:
        case "claim":
            return "true" if check.holds else "false"
        case "converges":
            return expected_verdict(check.expect)
        case "accurate" if check.expect.status != "PASS":
            return expected_verdict(check.expect)
        case "accurate":
            return accurate.rule(check, notation)
        case "value":
            return value_text.rule(check, notation)
        case "stable":
            return "stable" if check.stable else "unstable"
        case "conserves":
            return check.drift
    return f"equal to {equal.other_solution(check)}"


def expected_verdict(expect: Expect) -> str:
    """Write the verdict that a check expects."""
    return expect.status if expect.reason is None else f"{expect.status} ({expect.reason})"


@dataclass(frozen=True)
class Wording:
    """Puts the verdict on one check into words."""

    experiment: Experiment
    record: Record
    """Convergence Record."""
    check: Check | None
    """None for the tolerance of the experiment."""
    notation: Notation = PLAIN

    @property
    def _measured(self) -> Measurement | None:
        return None if self.check is None else self.check.measured

    def _describe(self, result: Result) -> Description:
        record, check = self.record, self._measured
        facts = MemberFacts(
            self.experiment,
            record,
            check,
            BY_TOLERANCE if self.check is None else self.check.id,
            record.words("scheme").index(result.scheme),
            record.place("case", result.case),
            result.reason,
            self.notation,
        )
        return (
            experiment_tolerance.describe(facts)
            if check is None
            else KINDS[check.kind].describe(facts, check)
        )

    def sentence(self, result: Result) -> str:
        """Return the sentence on one result."""
        return self._describe(result).sentence

    def brief(self, result: Result) -> str:
        """Return a short text on one result."""
        description = self._describe(result)
        return description.brief or description.sentence.removesuffix(".")

    def text(self, result: Result, counts: Mapping[str, int], where: Mapping[str, Any]) -> str:
        """Return the text on all results: the counts, and the sentence on the result that decides.

        Parameters
        ----------
        result
            The worst result, which decides.
        counts
            Number of results by status, after comparison with the expectation.
        where
            Where in a sweep the results of each status lie (`vibsim.checks.sweep_regions`).
        """
        check, status, total = self._measured, _status(counts), sum(counts.values())
        sentence = self.sentence(result)
        expect = None if check is None else check.expected_verdict
        if expect is not None:
            reason = compared_reason(check, status, result.status, result.reason)
            expected = expected_verdict(expect)
            if expect.status == "PASS" and reason == result.reason:
                pass
            elif reason == "match":
                sentence += f" The check detected {expected}, as intended."
            elif reason == "mismatch":
                sentence += f" The check expects {expected}."
        members = self._swept_values()
        if total == 1 and members:
            sentence = f"With {members}: {sentence}"
        if total > 1:
            head = f"{status} in {counts[status]} of {total} results"
            if status == "PASS":
                whole = "Both" if total == 2 else f"All {total}"
                head = f"{whole} results{members and f' with {members}'} passed"
            elif status in where:
                head = where[status]["text"]
            is_of_all = check is not None and check.kind == "value" and check.take is not None
            hardest = f"scheme {result.scheme}" if is_of_all else self._place(result, brackets=True)
            sentence = f"{head}. The hardest is {hardest}. {sentence}"
        if self.check is None or self.check.kind != "claim":
            return sentence
        holds = truth(self.check, status, result.reason)
        decided = "cannot be decided" if holds is None else f"is {'true' if holds else 'false'}"
        return f"The statement {decided}. {sentence}"

    def _swept_values(self) -> str:
        """Name the swept values that the check is restricted to; empty if it covers all members."""
        return self._listed({} if self._measured is None else self._measured.swept)

    def _listed(self, swept: Mapping[str, Any]) -> str:
        return ", ".join(
            f"{key} = {self.notation.number(value) if isinstance(value, float) else value}"
            for key, value in swept.items()
        )

    def _place(self, result: Result, brackets: bool = False) -> str:
        """Name the scheme and, in a sweep, the member with its swept values."""
        head, place = f"scheme {result.scheme}", self.record.place("case", result.case)
        listed = self._listed({key: x[place] for key, x in recorded_columns(self.record).items()})
        if not listed:
            return head
        return f"{head}, case {result.case}{f' ({listed})' if brackets else f', {listed}'}"

    def advice(self, status: str, result: Result, counts: Mapping[str, int]) -> str:
        """Say what to change in the YAML; empty for PASS."""
        if status == "PASS":
            return ""
        if _status(counts) != "PASS":
            return self._describe(result).advice or CORRECT
        is_claim = self.check is not None and self.check.kind == "claim"
        return "Set `holds: true` if the measurement is right." if is_claim else ""


def _status(counts: Mapping[str, int]) -> str:
    """Return the status of the result that decides."""
    return worst(status for status, count in counts.items() if count)
