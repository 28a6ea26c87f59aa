"""The results of a check, one per scheme and member: made when they are looked at, for there may be millions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from vibsim.analysis.outcome import Outcome, number_at
from vibsim.vocabulary import REASON_NAMES, STATUSES


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

    def __repr__(self) -> str:
        return f"<{len(self)} results>"

    def worst(self, most: int) -> tuple[Result, ...]:
        """Return the worst results, without ranking all of them."""
        return tuple(self._one(int(n)) for n in self._outcome.worst(most))

    def _one(self, number: int) -> Result:
        outcome, (scheme, case) = self._outcome, self._outcome.position(number)
        order = low = high = levels = None
        found = outcome.orders
        if found is not None and np.isfinite(found.order[scheme, case]):
            order, low, high = (
                number_at(a, scheme, case) for a in (found.order, found.low, found.high)
            )
            levels = int(found.first[scheme, case]), int(found.last[scheme, case])
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
