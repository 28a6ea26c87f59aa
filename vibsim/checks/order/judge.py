"""What a ``converges`` check measured, compared with what was expected of every scheme and member."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.formal_orders import columns_of, formal_orders
from vibsim.checks.fields import Field, facts, measured
from vibsim.checks.order.measure import FIELDS
from vibsim.checks.outcome import FAIL, INCONCLUSIVE, PASS, Outcome
from vibsim.core.record import Record
from vibsim.core.vocabulary import REASON_NAMES, STATUSES
from vibsim.experiment.data import schemes_of

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import ConvergesCheck

Floats = NDArray[np.float64]

EXPECTED = Field("order that is expected; none where the quantity is to be exact")


def converges(experiment: Experiment, record: Record, check: ConvergesCheck, id_: str) -> Outcome:
    """Compare the verdict on a quantity, of every scheme and member, with the expected one.

    Parameters
    ----------
    record
        Convergence Record.
    id_
        Id of the check in it.
    """
    found = facts(record, id_, FIELDS)
    status, reason = (measured(record, id_, field) for field in ("status", "reason"))
    order = expected_order(experiment, record, check)
    names = record.words("scheme")
    chosen = list(schemes_of(experiment, check))

    expect = check.expect
    as_expected = status == STATUSES.index(expect.status)
    if expect.reason is not None:
        as_expected &= reason == REASON_NAMES.index(expect.reason)
    open_ = status == INCONCLUSIVE
    return Outcome(
        schemes=[names[i] for i in chosen],
        cases=np.asarray(record["case"]),
        scheme_index=chosen,
        case_index=np.arange(len(record["case"])),
        status=status,
        reason=reason,
        compared=np.where(as_expected, PASS, np.where(open_, INCONCLUSIVE, FAIL)).astype(np.int8),
        away=np.abs(measured(record, id_, "order") - order),
        facts={**found, "expected": (EXPECTED, np.broadcast_to(order, status.shape))},
    )


def expected_order(experiment: Experiment, record: Record, check: ConvergesCheck) -> Floats:
    """Return the order that a check expects, shape (scheme, 1 or case)."""
    if check.order == "scheme":
        return formal_orders(experiment, check.converges, columns_of(record))
    return np.full((len(experiment.schemes), 1), float(check.order))
