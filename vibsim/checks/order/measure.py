"""What a ``converges`` check measures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.checks.fields import Field
from vibsim.checks.order.required_levels import finest_readable, more_levels
from vibsim.comparison.order_causes import CAUSES, causes
from vibsim.comparison.order_evidence import judge_check, order_of
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.core.vocabulary import REASON_NAMES, STATUSES

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ConvergesCheck

FIELDS = {
    "status": Field("status", np.int8, STATUSES),
    "reason": Field("reason", np.int8, REASON_NAMES),
    "order": Field("observed order"),
    "order_low": Field("lower end of the interval of the order"),
    "order_high": Field("upper end of the interval of the order"),
    "levels": Field(
        "first and last level that the order rests on, -1 for none",
        np.int16,
        none=-1,
        dims=("scheme", "case", "end"),
    ),
    "failed_level": Field("coarsest level that broke down, -1 for none", np.int16, none=-1),
    "levels_needed": Field("finer levels that are probably needed, -1 unknown", np.int8, none=-1),
    "readable_level": Field(
        "finest level at which the order can be read, -1 unknown", np.int8, none=-1
    ),
    "readable_level_compensated": Field("the same in compensated arithmetic", np.int8, none=-1),
    "cause": Field("why the order is another one, as far as it is known", np.int8, CAUSES),
}


def measure(compared: Mapping[str, Comparison], check: ConvergesCheck) -> Mapping[str, Any]:
    """Return what a check measures, with what would settle a verdict that is open, or explain it."""
    quantity, norm = compared[check.converges], check.norm
    judged, order = judge_check(quantity, check), order_of(quantity, check)
    return {
        "status": judged.status,
        "reason": judged.reason,
        "order": judged.order,
        "order_low": judged.low,
        "order_high": judged.high,
        "levels": np.stack([judged.first, judged.last], axis=-1),
        "failed_level": judged.culprit,
        "levels_needed": more_levels(quantity, judged, order, check.tolerance),
        "readable_level": finest_readable(quantity, judged, norm, order),
        "readable_level_compensated": finest_readable(quantity, judged, norm, order, "compensated"),
        "cause": causes(quantity, compared, judged, norm, order, check.tolerance),
    }
