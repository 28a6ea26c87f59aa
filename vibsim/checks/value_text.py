"""The check ``value`` in words: its number, whether that meets the check, and what to change."""

from __future__ import annotations

import math
import re
from functools import partial
from typing import Any

import numpy as np

from vibsim.checks.fields import name_of
from vibsim.checks.notation import PLAIN, ROUND_OFF, Notation
from vibsim.checks.number_units import unit_of
from vibsim.checks.phase_amplitude_text import NO_PART, PART_ADVICE
from vibsim.checks.sentences import (
    FINER,
    MOST_FINER,
    NOT_FINITE,
    WRONG_LIMIT_ADVICE,
    Description,
    MemberFacts,
    add_levels,
    cost_in_words,
)
from vibsim.checks.value import (
    SETTLED,
    border,
    compare,
    distance_to_the_cut,
    is_proved,
    lacks_levels,
    on_one_branch,
    room,
)
from vibsim.convergence.differences import last_change
from vibsim.convergence.reasons import code
from vibsim.convergence.thresholds import STILL_TO_CHANGE
from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER, is_error_part
from vibsim.elementary import on_arrays
from vibsim.experiment.schema.checks import ValueCheck
from vibsim.observe.steady_state import LEAST_PERIODS
from vibsim.schemes.base import is_on_the_mesh

DIRECTION_ASKED = {1.0: "rising", -1.0: "falling", 0.0: "neither rising nor falling throughout"}
"""Expected directions in words, by their numbers."""
UNPROVED = (
    " The levels agree with it, but do not prove it: the error bound is wider than what is asked."
)
NEAR_THE_END = 0.1
"""Part of the mean time between events within which the last one may explain why another level has one less."""
FEWEST_DIGITS, MOST_DIGITS = 4, 10
"""Significant digits of a measured number."""


def what(check: ValueCheck, notation: Notation = PLAIN) -> str:
    """Name the number of a check."""
    quantity = notation.quantity(check.quantity) if check.quantity else ""
    if check.number.is_sample:
        if check.at.t is not None:
            return f"{quantity} at t = {check.at.t:g}"
        when = "at the end" if check.at.step is None else f"at step {check.at.step}"
        return f"{quantity} {when}"
    value = notation.value(check.value)
    if check.at.event is not None:
        return f"{value} of event {check.at.event}"
    if check.quantity and is_error_part(check.quantity):
        # avoid "error of phase error": "largest phase error of u"
        text, is_word = re.subn(r"\berror\b", quantity, value, count=1)
        if is_word:
            return text
    return f"{value} of {quantity}" if quantity else value


def what_of_all(check: ValueCheck, notation: Notation = PLAIN) -> str:
    """Name the number of a check behind the word of its reduction, such as `largest`, without the same word again."""
    take = str(check.take)
    extreme = (
        "largest " if take.endswith("largest") else "least " if take.endswith("smallest") else ""
    )
    return what(check, notation).removeprefix(extreme)


def rule(check: ValueCheck, notation: Notation = PLAIN, unit: str = "") -> str:
    """Say what the number should be, with its unit if that is given."""
    key, wanted = border(check)
    if check.take == "monotone":
        return DIRECTION_ASKED[wanted]
    if key != "equals":
        return f"{key} {notation.number(wanted)} {unit}".rstrip()
    # counts differ by at least 1
    is_counted = check.number.measure == "count" and check.allowed < 0.5
    within = "" if is_counted else f" within {notation.number(check.allowed)}"
    return f"equal to {notation.number(wanted, 15)}{within} {unit}".rstrip()


def describe(f: MemberFacts, check: ValueCheck) -> Description:
    """State a number, whether it meets the check, and what to change."""
    subject = f.notation.opening(what(check, f.notation))
    unit = unit_of(f.experiment, f.record, check)
    brief, expected = _measured(f, check), rule(check, f.notation, unit)
    match f.reason:
        case "match":
            sentence, advice = f"{subject} is {brief}; it is {expected}.", ""
            if not is_proved(check, f.fact("value"), f.fact("error_bound")):
                sentence += UNPROVED
        case "mismatch":
            sentence, advice = (
                f"{subject} is {brief}; it is not {expected}.",
                _on_mismatch(f, check),
            )
            if check.number.needs_force and not _is_unsteady(f, check):
                advice += " If the motion is not steady yet, a longer run helps (`time: periods`)."
        case "non_finite":
            sentence, advice = NOT_FINITE[0].format(subject), NOT_FINITE[1]
        case "not_applicable" if check.number.needs_events:
            sentence, advice = _without_event(subject, check)
        case "not_applicable" if check.quantity is not None and is_error_part(check.quantity):
            sentence, advice = f"{subject} {NO_PART}.", PART_ADVICE
        case "not_applicable":
            sentence = f"{subject} does not exist here, or was not stored."
            advice = (
                "Ask for a level, a step and a time that are stored (`at:`, `samples: all`), and choose `time: end` so "
                "that the number exists."
            )
        case "too_few_levels" if lacks_levels(f.experiment, check):
            sentence = (
                f"{subject} does not exist here, because it needs more levels than there are."
            )
            advice = f"Add finer `levels:` until there are {check.number.finer_levels + 1}."
        case _:
            through = _through_the_cut(f, check)
            sentence = f"{subject} is {brief}{through}; it may or may not be {expected}."
            advice = advice_on_bound(f, check) or (
                f"A{finer_levels(f)} to shrink the error bound, or ask for the number of one level "
                "(`at: {level: ...}`)."
            )
    number = f.fact("value")
    brief = _measured(f, check, _digits(number, room(check, number)))
    return Description(sentence, advice, brief)


def _without_event(subject: str, check: ValueCheck) -> tuple[str, str]:
    """Say why the time of an event does not exist, and what to change."""
    later = "make `time: end` later"
    if check.at.event is not None:
        why, advice = (
            "fewer events happen until the end",
            f"Ask for an earlier `event:`, or {later}.",
        )
    elif check.value == "rest_time":
        why, advice = "the body moves at the end", f"If it ever comes to rest, {later}."
    else:
        why, advice = "no event happens until the end", f"If one is to come, {later}."
    return (
        f"{subject} does not exist: {why}.",
        f"{advice} Otherwise leave the check out (`checks:`).",
    )


def _digits(number: float, room: float) -> int:
    """Return one more than the number of digits that distinguish a number from others at the distance `room`."""
    if not (math.isfinite(number) and number != 0.0 and room > 0.0):
        return MOST_DIGITS
    # the integer part is not rounded
    whole, finer = (math.log10(abs(number) / unit) for unit in (1.0, room))
    return min(max(FEWEST_DIGITS, 1 + math.floor(whole), 2 + math.ceil(finer)), MOST_DIGITS)


def _measured(f: MemberFacts, check: ValueCheck, digits: int = MOST_DIGITS) -> str:
    """Write a number with its unit, and with the bound of its error if it has one."""
    value, bound = f.fact("value"), f.fact("error_bound")
    # two digits are enough for round-off
    digits = 2 if f.reason == "match" and abs(value) <= ROUND_OFF else digits
    phrase = f"{f.notation.number(value, digits)} {unit_of(f.experiment, f.record, check)}".rstrip()
    if check.value == "stability_limit" and value == 0.0:
        phrase += " (it grows at every step)"
    if not (check.number.has_limit(check.at.level) or math.isinf(bound)):
        return phrase
    if not math.isfinite(bound):
        phrase += f", with an unknown error{_why_unknown(f, check)}"
    else:
        phrase += f", with an error of at most {f.notation.number(bound, 2)}"
    broken = np.flatnonzero(f.record["status"][f.scheme, f.case])
    if len(broken) and not check.number.survives_failure:
        phrase += (
            f", from the levels finer than {f.experiment.levels[broken[-1]]}, which broke down"
        )
    return phrase


def _through_the_cut(f: MemberFacts, check: ValueCheck) -> str:
    """Say that the bound of an angle extends through pi; empty otherwise."""
    number, bound = f.fact("value"), f.fact("error_bound")
    if not (math.isfinite(bound) and bound > distance_to_the_cut(check, number)):
        return ""
    ends = (f.notation.number(end, FEWEST_DIGITS) for end in (number - bound, number + bound))
    cut = "pi" if number > 0.0 else "-pi"
    return f", an angle between {' and '.join(ends)}, which goes through {cut}"


def _why_unknown(f: MemberFacts, check: ValueCheck) -> str:
    """Say why the error of a number has no bound, if a cause is certain."""
    if _is_on_the_mesh(f, check):
        return ", because events are left to the mesh"
    if np.isfinite(pulse := _pulse_time(f)):
        return f", because the force has a pulse near t = {f.notation.number(pulse, 4)} that no level sees"
    if _has_few_periods(f, check):
        return f", because the run has fewer than {LEAST_PERIODS} periods of the force"
    if check.value == "peak_frequency" and math.isinf(f.fact("error_bound")):
        return ", because the lines around the highest one are not those of a cosine"
    if _is_of_events_at_end(f, check):
        if differing := _differing_events(f):
            return f", because the levels differ in their number of events: {differing}"
        return ", because no level tells whether an event happens before the end of the run"
    if _is_beside_exact(f, check):
        return ", because the levels approach another solution than the exact one"
    numbers = _by_level_of(f, check)
    if len(numbers) >= LEVELS_OF_AN_ORDER and np.all(np.isfinite(numbers)):
        return ", because its changes do not shrink steadily from level to level"
    return ", because there is one level only" if len(f.experiment.levels) == 1 else ""


def _by_level_of(f: MemberFacts, check: ValueCheck) -> Floats:
    """Return a number at each level, angles on one branch; empty if it was not stored."""
    is_stored = name_of(f.id, "value_by_level") in f.record
    return on_one_branch(check, np.array(f.fact("value_by_level") if is_stored else []))


def _is_on_the_mesh(f: MemberFacts, check: ValueCheck) -> bool:
    """Say whether a number depends on events that are left to the mesh, also on one that it moves across the end."""
    depends = check.number.needs_events or _is_of_events_at_end(f, check)
    return depends and is_on_the_mesh(f.options)


def _is_of_events_at_end(f: MemberFacts, check: ValueCheck) -> bool:
    """Say whether a number depends on an event that cannot be told from one behind the end."""
    may_depend = check.number.is_sample or check.number.needs_events
    has_events = f.experiment.model.definition.events is not None
    return may_depend and has_events and math.isinf(f.fact("error_bound"))


def _differing_events(f: MemberFacts) -> str:
    """List the numbers of events of the finest levels if they differ, and no event near the end explains that."""
    if "last_event_time" not in f.record:
        return ""
    first = max(len(f.experiment.levels) - LEVELS_OF_AN_ORDER, 0)
    counts, last = (
        f.record[name][f.scheme, f.case, first:] for name in ("event_count", "last_event_time")
    )
    end = float(f.record["t"][-1])
    end *= float(f.record["end"][f.case]) if "end" in f.record else 1.0
    has_more = counts > np.min(counts)
    since_last = end - last[has_more]
    if not np.any(has_more) or np.any(since_last <= NEAR_THE_END * end / counts[has_more]):
        return ""
    *others, finest = (
        f"{count:.0f} on level {level}"
        for count, level in zip(counts, f.experiment.levels[first:], strict=True)
    )
    return f"{', '.join(others)} and {finest}"


def advice_on_bound(f: MemberFacts, check: ValueCheck) -> str:
    """Say what to change if no finer level can bound the error of a number; empty otherwise."""
    if _is_on_the_mesh(f, check):
        return f"Set `events: located` for scheme {f.scheme_name}."
    if np.isfinite(_pulse_time(f)):
        return "Use steps shorter than the pulse, or write a wider pulse of the same impulse."
    if _has_few_periods(f, check):
        return f"Give {LEAST_PERIODS} or more `periods:`."
    if _is_beside_exact(f, check):
        advice = WRONG_LIMIT_ADVICE.format(scheme=f.scheme_name)
        return f"The levels approach another solution than the exact one. {advice}"
    if _is_of_events_at_end(f, check):
        if _differing_events(f):
            return (
                f"A{finer_levels(f)}, until they have the same events. If the motion only just meets the condition of "
                "an event, change `model:` or `initial:`."
            )
        return "Let the run end a little earlier or later (`time: end`)."
    numbers = _by_level_of(f, check)
    bound = f.fact("error_bound")
    # without a bound, use the distance from the target
    away = bound if np.isfinite(bound) else room(check, f.fact("value"))
    if check.number.rests_on_run and STILL_TO_CHANGE * last_change(numbers) < away:
        key = "periods" if f.experiment.time.periods is not None else "end"
        return f"Make the run longer (`time: {key}`): finer levels do not shrink the error bound."
    return ""


def _is_beside_exact(f: MemberFacts, check: ValueCheck) -> bool:
    """Say whether the levels of the quantity, or of the position, approach another solution than the exact one."""
    name = f"{check.quantity or f.model.position}_reason"
    return name in f.record and bool(f.record[name][f.scheme, f.case] == code("wrong_limit"))


def _pulse_time(f: MemberFacts) -> float:
    """Return the time of a pulse of the force that no level sees; NaN if there is none."""
    return float(f.record["pulse_time"][f.case]) if "pulse_time" in f.record else math.nan


def _has_few_periods(f: MemberFacts, check: ValueCheck) -> bool:
    """Say whether a run is too short to distinguish a steady motion from the transient."""
    periods, row = f.experiment.time.periods, check.number
    is_steady = row.needs_force and row.rests_on_run
    return is_steady and periods is not None and periods < LEAST_PERIODS


def finer_levels(f: MemberFacts, count: int = FINER) -> str:
    """Ask for `count` finer levels, with their cost; the text starts with the second letter."""
    return add_levels(f.experiment.levels[-1], count, partial(cost_in_words, f.experiment))


def _levels_to_add(f: MemberFacts, check: ValueCheck) -> int:
    """Return how many finer levels a number needs to meet the check if its changes continue to fall as the last two.

    More than `MOST_FINER` stand for any larger number, `FINER` for an unknown one.
    """
    numbers = _by_level_of(f, check)
    if len(numbers) < LEVELS_OF_AN_ORDER:
        return FINER
    previous, last = np.diff(numbers[-3:])
    fall = last / previous if previous else 0.0
    if not 0.0 < fall < 1.0:
        return FINER
    steps = np.arange(1, MOST_FINER + 1)
    left = last * on_arrays.power(fall, steps + 1) / (1.0 - fall)
    limit = numbers[-1] + last * fall / (1.0 - fall)
    # for an expected value, the remaining change must be within the tolerance
    enough = (
        compare(check, limit - left)[0] if check.equals is None else np.abs(left) <= check.allowed
    )
    return int(steps[np.argmax(enough)]) if np.any(enough) else MOST_FINER + 1


def _on_mismatch(f: MemberFacts, check: ValueCheck) -> str:
    """Say what to change if a number misses the check; finer levels only if they may change it enough."""
    is_printed = f.id.startswith("published_")
    change = f"hange `{'printed' if is_printed else border(check)[0]}:`"
    if check.number.is_count_of_work or not check.number.depends_on_level:
        return f"C{change}."
    if _is_on_the_mesh(f, check):
        return f"Set `events: located` for scheme {f.scheme_name}, or c{change}."
    if _is_unsteady(f, check):
        return f"Give more `periods:`, if the motion is not steady yet, or c{change}."
    if (first := f.fact("level_as_asked")) > 0:
        return f"Ask for a finer level (`at: {_at(check, first)}`), where the number is as asked, or c{change}."
    if "tolerance" in f.options:
        return f"Give scheme {f.scheme_name} a smaller `tolerance:`, or c{change}. Finer levels will not help."
    if f.fact("levels_needed") == SETTLED:
        return f"C{change}, `model:` or `initial:`. Finer levels will not help."
    count = _levels_to_add(f, check)
    if count > MOST_FINER:
        more = f"It would take more than {MOST_FINER} finer levels."
        return f"Take a scheme of higher order (`schemes:`), or c{change}. {more}"
    finest = f.experiment.levels[-1] + count
    ask = f" and ask for one (`at: {_at(check, finest)}`)"
    if check.at.level in (None, "best"):
        ask = ""
    return f"A{finer_levels(f, count)}{ask}, or c{change}."


def _is_unsteady(f: MemberFacts, check: ValueCheck) -> bool:
    """Tell whether the number itself shows that the motion is not steady."""
    if check.value == "section_period":
        return bool(f.fact("value") == 0)
    return check.value == "steady_change"


def _at(check: ValueCheck, level: int) -> str:
    """Write `at:` of a check for a finer level, where the step is converted to the same time."""
    place: dict[str, Any] = {"level": level}
    if check.at.step is not None and isinstance(check.at.level, int):
        place["step"] = check.at.step * 2 ** (level - check.at.level)
    place |= {key: getattr(check.at, key) for key in ("t", "event", "scheme", "case")}
    pairs = (f"{key}: {value}" for key, value in place.items() if value is not None)
    return f"{{{', '.join(pairs)}}}"
