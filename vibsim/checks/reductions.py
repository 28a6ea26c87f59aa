"""A number of all members that a ``value`` check is about: the largest one, the mean, where the largest is, and others.

Every member has a number x and a bound e of its error: 0 for the number of one level, which is what it is; of a limit,
what the levels leave. Where that is not known, all finer levels together are taken to change it by no more than three
times its last change (`vibsim.checks.value.STILL_TO_CHANGE`); with no change to see it is infinite. The true number of
a member is from x - e to x + e. So the reduced number is from `low` to `high`, the least and the largest value that
numbers in these intervals can give it. It is as asked where every value between them is, and not as asked where none
is. Else the levels decide nothing, and the members that could change the outcome are named.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from vibsim.apriori.formal_orders import columns_of
from vibsim.checks import value
from vibsim.checks.fields import Field, Measured, field_values
from vibsim.checks.outcome import Judged, about_members
from vibsim.checks.sentences import Description, Found
from vibsim.convergence.reasons import code, is_one_of
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER
from vibsim.experiment import Experiment
from vibsim.experiment.schema.checks import ValueCheck
from vibsim.experiment.value_names import OF_ONE_MEMBER

FACTS: Mapping[str, Field] = {
    "low": Field("least value that the reduced number can have"),
    "high": Field("largest value that the reduced number can have"),
    "at": Field("swept value of the member that decides"),
    "members": Field("how many members are reduced", np.int64),
    "undecided": Field("how many of them could still change the reduced number", np.int64),
}
"""What a result states beside the fields of a number: these of the reduced number."""
RISES, FALLS, NEITHER = 1.0, -1.0, 0.0
"""The number for `monotone`."""
DIRECTIONS = {RISES: "rises", FALLS: "falls", NEITHER: "neither rises nor falls throughout"}


IN_WORDS: Mapping[str, str] = {
    "largest": "largest",
    "smallest": "smallest",
    "mean": "mean",
    "where_largest": "place of the largest",
    "where_smallest": "place of the smallest",
    "monotone": "direction of",
}
"""How the name of a reduced number begins."""


class Reduced(NamedTuple):
    """A number of several members."""

    value: float
    low: float
    high: float
    member: int
    """Position of the member that decides."""
    open: Flags
    """Members that could change the number, as far as the levels tell."""


def largest(x: Floats, e: Floats, key: Floats) -> Reduced:
    """Return the largest number; several members may have it, as far as their errors tell."""
    low, place = float(np.max(x - e)), int(np.argmax(x))
    may = x + e >= low
    return Reduced(float(x[place]), low, float(np.max(x + e)), place, may & (e > 0.0))


def smallest(x: Floats, e: Floats, key: Floats) -> Reduced:
    """Return the smallest number: minus the largest one of the negative numbers."""
    found = largest(-x, e, key)
    return Reduced(-found.value, -found.high, -found.low, found.member, found.open)


def mean(x: Floats, e: Floats, key: Floats) -> Reduced:
    """Return the mean; the member with the largest error decides how well it is known."""
    found, error = float(np.mean(x)), float(np.mean(e))
    return Reduced(found, found - error, found + error, int(np.argmax(e)), e > 0.0)


def where_largest(x: Floats, e: Floats, key: Floats) -> Reduced:
    """Return the swept value at which the largest number is: one of those of the members that may have it."""
    may = x + e >= np.max(x - e)
    place = int(np.argmax(x))
    # several that may have it leave open which of them has
    still = may if np.count_nonzero(may) > 1 else np.zeros_like(may)
    return Reduced(
        float(key[place]), float(np.min(key[may])), float(np.max(key[may])), place, still
    )


def where_smallest(x: Floats, e: Floats, key: Floats) -> Reduced:
    """Return the swept value at which the smallest number is."""
    return where_largest(-x, e, key)


def monotone(x: Floats, e: Floats, key: Floats) -> Reduced:
    """Return 1 where the numbers rise with the key from member to member, -1 where they fall, else 0."""
    order = np.argsort(key, kind="stable")
    change, error = np.diff(x[order]), e[order][:-1] + e[order][1:]
    possible = [
        *([RISES] if np.all(change + error > 0.0) else []),
        *([FALLS] if np.all(change - error < 0.0) else []),
    ]
    if not (np.all(change - error > 0.0) or np.all(change + error < 0.0)):
        possible.append(NEITHER)
    found = RISES if np.all(change > 0.0) else FALLS if np.all(change < 0.0) else NEITHER
    still = np.zeros(len(x), dtype=np.bool_)
    doubtful = np.abs(change) <= error
    still[order[:-1]] |= doubtful
    still[order[1:]] |= doubtful
    # where it turns first, or most nearly does
    turns = np.flatnonzero(np.sign(change) != np.sign(change[0]))
    place = int(turns[0]) if len(turns) else int(np.argmin(np.abs(change) - error))
    return Reduced(found, min(possible), max(possible), int(order[place]), still & (e > 0.0))


REDUCTIONS: Mapping[str, Callable[[Floats, Floats, Floats], Reduced]] = {
    row.__name__: row for row in (largest, smallest, mean, where_largest, where_smallest, monotone)
}


def is_as_asked(check: ValueCheck, low: float, high: float) -> bool | None:
    """Say whether every number from `low` to `high` is as asked, or none; None where some are."""
    if check.below is not None:
        every, some = high < check.below, low < check.below
    elif check.above is not None:
        every, some = low > check.above, high > check.above
    else:
        wanted = math.nan if check.equals is None else check.equals
        first, last = wanted - check.allowed, wanted + check.allowed
        every, some = first <= low and high <= last, low <= last and high >= first
    return True if every else None if some else False


def judge(experiment: Experiment, record: Record, check: ValueCheck, found: Measured) -> Judged:
    """Compare a number with what the check asks of it: that of every member, or one of all of them."""
    own = value.judge(experiment, record, check, found)
    if check.take is None:
        return own
    about = np.flatnonzero(about_members(record, check))
    schemes = len(record["scheme"])
    places, reasons = np.full(schemes, about[0]), np.full(schemes, code("match"))
    table = {name: np.full(schemes, np.nan) for name in ("value", "error_bound", *FACTS)}
    enough = len(record["level"]) >= LEVELS_OF_AN_ORDER
    for s in range(schemes):
        broken = is_one_of(own.reason[s, about], "non_finite", "not_applicable")
        broken |= (own.reason[s, about] == code("too_few_levels")) & np.isnan(
            found["value"][s, about]
        )
        table["members"][s], table["undecided"][s] = len(about), np.count_nonzero(broken)
        if broken.any():
            # a number that does not exist leaves none of all members
            places[s] = about[np.argmax(broken)]
            reasons[s] = own.reason[s, places[s]]
            continue
        one = _reduced(experiment, record, check, found, s, about)
        places[s] = about[one.member]
        holds = is_as_asked(check, one.low, one.high)
        unclear = "pre_asymptotic" if enough else "too_few_levels"
        reasons[s] = code(unclear if holds is None else "match" if holds else "mismatch")
        table["value"][s], table["low"][s], table["high"][s] = one.value, one.low, one.high
        table["error_bound"][s] = max(one.high - one.value, one.value - one.low)
        table["at"][s] = _key(record, check)[places[s]]
        table["undecided"][s] = np.count_nonzero(one.open) if holds is None else 0
    shape = own.reason.shape

    def wide(values: Any) -> Any:
        return np.broadcast_to(np.asarray(values)[:, None], shape)

    fields = {**value.FIELDS, **FACTS}
    facts = {name: (fields[name], wide(values)) for name, values in table.items()}
    _, away = value.compare(check, table["value"])
    return Judged(wide(reasons), wide(away), facts=facts, members=places[:, None])


def _reduced(
    experiment: Experiment,
    record: Record,
    check: ValueCheck,
    found: Measured,
    scheme: int,
    about: Any,
) -> Reduced:
    """Return the number of the members `about`, by their positions, of a scheme."""
    assert check.take is not None
    numbers = np.asarray(found["value"], dtype=np.float64)[scheme, about]
    error = np.zeros(len(about))
    if check.number.has_limit(check.at.level):
        error = np.asarray(found["error_bound"], dtype=np.float64)[scheme, about]
        is_open = np.isnan(error)
        if check.number.is_angle:
            # beyond pi it goes on at the other end of all angles
            is_open |= error > np.pi - np.abs(numbers)
        error = np.where(is_open, np.inf, error)
    key = _key(record, check)
    sweep = experiment.sweep
    if check.take == "monotone" and sweep is not None and sweep.follow == check.over:
        # along the curve, which may go up and down
        key = np.arange(len(key), dtype=np.float64)
    return REDUCTIONS[check.take](numbers, error, key[about])


def _key(record: Record, check: ValueCheck) -> Floats:
    """Return the swept values over which the numbers are taken, shape (case,)."""
    return np.asarray(columns_of(record)[str(check.over)], dtype=np.float64)


def describe(f: Found, check: ValueCheck) -> Description:
    """Say what a number is: that of a member, or one of all of them."""
    if check.take is None:
        return value.describe(f, check)
    about = np.flatnonzero(about_members(f.record, check))
    of = f"{value.what(check, f.notation)} over {len(about)} members"
    if f.reason not in ("match", "mismatch", "pre_asymptotic") and not (
        f.reason == "too_few_levels" and np.isfinite(f.fact("value"))
    ):
        own = value.describe(f, check)
        finding = own.sentence.removesuffix(".")
        here = _at(f, check, f.case)
        rule = f"{f.notation.opening(of)} cannot be taken together: at {here}, {finding}."
        return Description(rule, own.advice, f"not known at {here}")
    found = {name: field_values(f.record, f.id, name) for name in ("value", "error_bound")}
    one = _reduced(f.experiment, f.record, check, found, f.scheme, about)
    finding = _finding(f, check, one, about)
    holds, doubted, not_so = _asked(f, check)
    if f.reason == "match":
        return Description(f"{finding}{holds}.", "", finding)
    if f.reason == "mismatch":
        key, _ = value.border(check)
        return Description(
            f"{finding}{not_so}.", f"Change `{key}:`, `model:` or `sweep:`.", finding
        )
    places = about[np.flatnonzero(one.open)]
    more = " and others" if len(places) > 1 else ""
    which = f" ({_at(f, check, int(places[0]))}{more})" if len(places) else ""
    verb = "is" if len(places) == 1 else "are"
    left = f"{len(places)} of {len(about)} members {verb} not resolved well enough{which}"
    causes = (value.advice_on_bound(replace(f, case=int(place)), check) for place in places)
    advice = next(filter(None, causes), "") or f"A{value.finer_levels(f)} to shrink the errors."
    return Description(f"{finding}{doubted}, because {left}.", advice, finding)


def _at(f: Found, check: ValueCheck, case: int) -> str:
    """Name a member, by its position, by its swept value, and by its branch of a curve that goes up and down."""
    key = _key(f.record, check)
    here = f"{check.over} = {f.notation.number(float(key[case]), 8)}"
    sweep = f.experiment.sweep
    if sweep is None or sweep.follow != check.over:
        return here
    first = case - case % f.experiment.chain
    curve = key[first : first + f.experiment.chain]
    if np.all(np.diff(curve) >= 0.0) or np.all(np.diff(curve) <= 0.0):
        return here
    # a curve begins in the direction in which it goes on
    after = max(case - first, 1)
    way = "up" if curve[after] > curve[after - 1] else "down"
    return f"{here} on the way {way}"


def _asked(f: Found, check: ValueCheck) -> tuple[str, str, str]:
    """Say what is asked of the number: that it is so, that it may be so, and that it is not."""
    if check.take == "monotone":
        way = DIRECTIONS[float(check.equals or 0.0)]
        return ", as asked", f"; it may or may not be that it {way}", f"; asked is that it {way}"
    rule = value.rule(check, f.notation)
    return f"; it is {rule}", f"; it may or may not be {rule}", f"; it is not {rule}"


def _finding(f: Found, check: ValueCheck, one: Reduced, about: Any) -> str:
    """Say what was found, with the error that the levels leave."""
    what, take, count = value.what(check, f.notation), str(check.take), len(about)
    here = _at(f, check, int(about[one.member]))
    number, unit = f.notation.number, value.unit_of(f.experiment, f.record, check)
    if take == "monotone":
        turn = "" if one.value != NEITHER else f"; it turns at {here}"
        return f"{f.notation.opening(what)} {DIRECTIONS[one.value]} with {check.over} over {count} members{turn}"
    if take.startswith("where_"):
        which = take.removeprefix("where_")
        span = f", or elsewhere from {number(one.low, 8)} to {number(one.high, 8)}"
        span = "" if one.low == one.high else span
        return f"The {which} {what} over {count} members is at {here}{span}"
    error = max(one.high - one.value, one.value - one.low)
    finding = f"The {take} {what} over {count} members is {number(one.value, 10)} {unit}".rstrip()
    finding += f", at {here}" if take in OF_ONE_MEMBER else ""
    if not check.number.has_limit(check.at.level):
        return finding
    if math.isinf(error):
        return f"{finding}, with an unknown error"
    return f"{finding}, with an error of at most {number(error, 2)}"
