"""The results of a check, one per scheme and member: made when they are looked at, for there may be millions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, overload

from vibsim.checks.fields import facts_of
from vibsim.checks.outcome import Outcome
from vibsim.core.vocabulary import REASON_NAMES, STATUSES, decisive_number


@dataclass(frozen=True)
class Result:
    """What was measured of one scheme and one member."""

    scheme: str
    case: int
    """Global index of the member."""
    status: str
    """The measured one, whatever was expected."""
    reason: str
    facts: Mapping[str, Any] = field(hash=False)
    """What was measured, by name, as plain data; None where there is none."""

    @property
    def value(self) -> float | None:
        """The number that decides; None where an order does, or where it is not finite."""
        return decisive_number(self.facts)

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
        """Copy and pickle what was measured, without the ranking."""
        return Results, (replace(self._outcome),)

    def __repr__(self) -> str:
        return f"<{len(self)} results>"

    def worst(self, most: int | None) -> Iterator[Result]:
        """Yield the worst results, all of them where `most` is None, without sorting more."""
        outcome = self._outcome
        for number in outcome.ranking if most is None else outcome.worst(most):
            yield self._one(int(number))

    def _one(self, number: int) -> Result:
        outcome, (scheme, case) = self._outcome, self._outcome.position(number)
        return Result(
            scheme=outcome.schemes[outcome.scheme_index.index(scheme)],
            case=int(outcome.cases[case]),
            status=STATUSES[int(outcome.status[scheme, case])],
            reason=REASON_NAMES[int(outcome.reason[scheme, case])],
            facts=facts_of(outcome.facts, scheme, case),
        )
