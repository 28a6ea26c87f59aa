"""What a check measured of every scheme and member, and which of them decides."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.checks.fields import Facts
from vibsim.core.vocabulary import SEVERITY, STATUSES

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ClaimCheck, Measurement

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
    case_index: NDArray[np.int64]
    """Positions of the members that the check is about."""
    status: NDArray[Any]
    """Measured, index into `STATUSES`."""
    reason: NDArray[Any]
    """Measured, index into `vocabulary.REASON_NAMES`."""
    compared: NDArray[Any]
    """Status after comparison with what was expected."""
    away: Floats
    """How far each number is from the expected one; larger is worse."""
    facts: Facts
    """What was measured of every scheme and member."""

    @property
    def total(self) -> int:
        """Number of results."""
        return len(self.scheme_index) * len(self.case_index)

    @property
    def _at(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        return np.array(self.scheme_index, dtype=np.int64)[:, None], self.case_index[None]

    @cached_property
    def chosen(self) -> NDArray[Any]:
        """Compared status of the results that count, shape (scheme, case) of the check."""
        return self.compared[self._at]

    @cached_property
    def _keys(self) -> tuple[NDArray[np.int64], Floats]:
        """Severity and distance of every result that counts, flat."""
        away = self.away[self._at]
        severity = np.array([SEVERITY[name] for name in STATUSES])[self.chosen]
        return severity.ravel(), np.where(np.isnan(away), np.inf, away).ravel()

    @cached_property
    def ranking(self) -> NDArray[np.int64]:
        """Numbers of all results, worst first; equals in their order."""
        severity, away = self._keys
        return np.lexsort((-away, -severity))

    def worst(self, most: int) -> NDArray[np.int64]:
        """Return the beginning of `ranking`, without sorting all of it."""
        severity, away = self._keys
        found: list[NDArray[np.int64]] = []
        for value in sorted(set(SEVERITY.values()), reverse=True):
            left = most - sum(map(len, found))
            rows = np.flatnonzero(severity == value) if left > 0 else np.empty(0, dtype=np.int64)
            if len(rows) > left:
                least = np.partition(away[rows], len(rows) - left)[len(rows) - left]
                rows = rows[away[rows] >= least]
            found.append(rows[np.argsort(-away[rows], kind="stable")][: max(left, 0)])
        return np.concatenate(found)

    def position(self, number: int) -> tuple[int, int]:
        """Return scheme and case of a result."""
        scheme, case = divmod(int(number), len(self.case_index))
        return self.scheme_index[scheme], int(self.case_index[case])

    def counts(self) -> dict[str, int]:
        """Return the number of results by compared status."""
        return {name: int(np.sum(self.chosen == i)) for i, name in enumerate(STATUSES)}


def compared_reason(check: Measurement | None, status: str, measured: str, reason: str) -> str:
    """Return the measured reason where a PASS was expected, else whether the outcome is the expected one.

    Parameters
    ----------
    status, measured
        Status compared with what was expected, and the measured one.
    """
    expects_pass = expects_a_pass(check)
    if status == "PASS" and not expects_pass:
        return "match"
    if status == "FAIL" and (not expects_pass or measured == "PASS"):
        return "mismatch"
    return reason


def expects_a_pass(check: Measurement | None) -> bool:
    """Tell whether a check expects that what it measures passes; None stands for a tolerance."""
    if check is not None and check.kind == "converges":
        return check.expect.status == "PASS"
    return check.stable if check is not None and check.kind == "stable" else True


def truth(claim: ClaimCheck, status: str, reason: str) -> bool | None:
    """Return whether a statement is true by status and reason of what measures it; None where it is not decided."""
    # a number that broke down shows neither a statement nor its opposite
    is_unmeasured = claim.that.kind != "converges" and reason == "non_finite"
    return None if status == "INCONCLUSIVE" or is_unmeasured else status == "PASS"
