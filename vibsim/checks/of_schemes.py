"""What the checks ``stable``, ``conserves`` and ``equal`` have in common: schemes and members, and rest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.checks.fields import Field, facts
from vibsim.checks.outcome import Outcome
from vibsim.convergence.thresholds import ABOVE_ROUND_OFF
from vibsim.core.record import Record
from vibsim.core.vocabulary import REASON_NAMES, REASONS, STATUSES
from vibsim.experiment.data import schemes_of
from vibsim.observe.member_block import MemberBlock

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import ConservesCheck, EqualCheck, StableCheck

Floats = NDArray[np.float64]

MATCH, MISMATCH, UNSTABLE, NON_FINITE, PRE_ASYMPTOTIC, NOT_APPLICABLE, ROUND_OFF = map(
    REASON_NAMES.index,
    (
        "match",
        "mismatch",
        "unstable",
        "non_finite",
        "pre_asymptotic",
        "not_applicable",
        "round_off",
    ),
)
MOTIONS = ("moves", "rests")


def level_of(block: MemberBlock, check: StableCheck | ConservesCheck | EqualCheck) -> int:
    """Return the level that a check is about: the finest one where it names none."""
    return block.grid.levels[-1] if check.level is None else check.level


def lies_still(block: MemberBlock, level: int) -> NDArray[np.bool_]:
    """Say where no position moves by more than round-off at any step of a level, shape (scheme, case)."""
    record, still = block.records[level], np.ones(block.shape, dtype=bool)
    floor = ABOVE_ROUND_OFF * block.relative_floor[..., block.grid.levels.index(level)]
    for name in block.model.positions:
        if f"{name}_min" not in record:
            return np.zeros(block.shape, dtype=bool)
        low, high = (np.asarray(record[f"{name}_{end}"], dtype=float) for end in ("min", "max"))
        with np.errstate(invalid="ignore"):
            still &= high - low <= floor * np.maximum(np.abs(low), np.abs(high))
    return still


def by_reason(
    experiment: Experiment,
    record: Record,
    check: ConservesCheck | EqualCheck,
    id_: str,
    fields: Mapping[str, Field],
    reason: NDArray[Any],
    away: Floats,
) -> Outcome:
    """Return the outcome of a check that expects a PASS, from its reasons."""
    statuses = np.array([STATUSES.index(status) for status in REASONS.values()], dtype=np.int8)
    status = statuses[reason]
    return outcome_of(
        experiment,
        record,
        check,
        status=status,
        reason=reason.astype(np.int8),
        compared=status,
        away=away,
        facts=facts(record, id_, fields),
    )


def outcome_of(
    experiment: Experiment,
    record: Record,
    check: StableCheck | ConservesCheck | EqualCheck,
    **more: Any,
) -> Outcome:
    """Return an outcome with the schemes and members that a check is about."""
    names, every = record.words("scheme"), np.asarray(record["case"])
    schemes = (
        [names.index(check.first)] if check.kind == "equal" else list(schemes_of(experiment, check))
    )
    cases = np.arange(len(every)) if check.case is None else np.flatnonzero(every == check.case)
    return Outcome(
        schemes=[names[i] for i in schemes],
        scheme_index=schemes,
        cases=every,
        case_index=cases,
        **more,
    )
