"""The results of a check, one per scheme and member: made when they are looked at, for there may be millions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, overload

from vibsim.checks.fields import facts_of
from vibsim.checks.outcome import Outcome, number_at
from vibsim.core.vocabulary import REASON_NAMES, STATUSES


@dataclass(frozen=True)
class Result:
    """What was measured of one scheme and one member."""

    scheme: str
    case: int
    """Global index of the member."""
    status: str
    """The measured one, whatever was expected."""
    reason: str
    value: float | None
    """The number that decides; None where an order does, or where it is not finite."""
    facts: Mapping[str, Any] = field(hash=False)
    """What was measured, by name, as plain data; None where there is none."""

    @property
    def order(self) -> float | None:
        """The observed order."""
        return self.facts.get("order")

    @property
    def interval(self) -> tuple[float, float] | None:
        """The interval of the order."""
        low, high = self.facts.get("order_low"), self.facts.get("order_high")
        return None if self.order is None or low is None or high is None else (low, high)

    @property
    def levels(self) -> tuple[int, int] | None:
        """First and last level that the order rests on."""
        found = None if self.order is None else self.facts.get("levels")
        return found and (found[0], found[1])


class Results(Sequence[Result]):
    """Every result of a check, the worst first."""

    def __init__(self, outcome: Outcome) -> None:
        self._outcome = outcome

    def __len__(self) -> int:
        return self._outcome.total

    @overload
    def __getitem__(self, index: int) -> Result: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Result, ...]: ...

    def __getitem__(self, index: int | slice) -> Result | tuple[Result, ...]:
        if isinstance(index, slice):
            return tuple(self._one(n) for n in self._outcome.ranking[index])
        if not -len(self) <= index < len(self):
            raise IndexError(f"result {index} of {len(self)}")
        return self._one(int(self._outcome.ranking[index]))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Results) or len(self) != len(other):
            return False
        return all(a == b for a, b in zip(self, other, strict=True))

    def __hash__(self) -> int:
        return hash(tuple(self))

    def __reduce__(self) -> tuple[type[Results], tuple[Outcome]]:
        """Copy and pickle the arrays: what tells of a result in words belongs to the analysis, and stays there."""
        return Results, (replace(self._outcome, tell=_no_words, advise=_no_words),)

    def __repr__(self) -> str:
        return f"<{len(self)} results>"

    def told(self, most: int | None) -> Iterator[tuple[Result, str]]:
        """Yield the worst results, all of them where `most` is None, each with the sentence on it."""
        outcome = self._outcome
        for number in outcome.ranking if most is None else outcome.worst(most):
            yield self._one(int(number)), outcome.tell(*outcome.position(number))

    def _one(self, number: int) -> Result:
        outcome, (scheme, case) = self._outcome, self._outcome.position(number)
        return Result(
            scheme=outcome.schemes[outcome.scheme_index.index(scheme)],
            case=int(outcome.cases[case]),
            status=STATUSES[int(outcome.status[scheme, case])],
            reason=REASON_NAMES[int(outcome.reason[scheme, case])],
            value=number_at(outcome.value, scheme, case),
            facts=facts_of(outcome.facts, scheme, case),
        )


def _no_words(scheme: int, case: int) -> str:
    """Say nothing of a scheme and a member: the sentences of a copy are those that its verdict has already."""
    return ""
