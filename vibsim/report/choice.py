"""What a report shows: the decisive check, the quantities, and the members of a sweep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vibsim.core.record import Record
from vibsim.core.vocabulary import ORDER_TOLERANCE, SEVERITY, TYPICAL_NORM
from vibsim.experiment.storage import checked_quantities
from vibsim.report import data
from vibsim.report.data import Member
from vibsim.report.finest_level import deviation
from vibsim.report.types import (
    Check,
    ConvergesCheck,
    Experiment,
    Measurement,
    SchemeSpec,
    ValueCheck,
)


def promises(experiment: Experiment, record: Record, quantity: str) -> list[tuple[float, float]]:
    """Return the finite orders expected of a quantity, each with its tolerance, in ascending order.

    They are the formal orders of the schemes; for a part of an error without a formal order, those of its checks.
    Exact quantities and adaptive schemes have none.
    """
    requested = {
        (float(check.order), check.tolerance)
        for check in on_order(experiment, quantity)
        if isinstance(check.order, float)
    }
    if data.basis_of_order(record, quantity) == "expected" and requested:
        return sorted(requested)
    promised = data.formal_orders(record, quantity)
    pairs = {
        (float(order), tolerance(experiment, quantity, scheme))
        for s, scheme in enumerate(record.words("scheme"))
        for order in np.unique(promised[s][np.isfinite(promised[s])])
    }
    return sorted(pairs)


def tolerance(experiment: Experiment, quantity: str, scheme: str) -> float:
    """Return the smallest tolerance among the checks of the order of a quantity with a scheme."""
    tolerances = [row.tolerance for row in on_order(experiment, quantity, scheme)]
    return min(tolerances, default=ORDER_TOLERANCE)


def on_order(
    experiment: Experiment, quantity: str, scheme: str | None = None
) -> list[ConvergesCheck]:
    """Return the checks of the order of a quantity, of one scheme or of any."""
    measured = [check.measured for check in experiment.checks]
    return [
        row for row in measured
        if row.kind == "converges" and row.converges == quantity
        and (scheme is None or row.schemes is None or scheme in row.schemes)
    ]  # fmt: skip


def position(experiment: Experiment) -> str:
    """Return the name of the model's position."""
    return experiment.model.definition.position


def asked_values(experiment: Experiment) -> list[ValueCheck]:
    """Return the value checks, including those inside claims."""
    measured = [check.measured for check in experiment.checks]
    return [row for row in measured if row.kind == "value"]


def has_swept_options(experiment: Experiment, spec: SchemeSpec) -> bool:
    """Return whether the sweep varies an option of a scheme."""
    keys = experiment.sweep.keys if experiment.sweep is not None else ()
    return any(key.startswith(f"schemes.{spec.name}.") for key in keys)


def quantities(experiment: Experiment, record: Record) -> list[str]:
    """Return the quantities to show: the position, those of checks, and the energy deviation."""
    extra = ["energy_deviation"] if experiment.model.definition.conservative else []
    names = dict.fromkeys([position(experiment), *checked_quantities(experiment), *extra])
    return [name for name in names if f"{name}_order" in record]


def first(experiment: Experiment, record: Record) -> str:
    """Return the first of the `quantities`; the position if the record has no order for any."""
    return next(iter(quantities(experiment, record)), position(experiment))


def members(record: Record, quantity: str, decisive: Member | None = None) -> list[Member]:
    """Return the members that figures over time show, with each scheme: the only one, or two of a sweep.

    In a sweep they are the `decisive` member, else the worst one, and a typical passing one, if any passes. The worst
    is judged by the verdicts on `quantity`, then by the distance of the order from the formal one, each taken from the
    worst scheme.
    """
    if not data.swept(record) or f"{quantity}_status" not in record:
        # a large sweep has verdicts only on the quantities of checks
        return data.of_case(record, 0 if decisive is None else decisive.case)
    status = data.flags(record, f"{quantity}_status")
    severity = np.max([(status == word) * rank for word, rank in SEVERITY.items()], axis=(0, 1))
    away = np.abs(deviation(record, quantity))
    ranking = np.lexsort((np.max(np.where(np.isnan(away), np.inf, away), axis=0), severity))
    # the best score: members that most schemes pass, among these the ones that fewest fail
    score = np.sum(status == "PASS", axis=0) * (len(status) + 1) - np.sum(status == "FAIL", axis=0)
    healthy = ranking[score[ranking] == score.max()]
    last = int(ranking[-1]) if decisive is None else decisive.case
    roles = {int(healthy[healthy.size // 2]): "typical", last: "worst"}
    shown = reversed(roles.items())
    return [member for case, role in shown for member in data.of_case(record, case, role)]


def worst(record: Record, quantity: str) -> Member:
    """Return the worst member, judged as in `members`, with its worst scheme."""
    candidates = [member for member in members(record, quantity) if member.role != "typical"]
    if f"{quantity}_status" not in record:
        return candidates[0]
    status, away = data.flags(record, f"{quantity}_status"), np.abs(deviation(record, quantity))

    def badness(member: Member) -> tuple[int, float]:
        place = member.scheme, member.case
        return SEVERITY[status[place]], float(np.nan_to_num(away[place], nan=np.inf))

    return max(candidates, key=badness)


def with_levels(experiment: Experiment, candidates: list[Member]) -> list[Member]:
    """Leave out adaptive schemes, whose steps do not depend on the level, unless there are no others."""
    return [m for m in candidates if not experiment.schemes[m.scheme].adaptive] or candidates


@dataclass(frozen=True)
class Lead:
    """The decisive check, and the quantity and member shown for it; an experiment without checks has only these two."""

    quantity: str
    """The quantity of the check, or the position."""
    member: Member
    entry: Mapping[str, Any] | None = None
    """The check in the summary."""
    asserted: Check | None = None
    """The check in the experiment; None if the tolerance decides."""

    @property
    def measured(self) -> Measurement | None:
        """The measurement behind the check."""
        return None if self.asserted is None else self.asserted.measured

    @property
    def result(self) -> Mapping[str, Any]:
        """The worst result of the check."""
        return {} if self.entry is None else self.entry["results"][0]

    @property
    def facts(self) -> Mapping[str, Any]:
        """The facts of the worst result."""
        facts: Mapping[str, Any] = self.result.get("facts", {})
        return facts

    @property
    def is_on_order(self) -> bool:
        """Whether the check is on an order."""
        return self.measured is not None and self.measured.kind == "converges"

    @property
    def norm(self) -> str:
        """The norm over time in which the order was judged."""
        check = self.measured
        return check.norm if check is not None and check.kind == "converges" else TYPICAL_NORM


def is_refutation(check: Check | None) -> bool:
    """Return whether a check expects a claim to be false."""
    return check is not None and check.kind == "claim" and not check.holds


def is_trap(check: Check | None) -> bool:
    """Return whether a check expects a verdict other than PASS, or a claim to be false."""
    expected = getattr(check, "expect", None)
    return is_refutation(check) or (expected is not None and expected.status != "PASS")


def find_lead(experiment: Experiment, record: Record, summary: Mapping[str, Any]) -> Lead:
    """Return the decisive check: the worst one or, if all passed, the most informative one that is not a trap.

    A check on an order is most informative, one that two solutions are equal least: that tests how well the steps were
    computed, seldom the question of the experiment. The first of equals decides.
    """
    default = position(experiment)
    asserted = {check.id: check for check in experiment.checks}

    def rank(entry: Mapping[str, Any]) -> tuple[int, bool, int]:
        check = asserted.get(entry["id"])
        kind = check.measured.kind if check else entry["kind"]
        if kind == "converges":
            demotion = int(check is not None and check.kind == "claim")
        else:
            demotion = 3 if kind == "equal" else 2
        return -SEVERITY[entry["status"]], is_trap(check), demotion

    if not summary["checks"]:
        return Lead(default, data.of_case(record, 0)[0])
    entry = min(summary["checks"], key=rank)
    check = asserted.get(entry["id"])
    name = str(entry.get("quantity") or default)
    is_compared = any(f"{name}_{kind}_norm" in record for kind in ("difference", "error"))
    quantity = name if is_compared else default
    result = entry["results"][0]
    return Lead(quantity, data.of_result(record, result), entry, check)
