"""What the checks of an experiment measured of every scheme and member, as variables of the convergence Record."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from vibsim.checks import energy, equal, stable
from vibsim.checks.fields import Field, variables
from vibsim.checks.order import measure as order
from vibsim.checks.value import measure as value
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.core.record import Variable
from vibsim.observe.member_block import MemberBlock

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import Measurement

FIELDS: Mapping[str, Mapping[str, Field]] = {
    "converges": order.FIELDS,
    "value": value.FIELDS,
    "stable": stable.FIELDS,
    "conserves": energy.FIELDS,
    "equal": equal.FIELDS,
}
"""Kind of a check to what it measures."""


def measured(block: MemberBlock, compared: Mapping[str, Comparison]) -> dict[str, Variable]:
    """Return what every check measured, and what its figure needs beside that."""
    table: dict[str, Variable] = {}
    for check in block.experiment.checks:
        inner = check.measured
        found = _measure(block, compared, inner)
        table |= variables(check.id, FIELDS[inner.kind], found, block.lean)
    return table


def _measure(
    block: MemberBlock, compared: Mapping[str, Comparison], check: Measurement
) -> Mapping[str, Any]:
    match check.kind:
        case "converges":
            return order.measure(compared, check)
        case "value":
            return value.measure(block, compared, check)
        case "stable":
            return stable.measure(block, check)
        case "conserves":
            return energy.measure(block, check)
    return equal.measure(block, compared, check)


def definition(experiment: Experiment) -> str:
    """Return what the checks measure, as text: a verdict belongs to the checks that were measured."""
    rows = [check.measured.model_dump(mode="json") for check in experiment.checks]
    return json.dumps(rows, sort_keys=True)
