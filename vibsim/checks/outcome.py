"""The outcome of a check: the results of all schemes and members, and which one decides."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple, Self, overload

import numpy as np
from numpy.typing import NDArray

from vibsim.checks.fields import Facts, facts_of
from vibsim.convergence.reasons import FAIL, INCONCLUSIVE, PASS, STATUS_OF, code, is_open
from vibsim.core.array_types import Codes, Flags, Floats, Integers
from vibsim.core.record import Record
from vibsim.core.vocabulary import REASON_NAMES, SEVERITY, STATUSES, decisive_number
from vibsim.experiment import Experiment
from vibsim.experiment.data import schemes_of
from vibsim.experiment.schema.checks import ClaimCheck, Expect, Measurement, MeasuringCheck
from vibsim.experiment.sweep_columns import members_with, recorded_columns


@dataclass(frozen=True)
class Outcome:
    """The measured and compared results; arrays have the shape (scheme, case) of the whole experiment."""

    schemes: list[str]
    """Names of the schemes that the check covers."""
    scheme_index: list[int]
    """Indices of these schemes."""
    cases: NDArray[Any]
    """Global index of each member, shape (case,)."""
    case_index: Integers
    """Indices of the members that the check covers; or, if one result covers all members, of the member that decides,
    shape (scheme, 1)."""
    status: NDArray[Any]
    """Measured status, index into `STATUSES`."""
    reason: NDArray[Any]
    """Measured reason, index into `vocabulary.REASON_NAMES`."""
    compared: NDArray[Any]
    """Status after comparison with the expectation."""
    away: Floats
    """Distance of each number from the expected one; larger is worse."""
    facts: Facts
    """Measured facts of each scheme and member."""

    @property
    def total(self) -> int:
        """Number of results."""
        return len(self.scheme_index) * int(self.case_index.shape[-1])

    @property
    def is_of_all(self) -> bool:
        """Whether one result covers all members."""
        return self.case_index.ndim > 1

    @property
    def _at(self) -> tuple[Integers, Integers]:
        cases = self.case_index if self.is_of_all else self.case_index[None]
        return np.array(self.scheme_index, dtype=np.int64)[:, None], cases

    @cached_property
    def chosen(self) -> NDArray[Any]:
        """Compared status of the covered results, shape (scheme, case) of the check."""
        return self.compared[self._at]

    @cached_property
    def _keys(self) -> tuple[Integers, Floats]:
        """Severity and distance of the covered results, flat."""
        away = self.away[self._at]
        severity = np.array([SEVERITY[name] for name in STATUSES])[self.chosen]
        return severity.ravel(), np.where(np.isnan(away), np.inf, away).ravel()

    @cached_property
    def ranking(self) -> Integers:
        """Indices of all results, worst first; ties in their original order."""
        severity, away = self._keys
        return np.lexsort((-away, -severity))

    def worst(self, most: int) -> Integers:
        """Return the first `most` entries of `ranking`, without sorting all results."""
        severity, away = self._keys
        parts: list[Integers] = []
        for value in sorted(set(SEVERITY.values()), reverse=True):
            missing = most - sum(map(len, parts))
            rows = np.flatnonzero(severity == value) if missing > 0 else np.empty(0, dtype=np.int64)
            if len(rows) > missing:
                threshold = np.partition(away[rows], len(rows) - missing)[len(rows) - missing]
                rows = rows[away[rows] >= threshold]
            parts.append(rows[np.argsort(-away[rows], kind="stable")][: max(missing, 0)])
        return np.concatenate(parts)

    def counts(self) -> dict[str, int]:
        """Return the number of results by compared status."""
        return {name: int(np.sum(self.chosen == i)) for i, name in enumerate(STATUSES)}


class Judged(NamedTuple):
    """The decision of a kind of check; the fields are those of `Outcome`."""

    reason: NDArray[Any]
    away: Floats
    compared: NDArray[Any] | None = None
    """None for a check that expects a PASS."""
    facts: Facts = MappingProxyType({})
    """Facts besides the measured fields."""
    members: Integers | None = None
    """If one number covers all members, the index of the member that decides, shape (scheme, 1)."""


def outcome_of(
    experiment: Experiment, record: Record, check: Measurement | None, judged: Judged, facts: Facts
) -> Outcome:
    """Return the outcome of a check for the schemes and members that it covers; None is the tolerance."""
    names, cases = record.words("scheme"), np.asarray(record["case"])
    if check is None:
        # adaptive schemes have no levels
        schemes = list(experiment.ladder)
    elif check.kind == "equal":
        schemes = [names.index(check.first)]
    else:
        schemes = list(schemes_of(experiment, check))
    status = STATUS_OF[judged.reason]
    return Outcome(
        schemes=[names[i] for i in schemes],
        scheme_index=schemes,
        cases=cases,
        case_index=np.flatnonzero(about_members(record, check))
        if judged.members is None
        else judged.members[schemes],
        status=status,
        reason=judged.reason.astype(np.int8),
        compared=status if judged.compared is None else judged.compared.astype(np.int8),
        away=judged.away,
        facts={**facts, **judged.facts},
    )


def about_members(record: Record, check: Measurement | None) -> Flags:
    """Say which members a check covers, shape (case,); None is the tolerance, which covers all."""
    cases = np.asarray(record["case"])
    if check is None:
        return np.ones(len(cases), dtype=np.bool_)
    is_swept = members_with(recorded_columns(record), check.swept, len(cases))
    return is_swept if check.member is None else is_swept & (cases == check.member)


@dataclass(frozen=True)
class Result:
    """The result of one scheme and one member."""

    scheme: str
    case: int
    """Global index of the member."""
    status: str
    """Measured status, whatever was expected."""
    reason: str
    facts: Mapping[str, Any] = field(hash=False)
    """Measured facts by name, as plain data; None for a missing one."""

    @classmethod
    def of(cls, entry: Mapping[str, Any]) -> Self:
        """Return a result of a summary."""
        return cls(*(entry[f.name] for f in fields(cls)))

    @property
    def value(self) -> float | None:
        """The number that decides; None if an order decides or it is not finite."""
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
        levels = None if self.order is None else self.facts.get("levels")
        return levels and (levels[0], levels[1])


class Results(Sequence[Result]):
    """All results of a check, the worst first; created on access, since there may be millions."""

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
            return tuple(map(self._one, self._outcome.ranking[index]))
        return self._one(self._outcome.ranking[index])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Results) or len(self) != len(other):
            return False
        return all(a == b for a, b in zip(self, other, strict=True))

    def __hash__(self) -> int:
        return hash(tuple(self))

    def __reduce__(self) -> tuple[type[Results], tuple[Outcome]]:
        """Copy and pickle the outcome without its cached ranking."""
        return Results, (replace(self._outcome),)

    def __repr__(self) -> str:
        return f"<{len(self)} results>"

    def worst(self, most: int | None) -> Iterator[Result]:
        """Yield the `most` worst results, or all of them if it is None, without sorting more."""
        outcome = self._outcome
        yield from map(self._one, outcome.ranking if most is None else outcome.worst(most))

    def _one(self, number: int) -> Result:
        outcome = self._outcome
        row, column = divmod(int(number), outcome.case_index.shape[-1])
        cases = outcome.case_index[row] if outcome.is_of_all else outcome.case_index
        scheme, case = outcome.scheme_index[row], int(cases[column])
        return Result(
            scheme=outcome.schemes[row],
            case=int(outcome.cases[case]),
            status=STATUSES[int(outcome.status[scheme, case])],
            reason=REASON_NAMES[int(outcome.reason[scheme, case])],
            facts=facts_of(outcome.facts, scheme, case),
        )


def as_expected(expect: Expect, reason: Codes) -> Codes:
    """Return the statuses of results with these reasons after comparison with the expected verdict."""
    right = STATUS_OF[reason] == STATUSES.index(expect.status)
    if expect.reason is not None:
        right &= reason == code(expect.reason)
    return np.where(right, PASS, np.where(is_open(reason), INCONCLUSIVE, FAIL))


def compared_reason(check: MeasuringCheck | None, status: str, measured: str, reason: str) -> str:
    """Return the measured reason if a PASS was expected, otherwise ``match`` or ``mismatch``.

    Parameters
    ----------
    check
        None for the tolerance of the experiment.
    status, measured
        Status after comparison with the expectation, and measured status.
    """
    expects_pass = check is None or check.expects_pass
    if status == "PASS" and not expects_pass:
        return "match"
    if status == "FAIL" and (not expects_pass or measured == "PASS"):
        return "mismatch"
    return reason


def truth(claim: ClaimCheck, status: str, reason: str) -> bool | None:
    """Return whether a statement is true, from the status and reason of its measurement; None if undecided."""
    # a number that broke down decides nothing
    is_unmeasured = claim.that.kind != "converges" and reason == "non_finite"
    return None if status == "INCONCLUSIVE" or is_unmeasured else status == "PASS"
