"""What is done with every kind of check: what it measures, how that is judged, and how it is put into words."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import NamedTuple

from vibsim.checks import accurate, energy, equal, order, order_text, reductions, stable, value
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
    """What is stored of it."""
    measure: Callable[..., Measured]
    """Takes a block of members, the compared quantities and the check; returns the values of the fields."""
    judge: Callable[..., Judged]
    """Takes the experiment, the convergence Record, the check and the values of its fields."""
    describe: Callable[..., Description]
    """Takes a `Found` and the check."""


KINDS: Mapping[str, Kind] = {
    "converges": Kind(order.FIELDS, order.measure, order.judge, order_text.describe),
    "accurate": Kind(accurate.FIELDS, accurate.measure, accurate.judge, accurate.describe),
    "value": Kind(value.FIELDS, value.measure, reductions.judge, reductions.describe),
    "stable": Kind(stable.FIELDS, stable.measure, stable.judge, stable.describe),
    "conserves": Kind(energy.FIELDS, energy.measure, energy.judge, energy.describe),
    "equal": Kind(equal.FIELDS, equal.measure, equal.judge, equal.describe),
}


def check_variables(block: MemberBlock, compared: Compared) -> dict[str, Variable]:
    """Return what every check of an experiment measured, and what its figure needs beside that."""
    table: dict[str, Variable] = {}
    for check in block.experiment.checks:
        kind = KINDS[check.measured.kind]
        found = kind.measure(block, compared, check.measured)
        units = _units(block, compared, check.measured)
        table |= variables(check.id, kind.fields, found, units, block.lean)
    return table


def _units(block: MemberBlock, compared: Compared, check: Measurement) -> dict[str, str]:
    """Return the units of the quantity and of the number that a check is about."""
    known = {name: "" if q.units == "1" else q.units for name, q in compared.items()}
    if check.kind == "value":
        position = block.model.position
        # UDUNITS has no roots: as elsewhere an L2 norm has the unit of its quantity
        unit = value.unit_of_number(check, known, position, "s").removesuffix(" sqrt(s)")
        return {"number": unit}
    return {"quantity": known.get(getattr(check, "quantity", ""), "")}


def judge(experiment: Experiment, record: Record, check: Measurement, id_: str) -> Outcome:
    """Compare what a check measured with what it expects."""
    kind = KINDS[check.kind]
    found = {
        name: field_values(record, id_, name)
        for name, field in kind.fields.items()
        if not field.of_figure
    }
    facts = {name: (field, found[name]) for name, field in result_fields(kind.fields).items()}
    judged = kind.judge(experiment, record, check, found)
    return outcome_of(experiment, record, check, judged, facts)


def definition(experiment: Experiment) -> str:
    """Return what the checks measure, as text: a verdict belongs to the checks that were measured."""
    rows = [check.measured.model_dump(mode="json") for check in experiment.checks]
    return json.dumps(rows, sort_keys=True)
