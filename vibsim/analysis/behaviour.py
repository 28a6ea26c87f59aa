"""The checks ``stable``, ``conserves`` and ``equal``: what they measured, compared with what they expect.

What was measured stands in the convergence Record (`vibsim.analysis.behaviour_measured`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.behaviour_advice import BROKEN, on_distance, on_drift, on_stability
from vibsim.analysis.numbers_in_words import growth_in_words, vanishing_in_words
from vibsim.analysis.outcome import FAIL, INCONCLUSIVE, PASS, Outcome
from vibsim.analysis.promise import columns_of, stability_limits
from vibsim.record import Record
from vibsim.spec.about import schemes_of
from vibsim.vocabulary import DRIFTS, REASON_NAMES

if TYPE_CHECKING:
    from vibsim.spec import Experiment
    from vibsim.spec.scheme_checks import ConservesCheck, EqualCheck, StableCheck

Floats = NDArray[np.float64]
Codes = NDArray[np.int8]

MATCH, MISMATCH, UNSTABLE, NON_FINITE, PRE_ASYMPTOTIC, NOT_APPLICABLE = map(
    REASON_NAMES.index,
    ("match", "mismatch", "unstable", "non_finite", "pre_asymptotic", "not_applicable"),
)


def stable(experiment: Experiment, record: Record, check: StableCheck, index: int) -> Outcome:
    """Compare whether schemes are stable with what a check expects."""
    reason, status = record["check_reason"][index], record["check_status"][index]
    measured, expected, p = (record[f"check_{n}"][index] for n in ("value", "low", "high"))
    level = int(np.max(record["check_first"][index]))
    as_expected = reason == (MATCH if check.stable else UNSTABLE)
    # a scheme without a limit of its own grows at every step
    limits = record["stability_limit"] if "stability_limit" in record else np.zeros(reason.shape)
    never = np.broadcast_to(np.asarray(limits) == 0.0, reason.shape)

    model = experiment.model.definition

    def failed_at(scheme: int, case: int) -> float:
        place = (scheme, case, _place(record, level))
        return float(record["failure_time"][place]) if record["status"][place] else np.nan

    def tell(scheme: int, case: int) -> str:
        name = experiment.schemes[scheme].name
        unstable = reason[scheme, case] != MATCH
        word = "unstable" if unstable else "stable"
        told = f"Scheme {name} is {word} at level {level}"
        if np.isfinite(p[scheme, case]):
            told += f", w dt = {p[scheme, case]:.4g}"
        factors = float(expected[scheme, case]), float(measured[scheme, case])
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
        size = np.abs(np.log(measured))
    return _outcome(
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
        advise=lambda scheme, case: on_stability(
            word_of(scheme, case),
            level,
            float(p[scheme, case]),
            limit_of(scheme, case),
            failed_at(scheme, case),
        ),
        value=measured,
    )


def conserves(experiment: Experiment, record: Record, check: ConservesCheck, index: int) -> Outcome:
    """Compare how the energy error grows with what a check expects."""
    kind = record["check_first"][index]
    largest, rate = record["check_value"][index], record["check_low"][index]
    broken = record["status"][..., _place(record, int(np.max(record["check_culprit"][index])))] != 0
    wanted = {DRIFTS.index(check.drift)}
    if check.drift == "bounded":
        # what is conserved is bounded too
        wanted.add(DRIFTS.index("none"))
    unclear = kind == DRIFTS.index("unclear")
    masks = [
        (broken, NON_FINITE),
        (np.isnan(largest) & unclear, NOT_APPLICABLE),
        # an error above round-off is not none, however short the run
        (unclear & (check.drift != "none"), PRE_ASYMPTOTIC),
        (np.isin(kind, list(wanted)), MATCH),
    ]
    reason = np.select([mask for mask, _ in masks], [code for _, code in masks], MISMATCH)

    def tell(scheme: int, case: int) -> str:
        if reason[scheme, case] == NON_FINITE:
            return f"{check.conserves} means nothing here: the calculation met a number that is not finite."
        if reason[scheme, case] == NOT_APPLICABLE:
            return f"{check.conserves} does not exist here, or was not stored."
        size, per = float(largest[scheme, case]), float(rate[scheme, case])
        told = _DRIFT_WORDS[DRIFTS[int(kind[scheme, case])]]
        if told == _DRIFT_WORDS["exponential"] and per < 0:
            told = "is that of an energy that decays exponentially"
        speed = (
            "" if not per else f", {_RATES.get(DRIFTS[int(kind[scheme, case])], '')}".format(per)
        )
        most = f"it is at most {size:.4g} of the energy" if np.isfinite(size) else "the energy is 0"
        return (
            f"The error of {check.conserves} {told}{speed if np.isfinite(per) else ''}; {most}. "
            f"Expected is: {check.drift}."
        )

    def advise(scheme: int, case: int) -> str:
        found = DRIFTS[int(kind[scheme, case])]
        return on_drift(
            REASON_NAMES[int(reason[scheme, case])], found, check.conserves, check.drift
        )

    return _valued(experiment, record, check, reason, largest, check.drift, tell, largest, advise)


_DRIFT_WORDS = {
    "none": "is round-off",
    "bounded": "is bounded: its largest value no longer grows",
    "linear": "grows in proportion to the time",
    "quadratic": "grows in proportion to the square of the time",
    "exponential": "grows exponentially with time",
    "unclear": "is more than round-off, and grows in a way that this run does not show",
}
_RATES = {
    "linear": "by {:.4g} of the energy per period",
    "quadratic": "by {:.4g} of the energy per period squared",
    "exponential": "the energy by the factor exp({:.4g}) per period",
}


def equal(experiment: Experiment, record: Record, check: EqualCheck, index: int) -> Outcome:
    """Compare the largest distance between two solutions with what it may be."""
    distance, allowed = record["check_value"][index], record["check_low"][index]
    place = _place(record, int(np.max(record["check_culprit"][index])))
    names = record.words("scheme")
    involved = [names.index(name) for name in check.equal if name in names]
    broken = np.any(record["status"][involved, :, place] != 0, axis=0)
    masks = [
        (np.broadcast_to(broken, distance.shape), NON_FINITE),
        (np.isnan(distance) | np.isnan(allowed), NOT_APPLICABLE),
        (distance <= allowed, MATCH),
    ]
    reason = np.select([mask for mask, _ in masks], [code for _, code in masks], MISMATCH)
    # as a part of what is allowed, which differs from member to member
    with np.errstate(divide="ignore", invalid="ignore"):
        away = np.where(distance > 0, distance / allowed, distance)
    other = {"exact": "the exact solution", "discrete": "the exact solution of its own steps"}
    second = other.get(check.second, f"scheme {check.second}")

    def tell(scheme: int, case: int) -> str:
        if reason[scheme, case] == NON_FINITE:
            return f"{check.quantity} means nothing here: the calculation met a number that is not finite."
        if reason[scheme, case] == NOT_APPLICABLE and np.isfinite(distance[scheme, case]):
            return (
                f"{check.quantity} of scheme {check.first} and {second} are at most "
                f"{distance[scheme, case]:.4g} apart; what rounding may make of that is not known here."
            )
        if reason[scheme, case] == NOT_APPLICABLE:
            return f"{check.quantity} and {second} cannot be compared here, or were not stored."
        verb = "equals" if reason[scheme, case] == MATCH else "differs from"
        return (
            f"{check.quantity} of scheme {check.first} {verb} {second}: they are at most "
            f"{distance[scheme, case]:.4g} apart; {allowed[scheme, case]:.4g} is allowed."
        )

    def advise(scheme: int, case: int) -> str:
        word = REASON_NAMES[int(reason[scheme, case])]
        return on_distance(word, check, float(distance[scheme, case]))

    words = f"equal to {second}"
    return _valued(experiment, record, check, reason, distance, words, tell, away, advise)


def _valued(
    experiment: Experiment,
    record: Record,
    check: ConservesCheck | EqualCheck,
    reason: NDArray[Any],
    value: Floats,
    expected: str,
    tell: Callable[[int, int], str],
    away: Floats,
    advise: Callable[[int, int], str],
) -> Outcome:
    """Return the outcome of a check that expects a PASS, from its reasons."""
    statuses = {MATCH: PASS, NOT_APPLICABLE: INCONCLUSIVE, PRE_ASYMPTOTIC: INCONCLUSIVE}
    status = np.full(reason.shape, FAIL, dtype=np.int8)
    for code, which in statuses.items():
        status[reason == code] = which
    return _outcome(
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
    )


def _outcome(
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


def _place(record: Record, level: int) -> int:
    return [int(known) for known in record["level"]].index(level)
