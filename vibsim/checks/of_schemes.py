"""What the checks ``stable``, ``conserves`` and ``equal`` have in common: schemes and members, and rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.checks.fields import Facts
from vibsim.checks.outcome import FAIL, INCONCLUSIVE, PASS, Outcome
from vibsim.convergence.ladder_statistics import BLAME
from vibsim.core.record import Record
from vibsim.core.vocabulary import REASON_NAMES
from vibsim.experiment.data import schemes_of
from vibsim.observe.member_block import Part

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
BROKEN = "Start `levels:` at a finer level, or shorten `time: end`."
"""Advice where the calculation met a number that is not finite."""
MOTIONS = ("moves", "rests")
NOTHING_MOVES = "Nothing moves here: {} stays what it was at the start, whatever the scheme does"
MOVE = "Choose `initial:` values, or a force, with which something moves."
"""Advice where nothing moves."""


def level_of(part: Part, check: StableCheck | ConservesCheck | EqualCheck) -> int:
    """Return the level that a check is about: the finest one where it names none."""
    return part.grid.levels[-1] if check.level is None else check.level


def lies_still(part: Part, level: int) -> NDArray[np.bool_]:
    """Say where no position moves by more than round-off at any step of a level, shape (scheme, case)."""
    record, still = part.records[level], np.ones(part.shape, dtype=bool)
    floor = BLAME * part.relative_floor[..., part.grid.levels.index(level)]
    for name in part.model.positions:
        if f"{name}_min" not in record:
            return np.zeros(part.shape, dtype=bool)
        low, high = (np.asarray(record[f"{name}_{end}"], dtype=float) for end in ("min", "max"))
        with np.errstate(invalid="ignore"):
            still &= high - low <= floor * np.maximum(np.abs(low), np.abs(high))
    return still


def by_reason(
    experiment: Experiment,
    record: Record,
    check: ConservesCheck | EqualCheck,
    found: Facts,
    reason: NDArray[Any],
    value: Floats,
    expected: str,
    tell: Callable[[int, int], str],
    away: Floats,
    advise: Callable[[int, int], str],
) -> Outcome:
    """Return the outcome of a check that expects a PASS, from its reasons."""
    statuses = {
        MATCH: PASS,
        NOT_APPLICABLE: INCONCLUSIVE,
        PRE_ASYMPTOTIC: INCONCLUSIVE,
        ROUND_OFF: INCONCLUSIVE,
    }
    status = np.full(reason.shape, FAIL, dtype=np.int8)
    for code, which in statuses.items():
        status[reason == code] = which
    return outcome_of(
        experiment,
        record,
        check,
        status=status,
        reason=reason.astype(np.int8),
        compared=status,
        away=away,
        expected=expected,
        expects_pass=True,
        quantity=check.about,
        tell=tell,
        advise=lambda scheme, case: (
            BROKEN if reason[scheme, case] == NON_FINITE else advise(scheme, case)
        ),
        value=value,
        facts=found,
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


def place_of(record: Record, level: int) -> int:
    """Return the position of a level in a record."""
    return [int(known) for known in record["level"]].index(level)
