"""What a report shows: the check that decides, which quantities, and which members of a sweep."""

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
    """Return every finite order that is due to a quantity, with its tolerance, in ascending order.

    It is what a scheme promises; of a part of an error of which theory says nothing, what its checks expect.
    What is exact has no order to compare with, nor has a scheme that chooses its own steps.
    """
    asked_for = {
        (float(check.order), check.tolerance)
        for check in _on_order(experiment, quantity)
        if isinstance(check.order, float)
    }
    if data.basis_of_order(record, quantity) == "expected" and asked_for:
        return sorted(asked_for)
    promised = data.formal_orders(record, quantity)
    found = {
        (float(order), tolerance(experiment, quantity, scheme))
        for s, scheme in enumerate(record.words("scheme"))
        for order in np.unique(promised[s][np.isfinite(promised[s])])
    }
    return sorted(found)


def tolerance(experiment: Experiment, quantity: str, scheme: str) -> float:
    """Return the smallest tolerance of a check that is about the order of a quantity by a scheme."""
    checks = _on_order(experiment, quantity)
    found = [row.tolerance for row in checks if row.schemes is None or scheme in row.schemes]
    return min(found, default=ORDER_TOLERANCE)


def _on_order(experiment: Experiment, quantity: str) -> list[ConvergesCheck]:
    inner = [check.measured for check in experiment.checks]
    return [row for row in inner if row.kind == "converges" and row.converges == quantity]


def position(experiment: Experiment) -> str:
    """Return the name of the model's position."""
    return experiment.model.definition.position


def asked_values(experiment: Experiment) -> list[ValueCheck]:
    """Return the numbers that checks ask for, those of statements among them."""
    inner = [check.measured for check in experiment.checks]
    return [row for row in inner if row.kind == "value"]


def has_swept_options(experiment: Experiment, spec: SchemeSpec) -> bool:
    """Say whether the sweep varies an option of a scheme."""
    keys = experiment.sweep.keys if experiment.sweep is not None else ()
    return any(key.startswith(f"schemes.{spec.name}.") for key in keys)


def quantities(experiment: Experiment, record: Record) -> list[str]:
    """Return the quantities to show: the position, those that a check names, and the energy deviation."""
    extra = ["energy_deviation"] if experiment.model.definition.conservative else []
    wanted = dict.fromkeys([position(experiment), *checked_quantities(experiment), *extra])
    return [name for name in wanted if f"{name}_order" in record]


def first(experiment: Experiment, record: Record) -> str:
    """Return the first of the `quantities`; the position where the record has no order of any."""
    return next(iter(quantities(experiment, record)), position(experiment))


def members(record: Record, quantity: str, decisive: Member | None = None) -> list[Member]:
    """Return what the figures over time show of a quantity: of every scheme one member, or two of a sweep.

    These are the one that is `decisive`, else the worst, judged by the verdicts on `quantity` and then by the distance
    of the order from the promised one (of several schemes the worst decides), and a typical one of those that pass, if
    any does.
    """
    if not data.swept(record) or f"{quantity}_status" not in record:
        # a large sweep has verdicts on what checks ask about alone
        return data.of_case(record, 0 if decisive is None else decisive.case)
    status = data.flags(record, f"{quantity}_status")
    severity = np.max([(status == word) * rank for word, rank in SEVERITY.items()], axis=(0, 1))
    away = np.abs(deviation(record, quantity))
    ranking = np.lexsort((np.max(np.where(np.isnan(away), np.inf, away), axis=0), severity))
    # the healthiest: members that most schemes pass, and of the others those that fewest fail
    score = np.sum(status == "PASS", axis=0) * (len(status) + 1) - np.sum(status == "FAIL", axis=0)
    healthy = ranking[score[ranking] == score.max()]
    last = int(ranking[-1]) if decisive is None else decisive.case
    roles = {int(healthy[healthy.size // 2]): "typical", last: "worst"}
    shown = reversed(roles.items())
    return [member for case, role in shown for member in data.of_case(record, case, role)]


def worst(record: Record, quantity: str) -> Member:
    """Return the worst member, judged as by `members`, with the scheme that is worst of it."""
    found = [member for member in members(record, quantity) if member.role != "typical"]
    if f"{quantity}_status" not in record:
        return found[0]
    status, away = data.flags(record, f"{quantity}_status"), np.abs(deviation(record, quantity))

    def badness(member: Member) -> tuple[int, float]:
        place = member.scheme, member.case
        return SEVERITY[status[place]], float(np.nan_to_num(away[place], nan=np.inf))

    return max(found, key=badness)


def with_levels(experiment: Experiment, found: list[Member]) -> list[Member]:
    """Leave out schemes that choose their own steps, which no level changes, unless there are no others."""
    return [m for m in found if not experiment.schemes[m.scheme].adaptive] or found


@dataclass(frozen=True)
class Lead:
    """The check that decides; an experiment without checks has none."""

    quantity: str
    """Whose error is shown: that of the check, or the position."""
    member: Member
    entry: Mapping[str, Any] | None = None
    """The check in the summary."""
    asserted: Check | None = None
    """The check in the experiment; None for its tolerance."""

    @property
    def measured(self) -> Measurement | None:
        """What the check measures."""
        return None if self.asserted is None else self.asserted.measured

    @property
    def result(self) -> Mapping[str, Any]:
        """The worst result of the check."""
        return {} if self.entry is None else self.entry["results"][0]

    @property
    def facts(self) -> Mapping[str, Any]:
        """What was measured where the check is decided."""
        return self.result.get("facts") or {}

    @property
    def is_on_order(self) -> bool:
        """Whether the check asks for an order."""
        return self.measured is not None and self.measured.kind == "converges"

    @property
    def norm(self) -> str:
        """The norm over time in which the order was judged."""
        check = self.measured
        return check.norm if check is not None and check.kind == "converges" else TYPICAL_NORM


def is_refutation(check: Check | None) -> bool:
    """Say whether a check expects a statement to be false."""
    return check is not None and check.kind == "claim" and not check.holds


def is_trap(check: Check | None) -> bool:
    """Say whether a check expects a verdict other than PASS, or a statement to be false."""
    expected = getattr(check, "expect", None)
    return is_refutation(check) or (expected is not None and expected.status != "PASS")


def find_lead(experiment: Experiment, record: Record, summary: Mapping[str, Any]) -> Lead:
    """Return the check that decides: the worst one; of those that passed the most telling that is no trap.

    The most telling is on an order, and the least that two solutions are equal: that says how well the steps were
    computed, and seldom what was asked. Of equals the first decides.
    """
    usual = position(experiment)
    asserted = {check.id: check for check in experiment.checks}

    def rank(entry: Mapping[str, Any]) -> tuple[int, bool, int]:
        check = asserted.get(entry["id"])
        kind = check.measured.kind if check else entry["kind"]
        if kind == "converges":
            telling = int(check is not None and check.kind == "claim")
        else:
            telling = 3 if kind == "equal" else 2
        return -SEVERITY[entry["status"]], is_trap(check), telling

    listed = [entry for entry in summary["checks"] if entry.get("results")]
    if not listed:
        return Lead(usual, data.of_case(record, 0)[0])
    entry = min(listed, key=rank)
    check = asserted.get(entry["id"])
    named = str(entry.get("quantity") or usual)
    is_compared = any(f"{named}_{of}_norm" in record for of in ("difference", "error"))
    quantity = named if is_compared else usual
    result = entry["results"][0]
    every = data.of_case(record, data.place_of(record, result.get("case", -1)) or 0)
    member = next((one for one in every if one.scheme_name == result.get("scheme")), every[0])
    return Lead(quantity, member, entry, check)
