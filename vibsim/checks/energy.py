"""The check ``conserves``: how the error of the energy grows with time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.apriori.formal_orders import columns_of, formal_orders
from vibsim.checks.fields import Field, measured
from vibsim.checks.of_schemes import (
    MATCH,
    MISMATCH,
    MOTIONS,
    NON_FINITE,
    NOT_APPLICABLE,
    PRE_ASYMPTOTIC,
    ROUND_OFF,
    by_reason,
    level_of,
    lies_still,
)
from vibsim.checks.outcome import Outcome
from vibsim.core.record import Record
from vibsim.core.vocabulary import DRIFTS
from vibsim.observe.energy_drift import drift_at
from vibsim.observe.member_block import MemberBlock

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import ConservesCheck

FIELDS = {
    "drift": Field("how the energy error grows", np.int8, DRIFTS),
    "drift_rate": Field("rate of the drift per period, as a part of the energy at the start"),
    "drift_power": Field("power of time with which the energy error grows"),
    "energy_error": Field("largest energy error, as a part of the energy at the start"),
    "motion": Field("whether anything moves", np.int8, MOTIONS),
    "level": Field("level", np.int16, dims=()),
    "window_means": Field(
        "means of the largest energy error so far over [T/8, T/4], [T/4, T/2] and [T/2, T], in the unit of the energy",
        dims=("scheme", "case", "window"),
        of_figure=True,
    ),
    "round_off": Field(
        "largest energy error that is taken for round-off, in the unit of the energy",
        of_figure=True,
    ),
}


def measure(block: MemberBlock, check: ConservesCheck) -> Mapping[str, Any]:
    """Return what a check measures."""
    level = level_of(block, check)
    found = drift_at(block, level, check.about or "")
    return {
        "drift": found.kind,
        "drift_rate": found.rate,
        "drift_power": found.power,
        "energy_error": found.largest,
        "motion": lies_still(block, level),
        "level": level,
        "window_means": found.means,
        "round_off": found.round_off,
    }


def judge(experiment: Experiment, record: Record, check: ConservesCheck, id_: str) -> Outcome:
    """Compare how the energy error grows with what a check expects."""
    kind, largest = (measured(record, id_, field) for field in ("drift", "energy_error"))
    still = measured(record, id_, "motion") != 0
    broken = record["status"][..., record.place("level", int(measured(record, id_, "level")))] != 0
    wanted = {DRIFTS.index(check.drift)}
    if check.drift == "bounded":
        # what is conserved is bounded too
        wanted.add(DRIFTS.index("none"))
    unclear = kind == DRIFTS.index("unclear")
    # an error that theory has, lost in round-off, may grow in any way; one that it has not does not grow
    has_error = np.isfinite(formal_orders(experiment, check.about or "", columns_of(record)))
    lost = (kind == DRIFTS.index("none")) & has_error
    masks = [
        (broken, NON_FINITE),
        (np.isnan(largest) & unclear, NOT_APPLICABLE),
        (still & (kind == DRIFTS.index("none")), NOT_APPLICABLE),
        # an error above round-off is not none, however short the run
        (unclear & (check.drift != "none"), PRE_ASYMPTOTIC),
        (np.isin(kind, list(wanted)), MATCH),
        (lost, ROUND_OFF),
    ]
    reason = np.select([mask for mask, _ in masks], [code for _, code in masks], MISMATCH)

    return by_reason(experiment, record, check, id_, FIELDS, reason, away=largest)
