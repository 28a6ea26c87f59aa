"""What a check on a part of an error must be: of a smooth motion, and with an order that is known."""

from __future__ import annotations

from vibsim.errors import nearest
from vibsim.models.error_parts import error_parts, has_error_parts
from vibsim.models.free import why_not_free
from vibsim.spec.check_places import Ladder
from vibsim.spec.checks import ConvergesCheck
from vibsim.spec.faults import Report
from vibsim.spec.source import Path_


def known_part(name: str, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check that a part of a position's error exists."""
    model = ladder.model
    if model is None or name in error_parts(model):
        return
    if has_error_parts(model):
        report.add(path, "unknown quantity", nearest(name, error_parts(model)), name)
        return
    what = "events" if model.events is not None else "a force with corners"
    rule = f"does not exist: {model.kind} has {what}, and only a smooth motion has a phase and an amplitude"
    report.add(path, rule, f"ask for {model.position}", name)


def promised_part(check: ConvergesCheck, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check that the order is given as a number where theory promises none."""
    model = ladder.model
    if model is None or check.order != "scheme" or check.converges not in error_parts(model):
        return
    reason = why_not_free(model)
    if reason:
        rule = (
            f"theory knows the order of {check.converges} on linear models without forces in time only, and "
            f"{model.kind} {reason}"
        )
        place = (*path, "order" if "order" in check.model_fields_set else "converges")
        report.add(place, rule, "give `order:` as a number")
