"""The check ``value``: compares a number with a bound or an expected value.

A number that misses the target may reach it on finer levels, or may have settled elsewhere, as a count of located
bounces that is the same on all levels. How much the finest levels still change it distinguishes the two.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vibsim.checks.fields import Field, Measured
from vibsim.checks.outcome import Judged
from vibsim.checks.sentences import MOST_FINER
from vibsim.comparison import best_values, value_numbers
from vibsim.comparison.quantity_comparison import Compared
from vibsim.convergence.differences import last_change
from vibsim.convergence.reasons import first_reason
from vibsim.convergence.thresholds import STILL_TO_CHANGE
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER
from vibsim.experiment import Experiment
from vibsim.experiment.schema.checks import ValueCheck
from vibsim.experiment.value_names import VALUES
from vibsim.observe.member_block import MemberBlock
from vibsim.observe.steady_state import continued, wrapped

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
UNKNOWN, SETTLED, MOVING = -1, 0, 1
"""Whether finer levels may bring a number to its target: unknown, they change it too little, perhaps."""


def compare(check: ValueCheck, number: Floats) -> tuple[Flags, Floats]:
    """Return which numbers, of any shape, meet the check, and by how much they miss it (negative if they meet it).

    Angles are those in (-pi, pi], and their distance is that on the circle.
    """
    if check.number.is_angle:
        number = wrapped(number)
    if check.below is not None:
        return number < check.below, number - check.below
    if check.above is not None:
        return number > check.above, check.above - number
    wanted = math.nan if check.equals is None else check.equals
    away = number - wanted
    away = np.abs(wrapped(away) if check.number.is_angle else away)
    return away <= check.allowed, away - check.allowed


def measure(block: MemberBlock, compared: Compared, check: ValueCheck) -> Measured:
    """Return the number, the bound of its error, and whether finer levels may change the outcome."""
    at, name, levels, row = check.at, check.value, block.grid.levels, check.number
    place = value_numbers.Place(
        block, compared, check.quantity or "", at.level, at.t, at.step, at.event
    )
    best = best_values.value(name, place)
    value, bound, missed = (np.broadcast_to(x, block.shape) for x in best)
    if name == "event_count" and at.level is None:
        bound = np.where(_counts_differ(block, check), np.inf, bound)
    fulfilled, _ = compare(check, value)
    numbers = np.full((*block.shape, len(levels)), np.nan)
    is_open = np.isnan(bound) & row.has_limit(at.level)
    if "level" in row.at and not (block.lean and np.all(fulfilled & ~is_open) and not check.take):
        numbers = _by_level(name, place)
    if check.take is not None and row.has_limit(at.level):
        # a reduced number needs a bound for each member
        change = last_change(on_one_branch(check, numbers))
        bound = np.where(np.isnan(bound), STILL_TO_CHANGE * change + missed, bound)
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


def _counts_differ(block: MemberBlock, check: ValueCheck) -> Flags:
    """Tell whether the finest levels answer a check differently by their numbers of events, shape (scheme, case).

    Levels that broke down do not count.
    """
    rows = [block.records[level] for level in block.grid.levels[-LEVELS_OF_AN_ORDER:]]
    counts = [np.asarray(row["event_count"], dtype=np.float64) for row in rows]
    answers = counts if check.take is not None else [compare(check, count)[0] for count in counts]
    differ = [
        (answer != answers[-1]) & (row["status"] == 0)
        for row, answer in zip(rows, answers, strict=True)
    ]
    return np.asarray(np.any(differ, axis=0))


def _by_level(name: str, place: value_numbers.Place) -> Floats:
    """Return a number at each level, shape (scheme, case, level); NaN where it does not exist.

    A step of one level is taken at the same time on all others; for the extrapolated solution it is a common time.
    """
    if place.level == "best" and VALUES[name].is_sample:
        return np.stack(value_numbers.samples(place), axis=-1)
    time, data = place.t, place.data()
    if place.step is not None and data is not None:
        index = place.step // data.whole("every")
        time = float(data["t"][index]) if index < len(data["t"]) else place.t
    rows = (replace(place, level=level, t=time, step=None) for level in place.levels)
    return np.stack([value_numbers.value(name, row) for row in rows], axis=-1)


def on_one_branch(check: ValueCheck, numbers: Floats) -> Floats:
    """Return a number by level; angles go on through pi as the finest level does."""
    return continued(numbers, numbers[..., -1:]) if check.number.is_angle else numbers


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
            branch = on_one_branch(check, numbers)
            last = last_change(branch)
            change = np.abs(np.diff(branch[..., -3:], axis=-1))
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
    may_be_right = ~(np.minimum(away, distance_to_the_cut(check, number)) > bound) & is_bounded
    # an uncertain time agrees by chance, perhaps that of another event; an inequality must hold within the whole bound
    is_strict = row.needs_events or check.equals is None
    is_unknown = np.isnan(bound) & (row.needs_events | (facts["levels_needed"] == MOVING))
    is_wide = np.isinf(bound) | ((bound > room(check, number)) & is_strict)
    holds &= ~((is_unknown | is_wide) & is_bounded)
    cases = [
        ((_failed(record, check) & ~survives) | infinite, "non_finite"),
        (
            does_not_exist,
            "too_few_levels" if lacks_levels(experiment, check) else "not_applicable",
        ),
        (holds, "match"),
        (
            may_be_right,
            "too_few_levels" if len(record["level"]) < LEVELS_OF_AN_ORDER else "pre_asymptotic",
        ),
    ]
    reason = first_reason(cases, "mismatch")
    return Judged(reason, away)


def lacks_levels(experiment: Experiment, check: ValueCheck) -> bool:
    """Say whether a number needs more levels than the experiment has."""
    return check.number.finer_levels >= len(experiment.levels)


def _failed(record: Record, check: ValueCheck) -> Flags:
    """Say which members broke down at a level that the value depends on, shape (scheme, case)."""
    broken, level = record["status"] != 0, check.at.level
    if check.number.sees_several_levels or level == "best":
        return np.asarray(np.any(broken, axis=-1))
    levels = np.asarray(record["level"]).tolist()
    return np.asarray(broken[..., levels.index(level) if level in levels else -1])


def border(check: ValueCheck) -> tuple[str, float]:
    """Return the key of the target of a check (`equals`, `below` or `above`), and the target."""
    borders = {key: getattr(check, key) for key in ("equals", "below", "above")}
    return next((key, number) for key, number in borders.items() if number is not None)


def is_proved(check: ValueCheck, value: float, bound: float) -> bool:
    """Say whether all numbers within the bound meet the check, for a number that meets it."""
    return not (check.number.has_limit(check.at.level) and bool(bound > room(check, value)))


def room(check: ValueCheck, value: Any) -> Any:
    """Return the allowed deviation from an expected value, or the distance from a bound."""
    key, wanted = border(check)
    distance = np.abs(value - wanted)
    return (
        check.allowed
        if key == "equals"
        else np.minimum(distance, distance_to_the_cut(check, value))
    )


def distance_to_the_cut(check: ValueCheck, value: Any) -> Any:
    """Return the distance of angles from -pi and pi, where they wrap around; infinite if that does not matter."""
    key, _ = border(check)
    is_cut = check.number.is_angle and key != "equals"
    return np.pi - np.abs(value) if is_cut else math.inf
