"""A number that a check asks for, in words: what it is, and what to change in the YAML where it is another one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from vibsim.apriori.formal_orders import columns_of, options_of
from vibsim.checks.value.by_level import SETTLED
from vibsim.checks.value.criteria import COUNTED, SAMPLED, depends_on_level, lacks_levels
from vibsim.checks.value.units import unit_of
from vibsim.checks.words.costs import cost_in_words
from vibsim.checks.words.found import Found
from vibsim.checks.words.notation import PLAIN, Notation
from vibsim.comparison.best_values import has_limit
from vibsim.experiment.value_names import VALUES
from vibsim.schemes.base import is_on_the_mesh

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ValueCheck

HALF = 0.5
"""Counted numbers are equal, or apart by more."""
ROUND_OFF = 1e-13
"""A number that is no larger is rounding."""
BORDERS = {"equals": "equal to", "below": "below", "above": "above"}
"""Key that holds the number that a check asks for, and the words for it."""

_ADVICE = {
    "non_finite": "Start `levels:` at a finer level, or shorten `time: end`.",
    "not_applicable": (
        "Ask for a level, a step and a time that are stored (`at:`, `samples: all`), and choose `time: end` so that "
        "the number exists."
    ),
}
FINER = 2
"""So many finer levels are advised."""


def what(check: ValueCheck, notation: Notation = PLAIN) -> str:
    """Say which number is meant."""
    quantity = notation.quantity(check.quantity) if check.quantity else ""
    if check.value in SAMPLED:
        when = "at the end"
        if check.at.t is not None or check.at.step is not None:
            when = (
                f"at t = {check.at.t:g}" if check.at.t is not None else f"at step {check.at.step}"
            )
        return f"{quantity} {when}"
    value = notation.value(check.value)
    return f"{value} of {quantity}" if quantity else value


def border(check: ValueCheck) -> str:
    """Return the key that holds the number that the check asks for."""
    return next(key for key in BORDERS if getattr(check, key) is not None)


def rule(check: ValueCheck, notation: Notation = PLAIN) -> str:
    """Say what a number should be."""
    key = border(check)
    wanted = getattr(check, key)
    told = f"{BORDERS[key]} {notation.number(wanted)}"
    if key != "equals":
        return told
    if VALUES[check.value].measure == "count" and check.allowed < HALF:
        return f"equal to {notation.number(wanted, 15)}"
    return f"equal to {notation.digits(repr(wanted))} within {notation.number(check.allowed)}"


def tell(f: Found, check: ValueCheck) -> str:
    """Say what a number is, and whether it is what a check asks for."""
    told = f.notation.opening(what(check, f.notation))
    match f.reason:
        case "non_finite":
            return f"{told} means nothing here: the calculation met a number that is not finite."
        case "not_applicable":
            return f"{told} does not exist here, or was not stored."
        case "too_few_levels" if math.isnan(f.fact("value")):
            return f"{told} does not exist here, because it needs more levels than there are."
        case "pre_asymptotic" | "too_few_levels":
            return f"{told} is {measured(f, check)}: it may be {rule(check, f.notation)}, or not."
    verb = "is" if f.reason == "match" else "is not"
    return f"{told} is {measured(f, check)}; it {verb} {rule(check, f.notation)}."


def measured(f: Found, check: ValueCheck) -> str:
    """Write a number with its unit, and with the bound of its error where it has one."""
    found, bound = f.fact("value"), f.fact("error_bound")
    # of round-off two digits say all
    digits = 2 if f.reason == "match" and abs(found) <= ROUND_OFF else 10
    unit = unit_of(f.experiment, f.record, check)
    told = f"{f.notation.number(found, digits)}{f' {unit}' if unit else ''}"
    if check.value == "stability_limit" and found == 0.0:
        told += " (it grows at every step)"
    if not has_limit(check.value, check.at.level):
        return told
    if math.isnan(bound):
        return f"{told}, with an error that is not known: the levels do not approach each other"
    return f"{told}, with an error of at most {f.notation.number(bound, 2)}"


def advise(f: Found, check: ValueCheck) -> str:
    """Say what to change in the YAML; finer levels only where they change the number enough."""
    experiment = f.experiment
    if f.reason in _ADVICE:
        return _ADVICE[f.reason]
    if f.reason == "too_few_levels" and lacks_levels(experiment, check):
        return f"Add finer `levels:`, so that there are {VALUES[check.value].finer_levels + 1} of them."
    finest = experiment.levels[-1]
    finer = [finest + 1 + i for i in range(FINER)]
    cost = cost_in_words(experiment, finer)
    if f.reason != "mismatch":
        return (
            f"Add levels {finer[0]} and {finer[1]} to `levels:` ({cost}), so that the bound of the error shrinks, or "
            "ask for the number of one level (`at: {level: ...}`)."
        )
    change = f"hange `{border(check)}:`"
    if check.value in COUNTED or not depends_on_level(check.value):
        return f"C{change}."
    options = options_of(experiment, columns_of(f.record), f.scheme, f.case)
    if VALUES[check.value].needs_events and is_on_the_mesh(options):
        return f"Set `events: located` for scheme {f.scheme_name}, or c{change}."
    if (first := f.fact("level_as_asked")) > 0:
        return f"Ask for a finer level (`at: {_at(check, first)}`), where the number is as asked, or c{change}."
    if f.fact("levels_needed") == SETTLED:
        return f"C{change}, or `model:` or `initial:`. Finer levels will not help."
    ask = (
        ""
        if check.at.level in (None, finest, "best")
        else f" and ask for one (`at: {_at(check, finer[-1])}`)"
    )
    return f"Add finer `levels:` ({finer[0]} and {finer[1]} cost {cost}){ask}, or c{change}."


def _at(check: ValueCheck, level: int) -> str:
    """Write where a number is taken, at a finer level: a step there is the same time."""
    found = {"level": level}
    if check.at.step is not None and isinstance(check.at.level, int):
        found["step"] = check.at.step * 2 ** (level - check.at.level)
    told = {
        key: value
        for key in ("t", "scheme", "case")
        if (value := getattr(check.at, key)) is not None
    }
    return "{" + ", ".join(f"{key}: {value}" for key, value in {**found, **told}.items()) + "}"
