"""The checks ``stable``, ``conserves`` and ``equal`` in words: what was found, and what to change in the YAML."""

from __future__ import annotations

import math
from decimal import Decimal
from typing import TYPE_CHECKING, get_args

from vibsim.apriori.formal_orders import columns_of, stability_limits
from vibsim.checks.words.found import Found
from vibsim.checks.words.notation import growth_in_words, vanishing_in_words
from vibsim.experiment.schema.checks import SOLUTIONS, Drift

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ConservesCheck, EqualCheck

KNOWN_DRIFTS = get_args(Drift)
"""What `drift:` may be."""
BROKEN = "Start `levels:` at a finer level, or shorten `time: end`."
"""Advice where the calculation met a number that is not finite."""
MEANINGLESS = "{} means nothing here: the calculation met a number that is not finite."
NOTHING_MOVES = "Nothing moves here: {} stays what it was at the start, whatever the scheme does"
MOVE = "Choose `initial:` values, or a force, with which something moves."
"""Advice where nothing moves."""


def tell_stable(f: Found) -> str:
    """Say whether a scheme is stable at the level of a check, and why."""
    level, number = f.fact("level"), f.notation.number
    if f.reason == "non_finite":
        when = "" if math.isnan(f.failed_at) else f", at t = {number(f.failed_at, 4)}"
        return (
            f"Scheme {f.scheme_name} met a number that is not finite or too large at level {level}{when}, and the "
            "finest levels did so at the same time. So the motion itself escapes, or a formula has no finite value, "
            "which says nothing about stability."
        )
    word = "stable" if f.reason == "match" else "unstable"
    told = f"Scheme {f.scheme_name} is {word} at level {level}"
    if math.isfinite(p := f.fact("omega_dt")):
        told += f", w dt = {number(p, 4)}"
    factors = f.fact("predicted_growth"), f.fact("growth")
    model = f.experiment.model.definition
    of = model.conservative, model.linear, len(model.positions)
    told += growth_in_words(*factors, of, f.notation)
    if f.reason == "match" and _always_grows(f):
        told += vanishing_in_words(*factors, f.notation)
    if not math.isnan(f.failed_at):
        told += f"; it met a number that is not finite or too large at t = {number(f.failed_at, 4)}"
    if f.reason == "mismatch":
        told += "; the two do not agree, so this is not the scheme that the theory describes"
    return f"{told}."


def _always_grows(f: Found) -> bool:
    """Tell whether a scheme has no limit of stability of its own, so that it grows at every step."""
    if "stability_limit" not in f.record:
        return True
    return bool(f.record["stability_limit"][f.scheme, f.case] == 0.0)


def _limit(f: Found) -> float:
    """Return the largest stable w dt: infinite for none, 0 where a scheme grows at every step."""
    known = stability_limits(f.experiment, columns_of(f.record))[f.scheme]
    return float(known[f.case if len(known) > 1 else 0])


def advise_stable(f: Found) -> str:
    """Say what to change where a scheme is not as stable as a check expects."""
    level, p, failed = f.fact("level"), f.fact("omega_dt"), f.failed_at
    time = f.notation.number(failed, 4)
    if f.reason == "match":
        return "Set `stable: true`, or take coarser `levels:` where the scheme has a limit (w dt beyond it)."
    if f.reason == "mismatch":
        return (
            "Take another `kind:` in `schemes:`, or look for an error in this one: it does not grow as its own theory "
            "says."
        )
    if f.reason == "non_finite":
        before = "" if math.isnan(failed) else f" before t = {time}"
        return f"End the time interval (`time: end`){before}, or check the formulas of `model:`."
    limit = _limit(f)
    if math.isfinite(limit) and math.isfinite(p) and p > limit > 0.0:
        first = level + math.ceil(math.log2(p / limit) - 1e-9)
        return (
            f"Take finer `levels:`, from {first} on (w dt within the limit {f.notation.number(limit)}), or correct "
            "`stable:`."
        )
    if not math.isnan(failed):
        return (
            f"End the time interval (`time: end`) before t = {time} if the motion itself escapes there, take "
            "finer `levels:` if it does not, or correct `stable:`."
        )
    return "Take finer `levels:`, shorten `time: end`, or correct `stable:`."


_DRIFTS = {
    "none": "is round-off",
    "bounded": "is bounded: its largest value no longer grows",
    "linear": "grows in proportion to the time",
    "quadratic": "grows in proportion to the square of the time",
    "exponential": "grows exponentially with time",
    "unclear": "is more than round-off, but this run does not show how it grows",
}
_RATES = {
    "linear": "by {} of the energy per period",
    "quadratic": "by {} of the energy per period squared",
    "exponential": "the energy by the factor exp({}) per period",
}


def tell_conserves(f: Found, check: ConservesCheck) -> str:
    """Say how the error of the energy grows with time."""
    size, rate, number = f.fact("energy_error"), f.fact("drift_rate"), f.notation.number
    if f.reason == "non_finite":
        return MEANINGLESS.format(check.conserves)
    if f.reason == "not_applicable" and f.word("motion") == "rests":
        return f"{NOTHING_MOVES.format('the energy')}, and there is nothing to conserve."
    if f.reason == "not_applicable":
        return f"{check.conserves} does not exist here, or was not stored."
    if f.reason == "round_off":
        return (
            f"The error of {check.conserves} is at most {number(size, 4)} of the energy, which may be "
            f"round-off, so its growth cannot be seen. The check expects `drift: {check.drift}`."
        )
    drift = f.word("drift")
    told = _DRIFTS[drift]
    if drift == "exponential" and rate < 0:
        told = "is that of an energy that decays exponentially"
    if rate and math.isfinite(rate):
        told += f", {_RATES.get(drift, '').format(number(rate, 4))}"
    most = (
        f"it is at most {number(size, 4)} of the energy"
        if math.isfinite(size)
        else "the energy is 0"
    )
    return (
        f"The error of {check.conserves} {told}; {most}. The check expects `drift: {check.drift}`."
    )


def advise_conserves(f: Found, check: ConservesCheck) -> str:
    """Say what to change where the energy does not drift as a check expects."""
    drift, expected = f.word("drift"), KNOWN_DRIFTS.index(check.drift)
    match f.reason:
        case "non_finite":
            return BROKEN
        case "not_applicable" if f.word("motion") == "rests":
            return MOVE
        case "not_applicable":
            return f"Name `schemes:` that have {check.conserves}, or ask for `conserves: energy`."
        case "pre_asymptotic":
            return (
                "Lengthen the run (`time: end`), or store more of it (`samples: all`). It is too short to show a "
                "drift."
            )
        case "round_off":
            return (
                "Take a coarser `level:`, whose error is larger than round-off, lengthen the run (`time: end`), or set "
                "`drift: none`, which is what this level shows."
            )
    is_known = drift in KNOWN_DRIFTS
    if is_known and KNOWN_DRIFTS.index(drift) < expected:
        return f"Set `drift: {drift}`, which was measured. The energy is conserved better than the check asks for."
    other = (
        f"set `drift: {drift}`, which was measured"
        if is_known
        else "leave the check out (`checks:`)"
    )
    return (
        f"Take a scheme that conserves the energy better (`schemes:`), or {other}. Finer `levels:` make the error "
        "smaller, but do not change how it grows."
    )


OTHERS = {"exact": "the exact solution", "discrete": "the exact solution of its own steps"}


def tell_equal(f: Found, check: EqualCheck) -> str:
    """Say how far two solutions are from each other."""
    what = f.notation.opening(f.notation.quantity(check.quantity))
    number, distance = f.notation.number, f.fact("distance")
    second = OTHERS.get(check.second, f"scheme {check.second}")
    match f.reason:
        case "non_finite":
            return MEANINGLESS.format(what)
        case "not_applicable" if _is_still(f):
            return f"{NOTHING_MOVES.format(what)}, and {second} shows no difference."
        case "not_applicable" if math.isfinite(distance):
            return (
                f"{what} of scheme {check.first} and {second} are at most {number(distance, 4)} apart, and the "
                "round-off to compare that with is not known here."
            )
        case "not_applicable":
            return f"{what} and {second} cannot be compared here, or were not stored."
    verb = "equals" if f.reason == "match" else "differs from"
    return f"{what} of scheme {check.first} {verb} {second}. They are {distance_in_words(f)}."


def distance_in_words(f: Found) -> str:
    """Say how far two solutions are from each other, and how far they may be."""
    number = f.notation.number
    return (
        f"at most {number(f.fact('distance'), 4)} apart; {number(f.fact('allowed'), 4)} is allowed"
    )


def _is_still(f: Found) -> bool:
    """Tell whether nothing moves, where nothing is applicable for that."""
    return bool(f.fact("distance") <= f.fact("allowed"))


def advise_equal(f: Found, check: EqualCheck) -> str:
    """Say what to change where two solutions are not as near to each other as a check expects."""
    distance = f.fact("distance")
    loose = f"give `atol:` above {_above(distance)} if so much is right"
    match f.reason:
        case "non_finite":
            return BROKEN
        case "not_applicable" if _is_still(f):
            return MOVE
        case "not_applicable" if math.isfinite(distance):
            return f"Give `atol:`, above {_above(distance)} if so much is right."
        case "not_applicable":
            return (
                "Name in `equal:` a scheme or a solution that exists here, or another `quantity:`."
            )
    if check.second in SOLUTIONS:
        return f"Correct what `equal:` names, take a finer `level:`, or {loose}."
    return f"Correct what `equal:` names or the options of one of the `schemes:`, or {loose}."


def _above(distance: float) -> str:
    """Write a number with two digits that is no smaller than a distance: one that is asked for must suffice."""
    if not 0.0 < distance < math.inf:
        return f"{distance:.2g}"
    near = Decimal(f"{distance:.1e}")
    unit = Decimal(1).scaleb(near.adjusted() - 1)
    return f"{float(near if near >= Decimal(distance) else near + unit):.2g}"
