"""Where in a sweep the results of a status lie: a range, a box, and a distribution for every swept key."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.formal_orders import columns_of
from vibsim.checks.notation import PLAIN
from vibsim.checks.outcome import Outcome
from vibsim.convergence.reasons import PASS
from vibsim.core.array_types import Integers
from vibsim.core.decimals import round_outward
from vibsim.core.record import Record
from vibsim.core.vocabulary import STATUSES

Column = NDArray[Any]

IN_BOX = 0.95
"""Part of the results that the box holds, at least."""
BINS = 8
"""A key's values are reported in so many bins with the same number of members, or fewer."""
TELLING = 0.5
"""Ranges that hold no more than this part of all members say where something is."""
MOST_KEYS = 2
"""A sentence names so many keys."""


def sweep_regions(record: Record, outcome: Outcome) -> dict[str, Any]:
    """Tell where in a sweep, whose values the convergence Record has, the results lie that did not pass.

    Returns
    -------
    dict
        For every status but PASS that occurs: ``count``; ``schemes``, the number by scheme; ``keys``, for every swept
        key of numbers ``range`` (least and largest value that occurs), ``box`` (the shortest interval, so that all of
        them together hold `IN_BOX` of the results) and ``bins`` (``from``, ``to``, and the ``share`` of the results in
        it that have the status), and for one of words ``shares``; and ``text``, a sentence. Empty without a sweep.
    """
    if outcome.is_of_all or outcome.total == 1:
        return {}
    columns = {key: values[outcome.case_index] for key, values in columns_of(record).items()}
    if not columns:
        return {}
    bins = {key: _bins(values) for key, values in columns.items()}
    found: dict[str, Any] = {}
    for code, status in enumerate(STATUSES):
        mask = outcome.chosen == code
        if code == PASS or not mask.any():
            continue
        hits, count = mask.sum(axis=0), int(mask.sum())
        keys = {
            key: _along(values, bins[key], hits, len(outcome.schemes), len(columns))
            for key, values in columns.items()
        }
        found[status] = {
            "text": _sentence(status, count, outcome.total, columns, keys, hits),
            "count": count,
            "schemes": dict(zip(outcome.schemes, mask.sum(axis=1).tolist(), strict=True)),
            "keys": keys,
        }
    return found


def _bins(values: Column) -> Integers:
    """Return the number of the bin of every value; equal values share a bin, and a bin is an interval."""
    ordered = np.sort(values)
    distinct = ordered[np.r_[True, ordered[1:] != ordered[:-1]]]
    if len(distinct) > BINS and values.dtype.kind == "f":
        starts = np.arange(BINS) * len(values) // BINS
        distinct = np.unique(ordered[starts])
    return np.searchsorted(distinct, values, side="right") - 1


def _along(
    values: Column, bins: Integers, hits: Integers, schemes: int, keys: int
) -> dict[str, Any]:
    """Describe along one key where `hits`, the number of results of every member, are."""
    members = np.bincount(bins)
    shares = (np.bincount(bins, weights=hits) / (members * schemes)).tolist()
    inside = [values[bins == place] for place in range(len(members))]
    if values.dtype.kind != "f":
        return {"shares": {str(one[0]): share for one, share in zip(inside, shares, strict=True)}}
    found = np.sort(np.repeat(values, hits))
    # the shortest interval that holds its share; what each key may leave out adds up
    held = math.ceil((1.0 - (1.0 - IN_BOX) / keys) * len(found))
    first = int(np.argmin(found[held - 1 :] - found[: len(found) - held + 1]))
    return {
        "range": [float(found[0]), float(found[-1])],
        "box": [float(found[first]), float(found[first + held - 1])],
        "bins": [
            {"from": float(one.min()), "to": float(one.max()), "share": share}
            for one, share in zip(inside, shares, strict=True)
        ],
    }


def _sentence(
    status: str,
    count: int,
    total: int,
    columns: Mapping[str, Column],
    keys: Mapping[str, Any],
    hits: Integers,
) -> str:
    """Say how many results have a status, and where they are, if they are anywhere in particular."""
    if count == total:
        return f"{status} in all {total} results"
    start = f"{status} in {count} of {total} results"
    all_with = "all with" if count > 1 else "with"
    for name, words in (("range", all_with), ("box", f"at least {IN_BOX:.0%} of them with")):
        places = sorted(_place(key, columns[key], keys[key], name, hits) for key in columns)[
            :MOST_KEYS
        ]
        telling = [text for part, text, alone in places if part <= TELLING or (alone and part < 1)]
        if not telling and math.prod(part for part, _, _ in places) <= TELLING:
            telling = [text for part, text, _ in places if part < 1]
        if telling:
            return f"{start}, {words} {' and '.join(telling)}"
    return start if count == 1 else f"{start}, spread over the sweep"


def _place(
    key: str, values: Column, found: Mapping[str, Any], name: str, hits: Integers
) -> tuple[float, str, bool]:
    """Return the part of all members that a range or box holds along one key, that in words, and if it holds all alone.

    All alone means that it separates the members with results from those without, and so tells, however large.
    """
    if name in found:
        low, high = found[name]
        inside, text = (values >= low) & (values <= high), _interval(key, values, low, high)
    else:
        words = [word for word, share in found["shares"].items() if share > 0]
        inside, text = np.isin(values, words), f"{key} {' or '.join(words)}"
    return float(np.mean(inside)), text, bool(np.array_equal(inside, hits > 0))


def _interval(key: str, values: Column, low: float, high: float) -> str:
    if low == high:
        return f"{key} equal to {PLAIN.number(low)}"
    # rounded outward, so that what is said is true
    least, most = _rounded(low, up=False), _rounded(high, up=True)
    if high >= np.max(values):
        return f"{key} of {least} or more"
    if low <= np.min(values):
        return f"{key} of {most} or less"
    return f"{key} from {least} to {most}"


def _rounded(value: float, *, up: bool) -> str:
    """Write a number with up to 6 significant digits, rounded one way where it has more.

    What it has are its 15 decimal digits: those of 1.9 are no 1.8999999999999999.
    """
    return PLAIN.number(round_outward(float(f"{value:.15g}"), 6, up=up))
