"""The check ``equal``: how far two solutions are from each other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.checks.fields import Field, measured
from vibsim.checks.of_schemes import (
    MATCH,
    MISMATCH,
    MOTIONS,
    NON_FINITE,
    NOT_APPLICABLE,
    by_reason,
    level_of,
    lies_still,
)
from vibsim.checks.outcome import Outcome
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.comparison.solution_distance import apart
from vibsim.core.record import Record
from vibsim.observe.member_block import MemberBlock

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import EqualCheck

Floats = NDArray[np.float64]

FIELDS = {
    "distance": Field("largest distance of the two solutions, in the unit of the quantity"),
    "allowed": Field("how far they may be apart, in the unit of the quantity"),
    "motion": Field("whether anything moves in either", np.int8, MOTIONS),
    "level": Field("level", np.int16, dims=()),
    "distance_over_time": Field(
        "largest distance around each of evenly spaced places in time, in the unit of the quantity",
        dims=("case", "place"),
        of_figure=True,
    ),
}
"""Of other schemes than the first one that a check names, distances are NaN."""
PLACES = 241
"""Most places in time of a distance: as many as a figure has pixels."""


def measure(
    block: MemberBlock, compared: Mapping[str, Comparison], check: EqualCheck
) -> Mapping[str, Any]:
    """Return what a check measures."""
    level = level_of(block, check)
    found = apart(block, compared, check)
    distance, allowed = (np.full(block.shape, np.nan) for _ in range(2))
    still, names = lies_still(block, level), [row.name for row in block.experiment.schemes]
    second = names.index(check.second) if check.second in names else found.scheme
    distance[found.scheme], allowed[found.scheme] = found.largest, found.allowed
    return {
        "distance": distance,
        "allowed": allowed,
        "motion": np.broadcast_to(still[found.scheme] & still[second], block.shape),
        "level": level,
        "distance_over_time": by_place(found.over_time, places(block)),
    }


def places(block: MemberBlock) -> int:
    """Return at how many places in time a distance is kept."""
    return min(PLACES, max(len(record["t"]) for record in block.records.values()))


def by_place(values: Floats, count: int) -> Floats:
    """Return the largest value around each of evenly spaced places from the first to the last time.

    Parameters
    ----------
    values
        Shape (case, t), evenly spaced; NaN is passed over.
    count
        Number of places.

    Returns
    -------
    array
        Shape (case, place); NaN where no time is nearest to a place.
    """
    last = values.shape[-1] - 1
    nearest = np.round(np.arange(last + 1) * ((count - 1) / max(last, 1))).astype(int)
    taken, first = np.unique(nearest, return_index=True)
    found = np.full((*values.shape[:-1], count), np.nan)
    found[..., taken] = np.fmax.reduceat(values, first, axis=-1)
    return found


def judge(experiment: Experiment, record: Record, check: EqualCheck, id_: str) -> Outcome:
    """Compare the largest distance between two solutions with what it may be."""
    distance, allowed = (measured(record, id_, field) for field in ("distance", "allowed"))
    still = measured(record, id_, "motion") != 0
    place = record.place("level", int(measured(record, id_, "level")))
    names = record.words("scheme")
    involved = [names.index(name) for name in check.equal if name in names]
    broken = np.any(record["status"][involved, :, place] != 0, axis=0)
    masks = [
        (np.broadcast_to(broken, distance.shape), NON_FINITE),
        (np.isnan(distance) | np.isnan(allowed), NOT_APPLICABLE),
        ((distance <= allowed) & still, NOT_APPLICABLE),
        (distance <= allowed, MATCH),
    ]
    reason = np.select([mask for mask, _ in masks], [code for _, code in masks], MISMATCH)
    # as a part of what is allowed, which differs from member to member
    with np.errstate(divide="ignore", invalid="ignore"):
        away = np.where(distance > 0, distance / allowed, distance)
    return by_reason(experiment, record, check, id_, FIELDS, reason, away)
