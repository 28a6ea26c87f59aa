"""What a check measured of every scheme and member, and which of them decides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.verdict import Judgement
from vibsim.vocabulary import SEVERITY, STATUSES

Floats = NDArray[np.float64]

PASS, FAIL, INCONCLUSIVE = map(STATUSES.index, ("PASS", "FAIL", "INCONCLUSIVE"))
"""Index into `STATUSES`."""


@dataclass(frozen=True)
class Outcome:
    """Measured and compared; arrays have the shape (scheme, case) of the whole experiment."""

    schemes: list[str]
    """Names of the schemes that the check is about."""
    scheme_index: list[int]
    """Their positions."""
    cases: NDArray[Any]
    """Global index of every member, shape (case,)."""
    case_index: list[int]
    """Positions of the members that the check is about."""
    status: NDArray[Any]
    """Measured, index into `STATUSES`."""
    reason: NDArray[Any]
    """Measured, index into `vocabulary.REASON_NAMES`."""
    compared: NDArray[Any]
    """Status after comparison with what was expected."""
    away: Floats
    """How far each number is from the expected one; larger is worse."""
    expected: str
    expects_pass: bool
    quantity: str | None
    tell: Callable[[int, int], str]
    """Sentence on a scheme and a member."""
    advise: Callable[[int, int], str]
    """Advice on a scheme and a member."""
    judged: Judgement | None = None
    """Of a ``converges`` check."""
    value: Floats | None = None
    """Of a ``value`` check."""

    def ranking(self) -> list[tuple[int, int]]:
        """Return the positions of all results that count, worst first; equals in their order."""
        chosen = np.ix_(self.scheme_index, self.case_index)
        severity = np.array([SEVERITY[name] for name in STATUSES])[self.compared[chosen]].ravel()
        away = np.where(np.isnan(self.away[chosen]), np.inf, self.away[chosen]).ravel()
        order = np.lexsort((-away, -severity))
        width = len(self.case_index)
        return [
            (self.scheme_index[int(i) // width], self.case_index[int(i) % width]) for i in order
        ]

    def worst(self) -> tuple[int, int]:
        """Return the position of the result that decides."""
        return self.ranking()[0]

    def counts(self) -> dict[str, int]:
        """Return the number of results by compared status."""
        chosen = self.compared[np.ix_(self.scheme_index, self.case_index)]
        return {name: int(np.sum(chosen == i)) for i, name in enumerate(STATUSES)}


def number_at(values: NDArray[Any] | None, scheme: int, case: int) -> float | None:
    """Return one number, None where there is none or it is not finite."""
    if values is None or not np.isfinite(values[scheme, case]):
        return None
    return float(values[scheme, case])
