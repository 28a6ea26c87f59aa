"""What a ``value`` check measures: a number for every scheme and member, and whether it is as it should be."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim.checks.fields import facts, measured
from vibsim.checks.outcome import FAIL, INCONCLUSIVE, PASS, Outcome
from vibsim.checks.value.criteria import compare, lacks_levels, sees_several_levels
from vibsim.checks.value.measure import FIELDS
from vibsim.comparison.best_values import has_limit
from vibsim.core.record import Record
from vibsim.core.vocabulary import REASON_NAMES
from vibsim.experiment.data import schemes_of

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import ValueCheck

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

FROM_THEORY = frozenset(
    {
        "stability_limit",
        "exact_degree",
        "predicted_growth_per_period",
        "predicted_frequency",
        "predicted_phase_error",
    }
)
"""Numbers that no run enters."""
SURVIVES_FAILURE = frozenset({"at", "exact_period", "growth_per_period"}) | FROM_THEORY
"""Numbers that may be sound although the member broke down later."""
MAY_BE_INFINITE = frozenset({"exact_period"})
"""Numbers that are infinite for a sound member, on the separatrix: they do not exist there."""
UNBOUNDED = frozenset({"stability_limit"})
"""Numbers of which infinity is a value: above every other number."""
FEW = 3
"""Fewer levels do not show how large an error is."""


def valued(experiment: Experiment, record: Record, check: ValueCheck, id_: str) -> Outcome:
    """Compare a measured number with what the check asks of it.

    A limit of several levels that misses what is asked by less than its bound may be right: nothing is decided then.

    Parameters
    ----------
    record
        Convergence Record.
    id_
        Id of the check in it.
    """
    number, bound = (measured(record, id_, field) for field in ("value", "error_bound"))
    names = record.words("scheme")
    at = check.at
    schemes = list(schemes_of(experiment, check))
    every = np.asarray(record["case"])
    cases = np.flatnonzero(every == at.case) if at.case is not None else np.arange(len(every))
    holds, away = compare(check, number)
    lost = _failed(record, check) & ~(
        np.isfinite(number) if check.value in SURVIVES_FAILURE else np.zeros_like(holds)
    )
    infinite = np.isinf(number) & (check.value not in UNBOUNDED)
    if check.value in MAY_BE_INFINITE:
        infinite, number = np.zeros_like(infinite), np.where(infinite, np.nan, number)
    open_ = _is_open(check, away, bound)
    masks = [lost | infinite, np.isnan(number), holds, open_]
    status = np.select(masks, [FAIL, INCONCLUSIVE, PASS, INCONCLUSIVE], FAIL).astype(np.int8)
    few = "too_few_levels" if len(record["level"]) < FEW else "pre_asymptotic"
    missing = "too_few_levels" if lacks_levels(experiment, check) else "not_applicable"
    codes = [REASON_NAMES.index(name) for name in ("non_finite", missing, "match", few)]
    reason = np.select(masks, codes, REASON_NAMES.index("mismatch"))
    return Outcome(
        schemes=[names[i] for i in schemes],
        scheme_index=schemes,
        cases=every,
        case_index=cases,
        status=status,
        reason=reason,
        compared=status,
        away=away,
        facts=facts(record, id_, FIELDS),
    )


def _is_open(check: ValueCheck, away: Floats, bound: Floats) -> Flags:
    """Say where a number misses what is asked by no more than its error may be."""
    if not has_limit(check.value, check.at.level):
        return np.zeros(away.shape, dtype=bool)
    return ~(away > bound)


def _failed(record: Record, check: ValueCheck) -> Flags:
    """Say which members broke down at a level that the value depends on, shape (scheme, case)."""
    broken = record["status"] != 0
    level = check.at.level
    if sees_several_levels(check.value) or level == "best":
        return np.asarray(np.any(broken, axis=-1))
    levels = [int(known) for known in record["level"]]
    index = levels.index(level) if isinstance(level, int) and level in levels else -1
    return np.asarray(broken[..., index])
