"""The verdict on a check in words: what decides it, of how many results that is so, and what to change.

Everything is made from facts: those of the summary, or of a verdict, and the variables of ``convergence.nc``. The
sentence on a result is chosen by its reason, in the module of its kind of check.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from vibsim.apriori.formal_orders import columns_of
from vibsim.checks.outcome import compared_reason, truth
from vibsim.checks.results import Result
from vibsim.checks.words import behaviour, order, order_advice, tolerance, value
from vibsim.checks.words.found import Found
from vibsim.checks.words.notation import PLAIN, Notation
from vibsim.checks.words.order_context import story
from vibsim.core.record import Record
from vibsim.core.vocabulary import BY_TOLERANCE, worst

if TYPE_CHECKING:
    from vibsim.experiment import Check, Experiment
    from vibsim.experiment.schema.checks import Measurement

CORRECT = "Correct what the check expects (`expect:`), or find out why it turned out otherwise."


def expectation(experiment: Experiment, check: Check | None, notation: Notation = PLAIN) -> str:
    """Say what a check expects; None stands for the tolerance of the experiment."""
    if check is None:
        return tolerance.rule(experiment.tolerance or 0.0, notation)
    match check.kind:
        case "claim":
            return "true" if check.holds else "false"
        case "converges":
            expect = check.expect
            return expect.status if expect.reason is None else f"{expect.status} ({expect.reason})"
        case "value":
            return value.rule(check, notation)
        case "stable":
            return "stable" if check.stable else "unstable"
        case "conserves":
            return check.drift
    return f"equal to {behaviour.OTHERS.get(check.second, f'scheme {check.second}')}"


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

    def _found(self, result: Result) -> Found:
        record = self.record
        return Found(
            self.experiment,
            record,
            self._measured,
            BY_TOLERANCE if self.check is None else self.check.id,
            record.words("scheme").index(result.scheme),
            record.place("case", result.case),
            result.reason,
            self.notation,
        )

    def sentence(self, result: Result) -> str:
        """Say what was measured of one result."""
        found, check = self._found(result), self._measured
        if check is None:
            return tolerance.tell(found, self.experiment.tolerance or 0.0)
        match check.kind:
            case "converges":
                return order.tell(story(found, check))
            case "value":
                return value.tell(found, check)
            case "stable":
                return behaviour.tell_stable(found)
            case "conserves":
                return behaviour.tell_conserves(found, check)
        return behaviour.tell_equal(found, check)

    def _advise(self, result: Result) -> str:
        found, check = self._found(result), self._measured
        if check is None:
            return tolerance.advise(found)
        match check.kind:
            case "converges":
                return order_advice.advise(story(found, check))
            case "value":
                return value.advise(found, check)
            case "stable":
                return behaviour.advise_stable(found)
            case "conserves":
                return behaviour.advise_conserves(found, check)
        return behaviour.advise_equal(found, check)

    def measured(self, result: Result, counts: Mapping[str, int]) -> str:
        """Say in a few words what was measured where it decides, for a table of checks that passed."""
        found, check = self._found(result), self._measured
        if check is not None and check.kind == "equal":
            told = behaviour.distance_in_words(found)
        elif check is not None and check.kind == "value":
            told = value.measured(found, check)
        else:
            told = self.sentence(result).removesuffix(".")
        total = sum(counts.values())
        return told if total == 1 else f"{told} ({self._place(result)}, the hardest of {total})"

    def text(self, result: Result, counts: Mapping[str, int], where: Mapping[str, Any]) -> str:
        """Say what was measured where it decides, and of how many results that is so.

        Parameters
        ----------
        result
            The one that decides: the worst.
        counts
            Number of results by status, compared with what was expected.
        where
            Where in a sweep those of a status lie (`vibsim.checks.sweep_regions`).
        """
        check, status, total = self._measured, _status(counts), sum(counts.values())
        told = self.sentence(result)
        if check is not None and check.kind == "converges":
            reason = compared_reason(check, status, result.status, result.reason)
            expected = expectation(self.experiment, check)
            if reason == "match":
                told += f" The check detected {expected}, as intended."
            elif reason == "mismatch":
                told += f" The check expects {expected}."
        if total > 1:
            many = f"{status} in {counts[status]} of {total} results"
            head = where[status]["text"] if status in where else many
            if status == "PASS":
                head = f"All {total} results passed"
            told = f"{head}. The hardest ({self._place(result)}): {told}"
        if self.check is None or self.check.kind != "claim":
            return told
        holds = truth(self.check, status, result.reason)
        if holds is None:
            return f"Measured: the statement cannot be decided. {told}"
        return f"Measured: the statement is {'true' if holds else 'false'}. {told}"

    def _place(self, result: Result) -> str:
        """Name the scheme, and of a sweep the member with its swept values."""
        columns, number = columns_of(self.record), self.notation.number
        if not columns:
            return f"scheme {result.scheme}"
        place = self.record.place("case", result.case)
        found = ((key, values[place]) for key, values in columns.items())
        swept = (
            f"{key} = {number(value) if isinstance(value, float) else value}"
            for key, value in found
        )
        return ", ".join((f"scheme {result.scheme}", f"case {result.case}", *swept))

    def advice(self, status: str, result: Result, counts: Mapping[str, int]) -> str:
        """Say what to change in the YAML; empty for a check whose status is PASS."""
        if status == "PASS":
            return ""
        inner = _status(counts)
        advice = "" if inner == "PASS" else self._advise(result) or CORRECT
        if advice or self.check is None or self.check.kind != "claim":
            return advice
        return f"Set `holds: {'true' if inner == 'PASS' else 'false'}` if the measurement is right."


def _status(counts: Mapping[str, int]) -> str:
    """Return the status of the result that decides."""
    return worst(status for status, count in counts.items() if count)
