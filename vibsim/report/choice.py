"""What a report shows: the decisive check, the quantities, and the members of a sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vibsim.checks.fields import name_of
from vibsim.core.vocabulary import BY_TOLERANCE, ORDER_TOLERANCE, SEVERITY, TYPICAL_NORM
from vibsim.experiment.storage import checked_quantities
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.finest_level import deviation
from vibsim.report.types import (
    Check,
    ConvergesCheck,
    Experiment,
    Measurement,
    SchemeSpec,
    ValueCheck,
)


def promises(record: Results, quantity: str) -> list[tuple[float, float]]:
    """Return the finite orders expected of a quantity, each with its tolerance, in ascending order.

    They are the formal orders of the schemes; for a part of an error without a formal order, those of its checks.
    Exact quantities and adaptive schemes have none.
    """
    requested = {
        (float(check.order), check.tolerance)
        for check in on_order(record, quantity)
        if isinstance(check.order, float)
    }
    if record.basis_of_order(quantity) == "expected" and requested:
        return sorted(requested)
    promised = record.formal_orders(quantity)
    pairs = {
        (float(order), tolerance(record, quantity, scheme))
        for s, scheme in enumerate(record.schemes)
        for order in np.unique(promised[s][np.isfinite(promised[s])])
    }
    return sorted(pairs)


def tolerance(record: Results, quantity: str, scheme: str) -> float:
    """Return the smallest tolerance among the checks of the order of a quantity with a scheme."""
    tolerances = [row.tolerance for row in on_order(record, quantity, scheme)]
    return min(tolerances, default=ORDER_TOLERANCE)


def on_order(record: Results, quantity: str, scheme: str | None = None) -> list[ConvergesCheck]:
    """Return the checks of the order of a quantity, of one scheme or of any."""
    measured = [check.measured for check in record.experiment.checks]
    return [
        row for row in measured
        if row.kind == "converges" and row.converges == quantity
        and (scheme is None or row.schemes is None or scheme in row.schemes)
    ]  # fmt: skip


def asked_values(record: Results) -> list[ValueCheck]:
    """Return the value checks, including those inside claims."""
    measured = [check.measured for check in record.experiment.checks]
    return [row for row in measured if row.kind == "value"]


def has_swept_options(experiment: Experiment, spec: SchemeSpec) -> bool:
    """Return whether the sweep varies an option of a scheme."""
    keys = experiment.sweep.keys if experiment.sweep is not None else ()
    return any(key.startswith(f"schemes.{spec.name}.") for key in keys)


def quantities(record: Results) -> list[str]:
    """Return the quantities to show: the position, those of checks, and the energy deviation."""
    extra = ["energy_deviation"] if record.model.conservative else []
    names = dict.fromkeys([record.model.position, *checked_quantities(record.experiment), *extra])
    return [name for name in names if f"{name}_order" in record]


def first(record: Results) -> str:
    """Return the first of the `quantities`; the position if the record has no order for any."""
    return next(iter(quantities(record)), record.model.position)


def members(record: Results, quantity: str, decisive: Member | None = None) -> list[Member]:
    """Return the members that figures over time show, with each scheme: the only one, or two of a sweep.

    In a sweep they are the `decisive` member, else the worst one, and a typical passing one, if any passes. The worst
    is judged by the verdicts on `quantity`, then by the distance of the order from the formal one, each taken from the
    worst scheme.
    """
    if not record.swept or f"{quantity}_status" not in record:
        # a large sweep has verdicts only on the quantities of checks
        return record.of_case(0 if decisive is None else decisive.case)
    status = record.flags(f"{quantity}_status")
    severity = np.max([(status == word) * rank for word, rank in SEVERITY.items()], axis=(0, 1))
    away = np.abs(deviation(record, quantity))
    ranking = np.lexsort((np.max(np.where(np.isnan(away), np.inf, away), axis=0), severity))
    # the best score: members that most schemes pass, among these the ones that fewest fail
    score = np.sum(status == "PASS", axis=0) * (len(status) + 1) - np.sum(status == "FAIL", axis=0)
    healthy = ranking[score[ranking] == score.max()]
    last = int(ranking[-1]) if decisive is None else decisive.case
    roles = {int(healthy[healthy.size // 2]): "typical", last: "worst"}
    shown = reversed(roles.items())
    return [member for case, role in shown for member in record.of_case(case, role)]


def worst(record: Results, quantity: str) -> Member:
    """Return the worst member, judged as in `members`, with its worst scheme."""
    candidates = [member for member in members(record, quantity) if member.role != "typical"]
    if f"{quantity}_status" not in record:
        return candidates[0]
    status, away = record.flags(f"{quantity}_status"), np.abs(deviation(record, quantity))

    def badness(member: Member) -> tuple[int, float]:
        distance = float(np.nan_to_num(away[member.place], nan=np.inf))
        return SEVERITY[status[member.place]], distance

    return max(candidates, key=badness)


def with_levels(record: Results, candidates: list[Member]) -> list[Member]:
    """Leave out adaptive schemes, whose steps do not depend on the level, unless there are no others."""
    return [m for m in candidates if not record.experiment.schemes[m.scheme].adaptive] or candidates


@dataclass(frozen=True)
class CheckedLadder(Ladder):
    """The ladder of the decisive result of a check, with the check; without a check that of the position."""

    entry: Mapping[str, Any] = field(default_factory=dict)  # the check in the summary, if any
    asserted: Check | None = None  # the check in the experiment; None if the tolerance decides

    @property
    def status(self) -> str:
        """The status of the check; empty without one."""
        return str(self.entry.get("status", ""))

    @property
    def reason(self) -> str | None:
        """The reason of the status."""
        return self.entry.get("reason")

    @property
    def is_refutation(self) -> bool:
        """Whether the check expects a claim to be false."""
        check = self.asserted
        return check is not None and check.kind == "claim" and not check.holds

    @property
    def is_trap(self) -> bool:
        """Whether the check expects a verdict other than PASS, or a claim to be false."""
        return is_trap(self.asserted)

    @property
    def measured(self) -> Measurement | None:
        """The measurement behind the check."""
        return None if self.asserted is None else self.asserted.measured

    @property
    def kind(self) -> str:
        """The kind of the measurement; ``tolerance`` if the tolerance decides."""
        return BY_TOLERANCE if self.measured is None else self.measured.kind

    @property
    def schemes(self) -> Sequence[str]:
        """The schemes that the check judges."""
        return getattr(self.measured, "schemes", None) or self.record.schemes

    @property
    def total(self) -> int:
        """The number of results of the check."""
        return sum(self.entry.get("counts", {}).values())

    @property
    def result(self) -> Mapping[str, Any]:
        """The worst result of the check."""
        return self.entry["results"][0] if self.entry else {}

    @property
    def facts(self) -> Mapping[str, Any]:
        """The facts of the worst result."""
        facts: Mapping[str, Any] = self.result.get("facts", {})
        return facts

    def variable(self, field: str) -> str:
        """Return the name of the variable with a field that the check measured."""
        return name_of("" if self.asserted is None else self.asserted.id, field)

    def numbers(self, *fields: str) -> list[float]:
        """Return numbers that the check measured of the member, such as ``growth``."""
        return [float(self.record.at(self.variable(field), self.member)) for field in fields]

    @property
    def is_on_order(self) -> bool:
        """Whether the check is on an order."""
        return self.kind == "converges"

    @property
    def norm(self) -> str:
        """The norm over time in which the order was judged."""
        check = self.measured
        return check.norm if check is not None and check.kind == "converges" else TYPICAL_NORM


def is_trap(check: Check | None) -> bool:
    """Return whether a check expects a verdict other than PASS, or a claim to be false."""
    if check is not None and check.kind == "claim":
        return not check.holds
    expected = getattr(check, "expect", None)
    return expected is not None and expected.status != "PASS"


def find_lead(record: Results, summary: Mapping[str, Any]) -> CheckedLadder:
    """Return the decisive check: the worst one or, if all passed, the most informative one that is not a trap.

    A check on an order is most informative, one that two solutions are equal least: that tests how well the steps were
    computed, seldom the question of the experiment. The first of equals decides.
    """

    def rank(one: CheckedLadder) -> tuple[int, bool, int]:
        is_claim = one.asserted is not None and one.asserted.kind == "claim"
        demotion = int(is_claim) if one.is_on_order else 3 if one.kind == "equal" else 2
        return -SEVERITY[one.status], one.is_trap, demotion

    checked = [of_check(record, entry) for entry in summary["checks"]]
    nothing = CheckedLadder(record, record.model.position, record.of_case(0)[0])
    return min(checked, key=rank, default=nothing)


def of_check(record: Results, entry: Mapping[str, Any]) -> CheckedLadder:
    """Return a check of a summary with the ladder of its decisive result."""
    check = next((check for check in record.experiment.checks if check.id == entry["id"]), None)
    default = record.model.position
    name = str(entry.get("quantity") or default)
    is_compared = any(f"{name}_{kind}_norm" in record for kind in ("difference", "error"))
    quantity = name if is_compared else default
    return CheckedLadder(record, quantity, record.of_result(entry["results"][0]), entry, check)
