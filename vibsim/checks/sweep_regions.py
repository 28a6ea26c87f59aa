"""Where in a sweep the results of a status lie: a range, a box, and a distribution for every swept key."""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.formal_orders import columns_of
from vibsim.checks.outcome import PASS, Outcome
from vibsim.checks.words.notation import PLAIN
from vibsim.core.record import Record
from vibsim.core.vocabulary import STATUSES

Column = NDArray[Any]
Counts = NDArray[np.int64]

IN_BOX = 0.95
"""Part of the results that the box holds, at least."""
BINS = 8
"""A key's values are told in so many bins with the same number of members, or fewer."""
TELLING = 0.5
"""Ranges that hold no more than this part of all members say where something is."""
TOLD = 2
"""A sentence names so many keys."""


def where(record: Record, outcome: Outcome) -> dict[str, Any]:
    """Tell where in a sweep the results lie that did not pass.

    Parameters
    ----------
    record
        Convergence Record, for the swept values.
    outcome
        What a check measured, compared with what was expected.

    Returns
    -------
    dict
        For every status but PASS that occurs: ``count``; ``schemes``, the number by scheme; ``keys``, for every swept
        key of numbers ``range`` (least and largest value that occurs), ``box`` (the shortest interval, so that all of
        them together hold `IN_BOX` of the results) and ``bins`` (``from``, ``to``, and the ``share`` of the results in
        it that have the status), and for one of words ``shares``; and ``text``, a sentence. Empty without a sweep.
    """
    columns = {key: values[outcome.case_index] for key, values in columns_of(record).items()}
    if not columns or outcome.total == 1:
        return {}
    bins = {key: _bins(values) for key, values in columns.items()}
    found: dict[str, Any] = {}
    for code, status in enumerate(STATUSES):
        mask = outcome.chosen == code
        if code != PASS and mask.any():
            hits = mask.sum(axis=0)
            keys = {
                key: _along(values, bins[key], hits, len(outcome.schemes), len(columns))
                for key, values in columns.items()
            }
            by_scheme = zip(outcome.schemes, mask.sum(axis=1).tolist(), strict=True)
            found[status] = {
                "text": _sentence(status, int(hits.sum()), outcome.total, columns, keys, hits),
                "count": int(hits.sum()),
                "schemes": dict(by_scheme),
                "keys": keys,
            }
    return found


def _bins(values: Column) -> Counts:
    """Return the number of the bin of every value; equal values share a bin, and a bin is an interval."""
    ordered = np.sort(values)
    distinct = ordered[np.r_[True, ordered[1:] != ordered[:-1]]]
    if len(distinct) > BINS and values.dtype.kind == "f":
        starts = np.arange(BINS) * len(values) // BINS
        distinct = np.unique(ordered[starts])
    return np.searchsorted(distinct, values, side="right") - 1


def _along(values: Column, bins: Counts, hits: Counts, schemes: int, keys: int) -> dict[str, Any]:
    """Describe along one key where `hits`, the number of results of every member, are."""
    members = np.bincount(bins)
    shares = np.bincount(bins, weights=hits, minlength=len(members)) / (members * schemes)
    if values.dtype.kind != "f":
        _, first = np.unique(bins, return_index=True)
        words = map(str, values[first])
        return {"shares": dict(zip(words, shares.tolist(), strict=True))}
    among = np.sort(values[hits > 0])
    low, high = _ends(values, bins, len(members))
    return {
        "range": [float(among[0]), float(among[-1])],
        # what each key may leave out adds up
        "box": _shortest(np.sort(np.repeat(values, hits)), 1.0 - (1.0 - IN_BOX) / keys),
        "bins": [
            {"from": a, "to": b, "share": share}
            for a, b, share in zip(low, high, shares.tolist(), strict=True)
        ],
    }


def _ends(values: Column, bins: Counts, count: int) -> tuple[list[float], list[float]]:
    """Return the least and the largest value of every bin."""
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, bins, values)
    np.maximum.at(high, bins, values)
    return low.tolist(), high.tolist()


def _shortest(ordered: Column, share: float) -> list[float]:
    """Return the shortest interval that holds a share of some values."""
    held = math.ceil(share * len(ordered))
    first = int(np.argmin(ordered[held - 1 :] - ordered[: len(ordered) - held + 1]))
    return [float(ordered[first]), float(ordered[first + held - 1])]


def _sentence(
    status: str,
    count: int,
    total: int,
    columns: Mapping[str, Column],
    keys: Mapping[str, Any],
    hits: Counts,
) -> str:
    """Say how many results have a status, and where they are, if they are anywhere in particular."""
    if count == total:
        return f"{status} in all {total} results"
    start = f"{status} in {count} of {total} results"
    all_with = "all with" if count > 1 else "with"
    for name, words in (("range", all_with), ("box", f"at least {IN_BOX:.0%} of them with")):
        places = [_place(key, columns[key], keys[key], name, hits) for key in columns]
        telling = _telling(sorted(places)[:TOLD])
        if telling:
            return f"{start}, {words} {' and '.join(telling)}"
    return start if count == 1 else f"{start}, spread over the sweep"


def _telling(places: list[tuple[float, str, bool]]) -> list[str]:
    """Return the places that tell where something is, each for itself or, if none does, together.

    However large, a place tells it that holds nothing else.
    """
    found = [text for part, text, alone in places if part <= TELLING or (alone and part < 1)]
    if not found and math.prod(part for part, _, _ in places) <= TELLING:
        return [text for part, text, _ in places if part < 1]
    return found


def _place(
    key: str, values: Column, found: Mapping[str, Any], name: str, hits: Counts
) -> tuple[float, str, bool]:
    """Return the part of all members that a range or box holds along one key, that in words, and if it holds all alone.

    All alone means that it separates the members with results from those without.
    """
    if name not in found:
        words = [word for word, share in found["shares"].items() if share > 0]
        inside, text = np.isin(values, words), f"{key} {' or '.join(words)}"
    else:
        low, high = found[name]
        inside, text = (values >= low) & (values <= high), _interval(key, values, low, high)
    return float(np.mean(inside)), text, bool(np.array_equal(inside, hits > 0))


def _interval(key: str, values: Column, low: float, high: float) -> str:
    if low == high:
        return f"{key} equal to {PLAIN.number(low)}"
    # rounded outward, so that what is said is true
    least, most = (_rounded(end, way) for end, way in ((low, ROUND_FLOOR), (high, ROUND_CEILING)))
    if high >= np.max(values):
        return f"{key} of {least} or more"
    if low <= np.min(values):
        return f"{key} of {most} or less"
    return f"{key} from {least} to {most}"


def _rounded(value: float, way: str) -> str:
    """Write a number with up to 6 significant digits, rounded one way where it has more.

    What it has are its 15 decimal digits: those of 1.9 are no 1.8999999999999999.
    """
    return PLAIN.number(float(Context(prec=6, rounding=way).create_decimal(f"{value:.15g}")))
