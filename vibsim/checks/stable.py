"""The check ``stable``: whether schemes grow where the exact solution does not."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.apriori.formal_orders import columns_of, stability_limits
from vibsim.checks.fields import Field, facts, measured
from vibsim.checks.growth import growth_at
from vibsim.checks.numbers_in_words import growth_in_words, number, vanishing_in_words
from vibsim.checks.of_schemes import (
    MATCH,
    MISMATCH,
    NON_FINITE,
    UNSTABLE,
    level_of,
    outcome_of,
    place_of,
)
from vibsim.checks.outcome import FAIL, PASS, Outcome
from vibsim.core.record import Record
from vibsim.core.vocabulary import REASON_NAMES, STATUSES
from vibsim.observe.member_block import Part

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


def measure(part: Part, check: StableCheck) -> Mapping[str, Any]:
    """Return what a check measures."""
    level = level_of(part, check)
    found = growth_at(part, level)
    reason = np.select([found.unstable, found.escaped], [UNSTABLE, NON_FINITE], MATCH)
    return {
        "status": np.where((reason != MATCH) | found.contradicted, FAIL, PASS),
        "reason": np.where(found.contradicted, MISMATCH, reason),
        "growth": found.measured,
        "predicted_growth": found.predicted,
        "omega_dt": np.broadcast_to(part.fastest[:, part.grid.levels.index(level)], part.shape),
        "level": level,
    }


def judge(experiment: Experiment, record: Record, check: StableCheck, id_: str) -> Outcome:
    """Compare whether schemes are stable with what a check expects."""
    status, reason, growth, expected, p = (
        measured(record, id_, field)
        for field in ("status", "reason", "growth", "predicted_growth", "omega_dt")
    )
    level = int(measured(record, id_, "level"))
    as_expected = reason == (MATCH if check.stable else UNSTABLE)
    # a scheme without a limit of its own grows at every step
    limits = record["stability_limit"] if "stability_limit" in record else np.zeros(reason.shape)
    never = np.broadcast_to(np.asarray(limits) == 0.0, reason.shape)

    model = experiment.model.definition

    def failed_at(scheme: int, case: int) -> float:
        place = (scheme, case, place_of(record, level))
        return float(record["failure_time"][place]) if record["status"][place] else np.nan

    def tell(scheme: int, case: int) -> str:
        name = experiment.schemes[scheme].name
        if reason[scheme, case] == NON_FINITE:
            t = failed_at(scheme, case)
            when = "" if np.isnan(t) else f", at t = {t:.4g}"
            return (
                f"Scheme {name} met a number that is not finite or too large at level {level}{when}, and the finest "
                "levels do so at one time: the motion itself escapes there, or a formula has no finite value, which "
                "tells nothing of stability."
            )
        unstable = reason[scheme, case] != MATCH
        word = "unstable" if unstable else "stable"
        told = f"Scheme {name} is {word} at level {level}"
        if np.isfinite(p[scheme, case]):
            told += f", w dt = {p[scheme, case]:.4g}"
        factors = float(expected[scheme, case]), float(growth[scheme, case])
        told += growth_in_words(*factors, (model.conservative, model.linear, len(model.positions)))
        if not unstable and never[scheme, case]:
            told += vanishing_in_words(*factors)
        if not np.isnan(t := failed_at(scheme, case)):
            told += f"; it met a number that is not finite or too large at t = {t:.4g}"
        if reason[scheme, case] == MISMATCH:
            told += "; the two do not agree, so the scheme is not what the theory is of"
        return told + "."

    def word_of(scheme: int, case: int) -> str:
        return REASON_NAMES[int(reason[scheme, case])]

    def limit_of(scheme: int, case: int) -> float:
        known = stability_limits(experiment, columns_of(record))[scheme]
        return float(known[case if len(known) > 1 else 0])

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
        expected="stable" if check.stable else "unstable",
        expects_pass=check.stable,
        quantity=None,
        tell=tell,
        advise=lambda scheme, case: _advise(
            word_of(scheme, case),
            level,
            float(p[scheme, case]),
            limit_of(scheme, case),
            failed_at(scheme, case),
        ),
        value=growth,
        facts=facts(record, id_, FIELDS),
    )


def _advise(reason: str, level: int, p: float, limit: float, failed: float = math.nan) -> str:
    """Say what to change where a scheme is not as stable as a check expects.

    Parameters
    ----------
    p, limit
        w dt at `level`, and the largest stable one.
    failed
        Time at which `level` met a number that is not finite; NaN where it did not.
    """
    if reason == "match":
        return "Set `stable: true`, or take coarser `levels:` where the scheme has a limit (w dt beyond it)."
    if reason == "mismatch":
        return (
            "Take another `kind:` in `schemes:`, or look for an error in this one: it does not grow as its own theory "
            "says."
        )
    if reason == "non_finite":
        before = "" if math.isnan(failed) else f" before t = {failed:.4g}"
        return f"End the time interval (`time: end`){before}, or check the formulas of `model:`."
    is_beyond = math.isfinite(limit) and math.isfinite(p) and p > limit > 0.0
    if not is_beyond and not math.isnan(failed):
        return (
            f"End the time interval (`time: end`) before t = {failed:.4g} if the motion itself escapes there, take "
            "finer `levels:` if it does not, or correct `stable:`."
        )
    if not is_beyond:
        return "Take finer `levels:`, shorten `time: end`, or correct `stable:`."
    first = level + math.ceil(math.log2(p / limit) - 1e-9)
    return f"Take finer `levels:`, from {first} on (w dt within the limit {number(limit)}), or correct `stable:`."
