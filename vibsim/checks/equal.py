"""The check ``equal``: how far two solutions are from each other."""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import Decimal
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.checks.fields import Field, facts, measured
from vibsim.checks.of_schemes import (
    MATCH,
    MISMATCH,
    MOTIONS,
    MOVE,
    NON_FINITE,
    NOT_APPLICABLE,
    NOTHING_MOVES,
    by_reason,
    level_of,
    lies_still,
    place_of,
)
from vibsim.checks.outcome import Outcome
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.comparison.solution_distance import apart
from vibsim.core.record import Record
from vibsim.core.vocabulary import REASON_NAMES
from vibsim.experiment.schema.checks import SOLUTIONS
from vibsim.observe.member_block import Part

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


def measure(part: Part, compared: Mapping[str, Comparison], check: EqualCheck) -> Mapping[str, Any]:
    """Return what a check measures."""
    level = level_of(part, check)
    found = apart(part, compared, check)
    distance, allowed = (np.full(part.shape, np.nan) for _ in range(2))
    still, names = lies_still(part, level), [row.name for row in part.experiment.schemes]
    second = names.index(check.second) if check.second in names else found.scheme
    distance[found.scheme], allowed[found.scheme] = found.largest, found.allowed
    return {
        "distance": distance,
        "allowed": allowed,
        "motion": np.broadcast_to(still[found.scheme] & still[second], part.shape),
        "level": level,
        "distance_over_time": by_place(found.over_time, places(part)),
    }


def places(part: Part) -> int:
    """Return at how many places in time a distance is kept."""
    return min(PLACES, max(len(record["t"]) for record in part.records.values()))


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
    place = place_of(record, int(measured(record, id_, "level")))
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
    other = {"exact": "the exact solution", "discrete": "the exact solution of its own steps"}
    second = other.get(check.second, f"scheme {check.second}")

    def is_still(scheme: int, case: int) -> bool:
        return bool(
            reason[scheme, case] == NOT_APPLICABLE
            and distance[scheme, case] <= allowed[scheme, case]
        )

    def tell(scheme: int, case: int) -> str:
        if is_still(scheme, case):
            return f"{NOTHING_MOVES.format(check.quantity)}, and {second} shows no difference."
        if reason[scheme, case] == NON_FINITE:
            return f"{check.quantity} means nothing here: the calculation met a number that is not finite."
        if reason[scheme, case] == NOT_APPLICABLE and np.isfinite(distance[scheme, case]):
            return (
                f"{check.quantity} of scheme {check.first} and {second} are at most "
                f"{distance[scheme, case]:.4g} apart; what rounding may make of that is not known here."
            )
        if reason[scheme, case] == NOT_APPLICABLE:
            return f"{check.quantity} and {second} cannot be compared here, or were not stored."
        verb = "equals" if reason[scheme, case] == MATCH else "differs from"
        return (
            f"{check.quantity} of scheme {check.first} {verb} {second}: they are at most "
            f"{distance[scheme, case]:.4g} apart; {allowed[scheme, case]:.4g} is allowed."
        )

    def advise(scheme: int, case: int) -> str:
        if is_still(scheme, case):
            return MOVE
        word = REASON_NAMES[int(reason[scheme, case])]
        return _advise(word, check, float(distance[scheme, case]))

    words = f"equal to {second}"
    return by_reason(
        experiment,
        record,
        check,
        facts(record, id_, FIELDS),
        reason,
        distance,
        words,
        tell,
        away,
        advise,
    )


def _advise(reason: str, check: EqualCheck, distance: float) -> str:
    """Say what to change where two solutions are not as near to each other as a check expects."""
    if reason == "not_applicable" and math.isfinite(distance):
        return f"Give `atol:`, above {_above(distance)} if so much is right."
    if reason == "not_applicable":
        return "Name in `equal:` a scheme or a solution that exists here, or another `quantity:`."
    loose = f"give `atol:` above {_above(distance)} if so much is right"
    if check.second in SOLUTIONS:
        return f"Correct what `equal:` names, take a finer `level:`, or {loose}."
    return f"Correct what `equal:` names or the options of one of the `schemes:`, or {loose}."


def _above(distance: float) -> str:
    """Write a number with two digits that is no smaller than a distance: one that is asked for must suffice."""
    if not 0.0 < distance < math.inf:
        return f"{distance:.2g}"
    near = Decimal(f"{distance:.1e}")
    unit = Decimal(1).scaleb(near.adjusted() - 1)
    return f"{float(near if near >= Decimal(distance) else near + unit):.2g}"
