"""The check ``value``: compares a number with a bound or an expected value.

A number that misses the target may reach it on finer levels, or may have settled elsewhere, as a count of located
bounces that is the same on all levels. How much the finest levels still change it distinguishes the two.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from vibsim.apriori.formal_orders import columns_of, options_of
from vibsim.checks.fields import Field, Measured, name_of
from vibsim.checks.notation import PLAIN, ROUND_OFF, Notation
from vibsim.checks.outcome import Judged
from vibsim.checks.phase_amplitude_text import NO_PART, PART_ADVICE
from vibsim.checks.sentences import (
    FINER,
    MOST_FINER,
    NOT_FINITE,
    Description,
    MemberFacts,
    add_levels,
    cost_in_words,
)
from vibsim.comparison import best_values, value_numbers
from vibsim.comparison.quantity_comparison import Compared
from vibsim.convergence.differences import last_change
from vibsim.convergence.reasons import first_reason
from vibsim.convergence.thresholds import STILL_TO_CHANGE
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER, is_error_part
from vibsim.elementary import on_arrays
from vibsim.experiment import Experiment
from vibsim.experiment.schema.checks import ValueCheck
from vibsim.experiment.value_names import OF_THE_SAME_KIND, VALUES
from vibsim.observe.member_block import MemberBlock
from vibsim.observe.steady_state import LEAST_PERIODS
from vibsim.schemes.base import is_on_the_mesh
from vibsim.simulation.scaled import has_time_unit

FIELDS = {
    "value": Field("the number", unit_of="number"),
    "error_bound": Field(
        "bound of the error of the number where it is extrapolated", unit_of="number"
    ),
    "levels_needed": Field(
        "whether finer levels may make it as asked: 1 they may, 0 they do not, -1 unknown",
        np.int8,
        none=-1,
    ),
    "level_as_asked": Field("finer level at which it is as asked, -1 for none", np.int16, none=-1),
    "value_by_level": Field(
        "the number at every level; that of a step at the same time of every level",
        dims=("scheme", "case", "level"),
        of_figure=True,
        unit_of="number",
    ),
}
DIRECTION_ASKED = {1.0: "rising", -1.0: "falling", 0.0: "neither rising nor falling throughout"}
"""Expected directions in words, by their numbers."""
UNKNOWN, SETTLED, MOVING = -1, 0, 1
"""Whether finer levels may bring a number to its target: unknown, they change it too little, perhaps."""
UNPROVED = (
    " The levels agree with it, but do not prove it: the error bound is wider than what is asked."
)
FEWEST_DIGITS, MOST_DIGITS = 4, 10
"""Significant digits of a measured number."""


def compare(check: ValueCheck, number: Floats) -> tuple[Flags, Floats]:
    """Return which numbers, of any shape, meet the check, and by how much they miss it (negative if they meet it)."""
    if check.below is not None:
        return number < check.below, number - check.below
    if check.above is not None:
        return number > check.above, check.above - number
    wanted = math.nan if check.equals is None else check.equals
    away = np.abs(number - wanted)
    if check.number.is_angle:
        away = np.abs(away - 2.0 * np.pi * np.round(away / (2.0 * np.pi)))
    return away <= check.allowed, away - check.allowed


def measure(block: MemberBlock, compared: Compared, check: ValueCheck) -> Measured:
    """Return the number, the bound of its error, and whether finer levels may change the outcome."""
    at, name, levels, row = check.at, check.value, block.grid.levels, check.number
    place = value_numbers.Place(
        block, compared, check.quantity or "", at.level, at.t, at.step, at.event
    )
    best = best_values.value(name, place)
    value, bound, missed = (np.broadcast_to(x, block.shape) for x in best)
    fulfilled, _ = compare(check, value)
    numbers = np.full((*block.shape, len(levels)), np.nan)
    is_open = np.isnan(bound) & row.has_limit(at.level)
    if "level" in row.at and not (block.lean and np.all(fulfilled & ~is_open) and not check.take):
        numbers = _by_level(name, place)
    if check.take is not None and row.has_limit(at.level):
        # a reduced number needs a bound for each member
        bound = np.where(np.isnan(bound), STILL_TO_CHANGE * last_change(numbers) + missed, bound)
    own_levels = row.own_levels(levels) or tuple(levels)
    level = place.level if place.level in own_levels else own_levels[-1]
    unseen = np.where(is_open, missed, 0.0)
    needed, first = _prospects(
        check, numbers[..., : len(own_levels)], own_levels, int(level), fulfilled, is_open, unseen
    )
    needed = np.where(fulfilled & ~is_open, UNKNOWN, needed)
    return {
        "value": value,
        "error_bound": bound,
        "levels_needed": needed,
        "level_as_asked": first,
        "value_by_level": numbers,
    }


def _by_level(name: str, place: value_numbers.Place) -> Floats:
    """Return a number at each level, shape (scheme, case, level); NaN where it does not exist.

    A step of one level is taken at the same time on all others; for the extrapolated solution it is a common time.
    """
    if place.level == "best" and VALUES[name].is_sample:
        return np.stack(value_numbers.samples(place), axis=-1)
    time, data = place.t, place.data()
    if place.step is not None and data is not None:
        index = place.step // int(np.asarray(data.attrs["every"]))
        time = float(data["t"][index]) if index < len(data["t"]) else place.t
    rows = (replace(place, level=level, t=time, step=None) for level in place.levels)
    return np.stack([value_numbers.value(name, row) for row in rows], axis=-1)


def _prospects(
    check: ValueCheck,
    numbers: Floats,
    levels: Sequence[int],
    level: int,
    fulfilled: Flags,
    is_open: Flags,
    unseen: Floats,
) -> tuple[Any, Any]:
    """Return whether levels finer than `level` may change the outcome, and the first one that meets the check, or -1.

    The former is `SETTLED`, `MOVING` or `UNKNOWN`; for a `fulfilled` check it is `MOVING` if finer levels may miss it
    again, otherwise `UNKNOWN`. `numbers` has the shape (scheme, case, level). If the bound `is_open` and the changes do
    not shrink, each of `MOST_FINER` finer levels may change a number by as much again. `unseen` errors are added.
    """
    holds, distance = compare(check, numbers)
    finer = holds & (np.array(levels) > level)
    first = np.where(np.any(finer, axis=-1), np.array(levels)[np.argmax(finer, axis=-1)], -1)
    code = np.full(fulfilled.shape, UNKNOWN)
    if len(levels) > 1:
        with np.errstate(all="ignore"):
            last = last_change(numbers)
            change = np.abs(np.diff(numbers[..., -3:], axis=-1))
            shrinks = change[..., -1] <= STILL_TO_CHANGE / (1.0 + STILL_TO_CHANGE) * change[..., 0]
            reach = np.where(is_open & ~shrinks, MOST_FINER, STILL_TO_CHANGE) * last + unseen
            code[distance[..., -1] <= reach] = MOVING
            code[(distance[..., -1] > reach) | (reach == 0.0)] = SETTLED
            code[fulfilled] = np.where(reach > -distance[..., -1], MOVING, UNKNOWN)[fulfilled]
    return code, np.where(fulfilled, -1, first)


def judge(experiment: Experiment, record: Record, check: ValueCheck, facts: Measured) -> Judged:
    """Compare a measured number with the check.

    Nothing is decided if a limit misses the check by less than its bound, or if the bound of an angle extends through
    pi. Nor is it if a limit meets the check, but only by chance: the time of an event that may be further away, a
    number with an unknown bound that finer levels may still move, or one whose error no level can bound.
    """
    name, number, bound = check.value, facts["value"], facts["error_bound"]
    row, is_limit = check.number, check.number.has_limit(check.at.level)
    holds, away = compare(check, number)
    # a limit rests on the levels finer than the last one that broke down
    survives = np.isfinite(number) & (
        row.survives_failure | is_limit & (record["status"][..., -1] == 0)
    )
    # a stability limit may be infinite; an infinite exact period means that there is none, as on the separatrix
    does_not_exist = np.isnan(number) | (np.isinf(number) & (name == "exact_period"))
    infinite = np.isinf(number) & (name != "stability_limit") & ~does_not_exist
    # a number that depends on an event at the end has no bound at any level
    is_bounded = is_limit | np.isinf(bound)
    may_be_right = ~(np.minimum(away, _to_the_cut(check, number)) > bound) & is_bounded
    # an uncertain time agrees by chance, perhaps that of another event; an inequality must hold within the whole bound
    is_strict = row.needs_events or check.equals is None
    is_unknown = np.isnan(bound) & (row.needs_events | (facts["levels_needed"] == MOVING))
    is_wide = np.isinf(bound) | ((bound > _room(check, number)) & is_strict)
    holds &= ~((is_unknown | is_wide) & is_bounded)
    cases = [
        ((_failed(record, check) & ~survives) | infinite, "non_finite"),
        (
            does_not_exist,
            "too_few_levels" if _lacks_levels(experiment, check) else "not_applicable",
        ),
        (holds, "match"),
        (
            may_be_right,
            "too_few_levels" if len(record["level"]) < LEVELS_OF_AN_ORDER else "pre_asymptotic",
        ),
    ]
    reason = first_reason(cases, "mismatch")
    return Judged(reason, away)


def _lacks_levels(experiment: Experiment, check: ValueCheck) -> bool:
    """Say whether a number needs more levels than the experiment has."""
    return check.number.finer_levels >= len(experiment.levels)


def _failed(record: Record, check: ValueCheck) -> Flags:
    """Say which members broke down at a level that the value depends on, shape (scheme, case)."""
    broken, level = record["status"] != 0, check.at.level
    if check.number.sees_several_levels or level == "best":
        return np.asarray(np.any(broken, axis=-1))
    levels = np.asarray(record["level"]).tolist()
    return np.asarray(broken[..., levels.index(level) if level in levels else -1])


UNITS = "units_of_quantities"
"""Attribute with the units of quantities by name, as JSON, of a Record that holds verdicts but no quantities."""


def unit_of(experiment: Experiment, record: Record, check: ValueCheck) -> str:
    """Return the unit of the number of a check, such as ``rad s-1``; empty if it has none.

    A scaled run and a model without units have none, as the convergence Record shows.
    """
    time = "s" if has_time_unit(record) else ""
    position = experiment.model.definition.position
    return unit_of_number(check, _known_units(record), position, time)


def unit_of_number(check: ValueCheck, known: Mapping[str, str], position: str, time: str) -> str:
    """Return the unit of the number of a check from the units of quantities and time; empty if it has none."""
    measure = check.number.measure
    if check.take not in OF_THE_SAME_KIND:
        # swept values have other units, and directions have none
        return ""
    of_time = {"time": "s", "frequency": "rad s-1", "l1": "s", "l2": "sqrt(s)"}
    unit = of_time.get(measure, "") if time else ""
    if measure not in ("quantity", "l1", "l2", "position"):
        return unit
    owner = position if measure == "position" else check.quantity
    return f"{known.get(owner or '', '')} {unit}".strip()


def unit_of_quantity(record: Record, quantity: str) -> str:
    """Return the unit of a quantity; empty if it has none."""
    return _known_units(record).get(quantity, "")


def unit_of_norm(record: Record, quantity: str) -> str:
    """Return the unit of the L2 norm over time of a quantity; empty if it has none."""
    return f"{_known_units(record).get(quantity, '')} {'sqrt(s)' if has_time_unit(record) else ''}".strip()


def _known_units(record: Record) -> dict[str, str]:
    stored = record.attrs.get(UNITS)
    units: dict[str, str] = units_in(record) if stored is None else json.loads(str(stored))
    return units


def units_in(record: Record) -> dict[str, str]:
    """Return the units of all quantities of a convergence Record, to be stored as `UNITS`."""
    units: dict[str, str] = {}
    # at least one of these is stored for each quantity that a check may use
    for suffix in ("_end", "_difference_norm", "_finest"):
        for name, variable in record.variables.items():
            if name.endswith(suffix):
                unit = str(variable.attrs.get("units", ""))
                units.setdefault(name.removesuffix(suffix), "" if unit == "1" else unit)
    return units


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


def border(check: ValueCheck) -> tuple[str, float]:
    """Return the key of the target of a check (`equals`, `below` or `above`), and the target."""
    borders = {key: getattr(check, key) for key in ("equals", "below", "above")}
    return next((key, number) for key, number in borders.items() if number is not None)


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
    brief, expected = _measured(f, check), rule(check, f.notation)
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
        case "not_applicable" if check.at.event is not None:
            sentence = f"{subject} does not exist: fewer events happen until the end."
            advice = "Ask for an earlier `event:`, or make `time: end` later."
        case "not_applicable" if check.quantity is not None and is_error_part(check.quantity):
            sentence, advice = f"{subject} {NO_PART}.", PART_ADVICE
        case "not_applicable":
            sentence = f"{subject} does not exist here, or was not stored."
            advice = (
                "Ask for a level, a step and a time that are stored (`at:`, `samples: all`), and choose `time: end` so "
                "that the number exists."
            )
        case "too_few_levels" if _lacks_levels(f.experiment, check):
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
    brief = _measured(f, check, _digits(number, _room(check, number)))
    return Description(sentence, advice, brief)


def is_proved(check: ValueCheck, value: float, bound: float) -> bool:
    """Say whether all numbers within the bound meet the check, for a number that meets it."""
    return not (check.number.has_limit(check.at.level) and bool(bound > _room(check, value)))


def _room(check: ValueCheck, value: Any) -> Any:
    """Return the allowed deviation from an expected value, or the distance from a bound."""
    key, wanted = border(check)
    distance = np.abs(value - wanted)
    return check.allowed if key == "equals" else np.minimum(distance, _to_the_cut(check, value))


def _to_the_cut(check: ValueCheck, value: Any) -> Any:
    """Return the distance of angles from -pi and pi, where they wrap around; infinite if that does not matter."""
    key, wanted = border(check)
    is_cut = check.number.is_angle and key != "equals" and abs(wanted) < np.pi
    return np.pi - np.abs(value) if is_cut else math.inf


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
    if not (math.isfinite(bound) and bound > _to_the_cut(check, number)):
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
        return ", because no level tells whether an event happens before the end of the run"
    numbers = _by_level_of(f)
    if len(numbers) >= LEVELS_OF_AN_ORDER and np.all(np.isfinite(numbers)):
        return ", because its changes do not shrink steadily from level to level"
    return ", because there is one level only" if len(f.experiment.levels) == 1 else ""


def _by_level_of(f: MemberFacts) -> list[float]:
    """Return a number at each level; empty if it was not stored."""
    is_stored = name_of(f.id, "value_by_level") in f.record
    return f.fact("value_by_level") if is_stored else []


def _is_on_the_mesh(f: MemberFacts, check: ValueCheck) -> bool:
    """Say whether a number depends on events that are left to the mesh."""
    options = options_of(f.experiment, columns_of(f.record), f.scheme, f.case)
    return check.number.needs_events and is_on_the_mesh(options)


def _is_of_events_at_end(f: MemberFacts, check: ValueCheck) -> bool:
    """Say whether a number depends on an event that cannot be told from one behind the end."""
    may_depend = check.number.is_sample or check.number.needs_events
    has_events = f.experiment.model.definition.events is not None
    return may_depend and has_events and math.isinf(f.fact("error_bound"))


def advice_on_bound(f: MemberFacts, check: ValueCheck) -> str:
    """Say what to change if no finer level can bound the error of a number; empty otherwise."""
    if _is_on_the_mesh(f, check):
        return f"Set `events: located` for scheme {f.scheme_name}."
    if np.isfinite(_pulse_time(f)):
        return "Use steps shorter than the pulse, or write a wider pulse of the same impulse."
    if _has_few_periods(f, check):
        return f"Give {LEAST_PERIODS} or more `periods:`."
    if _is_of_events_at_end(f, check):
        return "Let the run end a little earlier or later (`time: end`)."
    numbers = np.array(_by_level_of(f))
    bound = f.fact("error_bound")
    # without a bound, use the distance from the target
    away = bound if np.isfinite(bound) else _room(check, f.fact("value"))
    if check.number.rests_on_run and STILL_TO_CHANGE * last_change(numbers) < away:
        key = "periods" if f.experiment.time.periods is not None else "end"
        return f"Make the run longer (`time: {key}`): finer levels do not shrink the error bound."
    return ""


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
    """Return how many finer levels a number needs to meet the check if its changes continue to fall as the last two."""
    numbers = _by_level_of(f)
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
    return int(steps[np.argmax(enough)]) if np.any(enough) else FINER


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
    if f.fact("levels_needed") == SETTLED:
        return f"C{change}, `model:` or `initial:`. Finer levels will not help."
    count = _levels_to_add(f, check)
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
