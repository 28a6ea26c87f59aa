"""Where in a sweep the results of a status lie: a range, a box, and a distribution for each swept key."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.checks.notation import PLAIN
from vibsim.checks.outcome import Outcome
from vibsim.convergence.reasons import PASS
from vibsim.core.array_types import Integers
from vibsim.core.decimals import round_outward
from vibsim.core.record import Record
from vibsim.core.vocabulary import STATUSES
from vibsim.experiment.sweep_columns import recorded_columns

Column = NDArray[Any]

IN_BOX = 0.95
"""Least part of the results inside the box."""
BINS = 8
"""Largest number of bins for the values of a key; bins have the same number of members."""
TELLING = 0.5
"""A range is informative if it holds at most this part of all members."""
MOST_KEYS = 2
"""Largest number of keys that a sentence names."""


def sweep_regions(record: Record, outcome: Outcome) -> dict[str, Any]:
    """Return where in a sweep the results lie that did not pass.

    Returns
    -------
    dict
        For each status but PASS that occurs: ``count``; ``schemes``, the count by scheme; ``keys``; and ``text``, a
        sentence. Each numeric key has a ``range`` (least and largest value), a ``box`` (the shortest interval such that
        all boxes together hold `IN_BOX` of the results) and ``bins`` (``from``, ``to``, and the ``share`` of results
        with that status); a key of words has ``shares``. Empty without a sweep.
    """
    if outcome.is_of_all or outcome.total == 1:
        return {}
    columns = {key: values[outcome.case_index] for key, values in recorded_columns(record).items()}
    if not columns:
        return {}
    bins = {key: _bins(values) for key, values in columns.items()}
    regions: dict[str, Any] = {}
    for code, status in enumerate(STATUSES):
        mask = outcome.chosen == code
        if code == PASS or not mask.any():
            continue
        hits, count = mask.sum(axis=0), int(mask.sum())
        keys = {
            key: _along_key(values, bins[key], hits, len(outcome.schemes), len(columns))
            for key, values in columns.items()
        }
        regions[status] = {
            "text": _sentence(status, count, outcome.total, columns, keys, hits),
            "count": count,
            "schemes": dict(zip(outcome.schemes, mask.sum(axis=1).tolist(), strict=True)),
            "keys": keys,
        }
    return regions


def _bins(values: Column) -> Integers:
    """Return the bin index of each value; bins are intervals, and equal values share a bin."""
    ordered = np.sort(values)
    distinct = ordered[np.r_[True, ordered[1:] != ordered[:-1]]]
    if len(distinct) > BINS and values.dtype.kind == "f":
        starts = np.arange(BINS) * len(values) // BINS
        distinct = np.unique(ordered[starts])
    return np.searchsorted(distinct, values, side="right") - 1


def _along_key(
    values: Column, bins: Integers, hits: Integers, schemes: int, keys: int
) -> dict[str, Any]:
    """Describe the distribution along one key of `hits`, the number of results of each member."""
    members = np.bincount(bins)
    shares = (np.bincount(bins, weights=hits) / (members * schemes)).tolist()
    per_bin = [values[bins == place] for place in range(len(members))]
    if values.dtype.kind != "f":
        return {"shares": {str(x[0]): share for x, share in zip(per_bin, shares, strict=True)}}
    ordered = np.sort(np.repeat(values, hits))
    # the shortest interval that holds enough results; the parts outside of it add up over the keys
    count = math.ceil((1.0 - (1.0 - IN_BOX) / keys) * len(ordered))
    first = int(np.argmin(ordered[count - 1 :] - ordered[: len(ordered) - count + 1]))
    return {
        "range": [float(ordered[0]), float(ordered[-1])],
        "box": [float(ordered[first]), float(ordered[first + count - 1])],
        "bins": [
            {"from": float(x.min()), "to": float(x.max()), "share": share}
            for x, share in zip(per_bin, shares, strict=True)
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
    """Say how many results have a status, and where they are if they are not spread over the sweep."""
    if count == total:
        return f"{status} in all {total} results"
    start = f"{status} in {count} of {total} results"
    all_with = "all with" if count > 1 else "with"
    for name, words in (("range", all_with), ("box", f"at least {IN_BOX:.0%} of them with")):
        places = sorted(_share_inside(key, columns[key], keys[key], name, hits) for key in columns)[
            :MOST_KEYS
        ]
        telling = [
            text for share, text, alone in places if share <= TELLING or (alone and share < 1)
        ]
        if not telling and math.prod(share for share, _, _ in places) <= TELLING:
            telling = [text for share, text, _ in places if share < 1]
        if telling:
            return f"{start}, {words} {' and '.join(telling)}"
    return start if count == 1 else f"{start}, spread over the sweep"


def _share_inside(
    key: str, values: Column, region: Mapping[str, Any], name: str, hits: Integers
) -> tuple[float, str, bool]:
    """Return the share of all members in a range or box of one key, its text, and whether it is exact.

    It is exact if it separates the members with results from all others; then it is informative at any size.
    """
    if name in region:
        low, high = region[name]
        inside, text = (values >= low) & (values <= high), _interval(key, values, low, high)
    else:
        words = [word for word, share in region["shares"].items() if share > 0]
        inside, text = np.isin(values, words), f"{key} {' or '.join(words)}"
    return float(np.mean(inside)), text, bool(np.array_equal(inside, hits > 0))


def _interval(key: str, values: Column, low: float, high: float) -> str:
    if low == high:
        return f"{key} equal to {PLAIN.number(low)}"
    # rounded outward, so that the statement is true
    least, most = _rounded(low, up=False), _rounded(high, up=True)
    if high >= np.max(values):
        return f"{key} of {least} or more"
    if low <= np.min(values):
        return f"{key} of {most} or less"
    return f"{key} from {least} to {most}"


def _rounded(value: float, *, up: bool) -> str:
    """Write a number with up to 6 significant digits, rounded up or down.

    It is first rounded to 15 decimal digits: 1.9 is not 1.8999999999999999.
    """
    return PLAIN.number(round_outward(float(f"{value:.15g}"), 6, up=up))
