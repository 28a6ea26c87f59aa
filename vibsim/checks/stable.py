"""The check ``stable``: whether schemes grow where the exact solution does not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.checks.fields import Field, facts, measured
from vibsim.checks.growth import growth_at
from vibsim.checks.of_schemes import (
    MATCH,
    MISMATCH,
    NON_FINITE,
    UNSTABLE,
    level_of,
    outcome_of,
)
from vibsim.checks.outcome import FAIL, PASS, Outcome
from vibsim.core.record import Record
from vibsim.core.vocabulary import REASON_NAMES, STATUSES
from vibsim.observe.member_block import MemberBlock

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import StableCheck

FIELDS = {
    "status": Field("status", np.int8, STATUSES),
    "reason": Field(
        "match where it is stable, mismatch where theory and growth differ, non_finite where the motion itself ends",
        np.int8,
        REASON_NAMES,
    ),
    "growth": Field("growth factor of the amplitude per period"),
    "predicted_growth": Field("the same by theory"),
    "omega_dt": Field("highest w dt"),
    "level": Field("level", np.int16, dims=()),
}


def measure(block: MemberBlock, check: StableCheck) -> Mapping[str, Any]:
    """Return what a check measures."""
    level = level_of(block, check)
    found = growth_at(block, level)
    reason = np.select([found.unstable, found.escaped], [UNSTABLE, NON_FINITE], MATCH)
    return {
        "status": np.where((reason != MATCH) | found.contradicted, FAIL, PASS),
        "reason": np.where(found.contradicted, MISMATCH, reason),
        "growth": found.measured,
        "predicted_growth": found.predicted,
        "omega_dt": np.broadcast_to(block.fastest[:, block.grid.levels.index(level)], block.shape),
        "level": level,
    }


def judge(experiment: Experiment, record: Record, check: StableCheck, id_: str) -> Outcome:
    """Compare whether schemes are stable with what a check expects."""
    status, reason, growth = (
        measured(record, id_, field) for field in ("status", "reason", "growth")
    )
    as_expected = reason == (MATCH if check.stable else UNSTABLE)
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.abs(np.log(growth))
    return outcome_of(
        experiment,
        record,
        check,
        status=status,
        reason=reason,
        compared=np.where(as_expected, PASS, FAIL).astype(np.int8),
        away=np.where(np.isnan(size), np.inf, size),
        facts=facts(record, id_, FIELDS),
    )
