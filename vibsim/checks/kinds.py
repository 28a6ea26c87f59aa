"""The kinds of checks: how each one measures, judges, and describes its results."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import NamedTuple

from vibsim.checks import (
    accurate,
    energy,
    equal,
    number_units,
    order,
    order_text,
    reductions,
    stable,
    value,
)
from vibsim.checks.fields import Field, Measured, field_values, result_fields, variables
from vibsim.checks.outcome import Judged, Outcome, outcome_of
from vibsim.checks.sentences import Description
from vibsim.comparison.quantity_comparison import Compared
from vibsim.core.record import Record, Variable
from vibsim.experiment import Experiment
from vibsim.experiment.schema.checks import Measurement
from vibsim.observe.member_block import MemberBlock


class Kind(NamedTuple):
    """A kind of check that measures something."""

    fields: Mapping[str, Field]
    """The stored variables."""
    measure: Callable[..., Measured]
    """Takes a block of members, the compared quantities and the check; returns the values of the fields."""
    judge: Callable[..., Judged]
    """Takes the experiment, the convergence Record, the check and the values of its fields."""
    describe: Callable[..., Description]
    """Takes `MemberFacts` and the check."""


KINDS: Mapping[str, Kind] = {
    "converges": Kind(order.FIELDS, order.measure, order.judge, order_text.describe),
    "accurate": Kind(accurate.FIELDS, accurate.measure, accurate.judge, accurate.describe),
    "value": Kind(value.FIELDS, value.measure, reductions.judge, reductions.describe),
    "stable": Kind(stable.FIELDS, stable.measure, stable.judge, stable.describe),
    "conserves": Kind(energy.FIELDS, energy.measure, energy.judge, energy.describe),
    "equal": Kind(equal.FIELDS, equal.measure, equal.judge, equal.describe),
}


def check_variables(block: MemberBlock, compared: Compared) -> dict[str, Variable]:
    """Return the measured fields of all checks of an experiment, including those that only figures need."""
    table: dict[str, Variable] = {}
    for check in block.experiment.checks:
        kind = KINDS[check.measured.kind]
        values = kind.measure(block, compared, check.measured)
        units = _units(block, compared, check.measured)
        table |= variables(check.id, kind.fields, values, units, block.lean)
    return table


def _units(block: MemberBlock, compared: Compared, check: Measurement) -> dict[str, str]:
    """Return the unit of the quantity or of the number of a check."""
    known = {name: "" if q.units == "1" else q.units for name, q in compared.items()}
    if check.kind == "value":
        position = block.model.position
        # UDUNITS has no roots, so an L2 norm is stored with the unit of its quantity
        unit = number_units.unit_of_number(check, known, position, "s").removesuffix(" sqrt(s)")
        return {"number": unit}
    return {"quantity": known.get(getattr(check, "quantity", ""), "")}


def judge(experiment: Experiment, record: Record, check: Measurement, id_: str) -> Outcome:
    """Compare the measured fields of a check with its expectation."""
    kind = KINDS[check.kind]
    measured = {
        name: field_values(record, id_, name)
        for name, field in kind.fields.items()
        if not field.of_figure
    }
    facts = {name: (field, measured[name]) for name, field in result_fields(kind.fields).items()}
    judged = kind.judge(experiment, record, check, measured)
    return outcome_of(experiment, record, check, judged, facts)


def definition(experiment: Experiment) -> str:
    """Return the definition of all checks as text, to detect verdicts that belong to other checks."""
    rows = [check.measured.model_dump(mode="json") for check in experiment.checks]
    return json.dumps(rows, sort_keys=True)
