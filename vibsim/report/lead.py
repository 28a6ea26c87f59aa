"""What the top of a page is about: the check that decides, its quantity, and the member of its worst result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from vibsim.core.record import Record
from vibsim.core.vocabulary import SEVERITY, TYPICAL_NORM
from vibsim.report import choice, data
from vibsim.report.data import Member
from vibsim.report.types import Check, Experiment, Measurement


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
    def is_on_order(self) -> bool:
        """Whether the check asks for an order."""
        return self.measured is not None and self.measured.kind == "converges"

    @property
    def norm(self) -> str:
        """The norm over time in which the order was judged."""
        check = self.measured
        return check.norm if check is not None and check.kind == "converges" else TYPICAL_NORM


def is_trap(check: Check | None) -> bool:
    """Say whether a check expects a verdict other than PASS, or a statement to be false."""
    if check is None:
        return False
    if check.kind == "claim":
        return not check.holds
    expected = getattr(check, "expect", None)
    return expected is not None and expected.status != "PASS"


def find(experiment: Experiment, record: Record, summary: Mapping[str, Any]) -> Lead:
    """Return the check that decides: the worst one; of those that passed the most telling that is no trap.

    The most telling is on an order, and the least that two solutions are equal: that says how well the steps were
    computed, and seldom what was asked. Of equals the first decides.
    """
    position = choice.position(experiment)
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
        return Lead(position, _member(record, {}))
    entry = min(listed, key=rank)
    check = asserted.get(entry["id"])
    named = str(entry.get("quantity") or position)
    is_compared = any(f"{named}_{of}_norm" in record for of in ("difference", "error"))
    quantity = named if is_compared else position
    return Lead(quantity, _member(record, entry["results"][0]), entry, check)


def _member(record: Record, result: Mapping[str, Any]) -> Member:
    """Return the scheme and the member of a result; the first ones where it names none."""
    names = record.words("scheme")
    scheme = names.index(result["scheme"]) if result.get("scheme") in names else 0
    case = data.place_of(record, result.get("case", -1)) or 0
    return Member(scheme, case, names[scheme], data.case_name(record, case))
