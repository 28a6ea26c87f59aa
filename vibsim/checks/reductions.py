"""Reductions of ``value`` checks over all members: the largest number, the mean, the place of the largest, and others.

Each member has a number x and a bound e of its error. For the number of one level e is 0; for a limit it is the error
bound of the levels. If that is unknown, all finer levels together are assumed to change x by at most three times its
last change (`STILL_TO_CHANGE`); without any change e is infinite. The true number lies between
x - e and x + e. So the reduced number lies between `low` and `high`, the least and the largest value that numbers in
these intervals can give. The check matches if all values between them match, and fails if none does. Otherwise the
levels do not decide, and the members that could change the outcome are named.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from vibsim.checks import number_units, value, value_text
from vibsim.checks.fields import Field, Measured, field_values
from vibsim.checks.outcome import Judged, about_members
from vibsim.checks.sentences import Description, MemberFacts
from vibsim.convergence.reasons import code, is_one_of
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER
from vibsim.experiment import Experiment
from vibsim.experiment.schema.checks import ValueCheck
from vibsim.experiment.sweep_columns import recorded_columns
from vibsim.experiment.value_names import CASES, OF_ONE_MEMBER

FACTS: Mapping[str, Field] = {
    "low": Field("least value that the reduced number can have"),
    "high": Field("largest value that the reduced number can have"),
    "at": Field("swept value of the member that decides"),
    "members": Field("how many members are reduced", np.int64),
    "undecided": Field("how many of them could still change the reduced number", np.int64),
}
"""Additional facts of a reduced number."""
RISES, FALLS, NEITHER = 1.0, -1.0, 0.0
"""The numbers of `monotone`."""
DIRECTIONS = {RISES: "rises", FALLS: "falls", NEITHER: "neither rises nor falls throughout"}


class Reduced(NamedTuple):
    """A number of several members."""

    value: float
    low: float
    high: float
    member: int
    """Index of the member that decides."""
    open: Flags
    """Members that could change the number within their errors."""


def largest(x: Floats, e: Floats, key: Floats) -> Reduced:
    """Return the largest number; within their errors several members may have it."""
    low, member = float(np.max(x - e)), int(np.argmax(x))
    rivals = x + e >= low
    return Reduced(float(x[member]), low, float(np.max(x + e)), member, rivals & (e > 0.0))


def smallest(x: Floats, e: Floats, key: Floats) -> Reduced:
    """Return the smallest number: minus the largest of the negated numbers."""
    reduced = largest(-x, e, key)
    return Reduced(-reduced.value, -reduced.high, -reduced.low, reduced.member, reduced.open)


def mean(x: Floats, e: Floats, key: Floats) -> Reduced:
    """Return the mean; the deciding member is the one with the largest error."""
    average, error = float(np.mean(x)), float(np.mean(e))
    return Reduced(average, average - error, average + error, int(np.argmax(e)), e > 0.0)


def where_largest(x: Floats, e: Floats, key: Floats) -> Reduced:
    """Return the swept value of the largest number, and the range of those that may have it."""
    rivals = x + e >= np.max(x - e)
    member = int(np.argmax(x))
    # undecided only if several members may have it
    is_open = rivals if np.count_nonzero(rivals) > 1 else np.zeros_like(rivals)
    return Reduced(
        float(key[member]), float(np.min(key[rivals])), float(np.max(key[rivals])), member, is_open
    )


def where_smallest(x: Floats, e: Floats, key: Floats) -> Reduced:
    """Return the swept value of the smallest number."""
    return where_largest(-x, e, key)


def monotone(x: Floats, e: Floats, key: Floats) -> Reduced:
    """Return 1 if the numbers rise with the key from member to member, -1 if they fall, otherwise 0."""
    order = np.argsort(key, kind="stable")
    change, error = np.diff(x[order]), e[order][:-1] + e[order][1:]
    possible = [
        *([RISES] if np.all(change + error > 0.0) else []),
        *([FALLS] if np.all(change - error < 0.0) else []),
    ]
    if not (np.all(change - error > 0.0) or np.all(change + error < 0.0)):
        possible.append(NEITHER)
    direction = RISES if np.all(change > 0.0) else FALLS if np.all(change < 0.0) else NEITHER
    is_open = np.zeros(len(x), dtype=np.bool_)
    doubtful = np.abs(change) <= error
    is_open[order[:-1]] |= doubtful
    is_open[order[1:]] |= doubtful
    # the first turn, or the place that is nearest to one
    turns = np.flatnonzero(np.sign(change) != np.sign(change[0]))
    turn = int(turns[0]) if len(turns) else int(np.argmin(np.abs(change) - error))
    return Reduced(direction, min(possible), max(possible), int(order[turn]), is_open & (e > 0.0))


REDUCTIONS: Mapping[str, Callable[[Floats, Floats, Floats], Reduced]] = {
    row.__name__: row for row in (largest, smallest, mean, where_largest, where_smallest, monotone)
}


def is_as_asked(check: ValueCheck, low: float, high: float) -> bool | None:
    """Say whether all numbers from `low` to `high` meet the check, or none of them; None if some do."""
    if check.below is not None:
        all_hold, some_hold = high < check.below, low < check.below
    elif check.above is not None:
        all_hold, some_hold = low > check.above, high > check.above
    else:
        wanted = math.nan if check.equals is None else check.equals
        first, last = wanted - check.allowed, wanted + check.allowed
        all_hold, some_hold = first <= low and high <= last, low <= last and high >= first
    return True if all_hold else None if some_hold else False


def judge(experiment: Experiment, record: Record, check: ValueCheck, measured: Measured) -> Judged:
    """Compare the number of each member, or the reduced number of all members, with the check."""
    of_members = value.judge(experiment, record, check, measured)
    if check.take is None:
        return of_members
    members = np.flatnonzero(about_members(record, check))
    schemes = len(record["scheme"])
    deciding, reasons = np.full(schemes, members[0]), np.full(schemes, code("match"))
    table = {name: np.full(schemes, np.nan) for name in ("value", "error_bound", *FACTS)}
    has_levels = len(record["level"]) >= LEVELS_OF_AN_ORDER
    for s in range(schemes):
        broken = is_one_of(of_members.reason[s, members], "non_finite", "not_applicable")
        broken |= (of_members.reason[s, members] == code("too_few_levels")) & np.isnan(
            measured["value"][s, members]
        )
        table["members"][s], table["undecided"][s] = len(members), np.count_nonzero(broken)
        if broken.any():
            # a missing number makes the reduced number undefined
            deciding[s] = members[np.argmax(broken)]
            reasons[s] = of_members.reason[s, deciding[s]]
            continue
        r = _reduced(experiment, record, check, measured, s, members)
        deciding[s] = members[r.member]
        holds = is_as_asked(check, r.low, r.high)
        unclear = "pre_asymptotic" if has_levels else "too_few_levels"
        reasons[s] = code(unclear if holds is None else "match" if holds else "mismatch")
        table["value"][s], table["low"][s], table["high"][s] = (r.value, r.low, r.high)
        table["error_bound"][s] = max(r.high - r.value, r.value - r.low)
        table["at"][s] = _key(record, check)[deciding[s]]
        table["undecided"][s] = np.count_nonzero(r.open) if holds is None else 0
    shape = of_members.reason.shape

    def per_member(values: Any) -> Any:
        return np.broadcast_to(np.asarray(values)[:, None], shape)

    fields = {**value.FIELDS, **FACTS}
    facts = {name: (fields[name], per_member(values)) for name, values in table.items()}
    _, away = value.compare(check, table["value"])
    return Judged(per_member(reasons), per_member(away), facts=facts, members=deciding[:, None])


def _reduced(
    experiment: Experiment,
    record: Record,
    check: ValueCheck,
    measured: Measured,
    scheme: int,
    members: Any,
) -> Reduced:
    """Return the reduced number of these members of a scheme."""
    assert check.take is not None
    numbers = np.asarray(measured["value"], dtype=np.float64)[scheme, members]
    error = np.asarray(measured["error_bound"], dtype=np.float64)[scheme, members]
    if not check.number.has_limit(check.at.level):
        error = np.where(np.isinf(error), error, 0.0)
    else:
        is_open = np.isnan(error)
        if check.number.is_angle:
            # beyond pi it goes on at the other end of all angles
            is_open |= error > np.pi - np.abs(numbers)
        error = np.where(is_open, np.inf, error)
    key = _key(record, check)
    sweep = experiment.sweep
    if check.take == "monotone" and sweep is not None and sweep.follow == check.over:
        # the key is the position along the curve, which may go up and down
        key = np.arange(len(key), dtype=np.float64)
    return REDUCTIONS[check.take](numbers, error, key[members])


def _key(record: Record, check: ValueCheck) -> Floats:
    """Return the swept values over which the numbers are taken, shape (case,); NaN over all members."""
    if check.over == CASES:
        return np.full(len(record["case"]), np.nan)
    return np.asarray(recorded_columns(record)[str(check.over)], dtype=np.float64)


def describe(f: MemberFacts, check: ValueCheck) -> Description:
    """Describe the number of a member, or the reduced number of all members."""
    if check.take is None:
        return value_text.describe(f, check)
    members = np.flatnonzero(about_members(f.record, check))
    subject = f"{value_text.what(check, f.notation)} over {len(members)} members"
    if f.reason not in ("match", "mismatch", "pre_asymptotic") and not (
        f.reason == "too_few_levels" and np.isfinite(f.fact("value"))
    ):
        description = value_text.describe(f, check)
        finding = description.sentence.removesuffix(".")
        place = _at(f, check, f.case)
        rule = f"{f.notation.opening(subject)} cannot be taken together: at {place}, {finding}."
        return Description(rule, description.advice, f"not known at {place}")
    measured = {name: field_values(f.record, f.id, name) for name in ("value", "error_bound")}
    r = _reduced(f.experiment, f.record, check, measured, f.scheme, members)
    finding = _finding(f, check, r, members)
    holds, doubted, not_so = _asked(f, check)
    if f.reason == "match":
        return Description(f"{finding}{holds}.", "", finding)
    if f.reason == "mismatch":
        key, _ = value.border(check)
        return Description(
            f"{finding}{not_so}.", f"Change `{key}:`, `model:` or `sweep:`.", finding
        )
    places = members[np.flatnonzero(r.open)]
    more = " and others" if len(places) > 1 else ""
    which = f" ({_at(f, check, int(places[0]))}{more})" if len(places) else ""
    verb = "is" if len(places) == 1 else "are"
    left = f"{len(places)} of {len(members)} members {verb} not resolved well enough{which}"
    causes = (value_text.advice_on_bound(replace(f, case=int(place)), check) for place in places)
    advice = (
        next(filter(None, causes), "") or f"A{value_text.finer_levels(f)} to shrink the errors."
    )
    return Description(f"{finding}{doubted}, because {left}.", advice, finding)


def _at(f: MemberFacts, check: ValueCheck, case: int) -> str:
    """Name a member by its swept value and, on a curve that goes up and down, by its branch."""
    if check.over == CASES:
        swept = ((name, values[case]) for name, values in recorded_columns(f.record).items())
        return ", ".join(
            f"{name} = {f.notation.number(x, 8) if isinstance(x, float) else x}"
            for name, x in swept
        )
    key = _key(f.record, check)
    here = f"{check.over} = {f.notation.number(float(key[case]), 8)}"
    sweep = f.experiment.sweep
    if sweep is None or sweep.follow != check.over:
        return here
    first = case - case % f.experiment.chain
    curve = key[first : first + f.experiment.chain]
    if np.all(np.diff(curve) >= 0.0) or np.all(np.diff(curve) <= 0.0):
        return here
    # the first point of a curve belongs to the branch that follows
    after = max(case - first, 1)
    way = "up" if curve[after] > curve[after - 1] else "down"
    return f"{here} on the way {way}"


def _asked(f: MemberFacts, check: ValueCheck) -> tuple[str, str, str]:
    """Return the phrases for a number that meets the check, that may meet it, and that does not."""
    if check.take == "monotone":
        way = DIRECTIONS[float(check.equals or 0.0)]
        return ", as asked", f"; it may or may not be that it {way}", f"; asked is that it {way}"
    unit = number_units.unit_of(f.experiment, f.record, check)
    rule = value_text.rule(check, f.notation, unit)
    return f"; it is {rule}", f"; it may or may not be {rule}", f"; it is not {rule}"


def _finding(f: MemberFacts, check: ValueCheck, r: Reduced, members: Any) -> str:
    """State the reduced number with its error."""
    take, count = str(check.take), len(members)
    what = value_text.what_of_all(check, f.notation)
    place = _at(f, check, int(members[r.member]))
    number, unit = f.notation.number, number_units.unit_of(f.experiment, f.record, check)
    if take == "monotone":
        numbers = field_values(f.record, f.id, "value")[f.scheme, members]
        stays = np.count_nonzero(numbers == numbers[r.member]) > 1
        turn = f"; it {'is the same beside' if stays else 'turns at'} {place}"
        turn = turn if r.value == NEITHER else ""
        return f"{f.notation.opening(what)} {DIRECTIONS[r.value]} with {check.over} over {count} members{turn}"
    if take.startswith("where_"):
        which = take.removeprefix("where_")
        span = f", or elsewhere from {number(r.low, 8)} to {number(r.high, 8)}"
        span = "" if r.low == r.high else span
        return f"The {which} {what} over {count} members is at {place}{span}"
    error = max(r.high - r.value, r.value - r.low)
    finding = f"The {take} {what} over {count} members is {number(r.value, 10)} {unit}".rstrip()
    finding += f", at {place}" if take in OF_ONE_MEMBER else ""
    if math.isinf(error):
        return f"{finding}, with an unknown error"
    if not check.number.has_limit(check.at.level):
        return finding
    return f"{finding}, with an error of at most {number(error, 2)}"
