"""The check ``equal``: the distance of two solutions."""

from __future__ import annotations

import math

import numpy as np

from vibsim.checks.energy import lies_still
from vibsim.checks.fields import LEVEL, MOTION, Field, Measured
from vibsim.checks.number_units import unit_of_quantity
from vibsim.checks.outcome import Judged
from vibsim.checks.sentences import MOVE, NOT_FINITE, NOTHING_MOVES, Description, MemberFacts
from vibsim.comparison.quantity_comparison import Compared
from vibsim.comparison.solution_distance import solution_distance
from vibsim.convergence.reasons import first_reason
from vibsim.core.array_types import Floats
from vibsim.core.decimals import round_outward
from vibsim.core.record import Record
from vibsim.experiment import Experiment
from vibsim.experiment.schema.checks import SOLUTIONS, EqualCheck
from vibsim.observe.member_block import MemberBlock

FIELDS = {
    "distance": Field("largest distance of the two solutions", unit_of="quantity"),
    "allowed": Field("how far they may be apart", unit_of="quantity"),
    "motion": Field("whether anything moves in either", MOTION.type, MOTION.words),
    "level": LEVEL,
    "distance_over_time": Field(
        "largest distance around each of evenly spaced places in time",
        dims=("case", "place"),
        of_figure=True,
        unit_of="quantity",
    ),
}
"""Distances are NaN except for the first scheme of the check."""
PLACES = 241
"""Largest number of places in time of a distance, about the pixels of a figure."""


def measure(block: MemberBlock, compared: Compared, check: EqualCheck) -> Measured:
    """Return the measured fields of a check."""
    level = block.grid.levels[-1] if check.level is None else check.level
    distances = solution_distance(block, compared, check)
    distance, allowed = (np.full(block.shape, np.nan) for _ in range(2))
    at_rest, names = lies_still(block, level), [row.name for row in block.experiment.schemes]
    second = names.index(check.second) if check.second in names else distances.scheme
    distance[distances.scheme], allowed[distances.scheme] = distances.largest, distances.allowed
    places = min(PLACES, max(len(record["t"]) for record in block.records.values()))
    return {
        "distance": distance,
        "allowed": allowed,
        "motion": np.broadcast_to(at_rest[distances.scheme] & at_rest[second], block.shape),
        "level": level,
        "distance_over_time": by_place(distances.over_time, places),
    }


def by_place(values: Floats, count: int) -> Floats:
    """Return the largest value around each of evenly spaced places from the first to the last time.

    Parameters
    ----------
    values
        Shape (case, t), evenly spaced; NaN is ignored.
    count
        Number of places.

    Returns
    -------
    array
        Shape (case, place); NaN for a place that is nearest to no time.
    """
    last = values.shape[-1] - 1
    nearest = np.round(np.arange(last + 1) * ((count - 1) / max(last, 1))).astype(int)
    occupied, first = np.unique(nearest, return_index=True)
    result = np.full((*values.shape[:-1], count), np.nan)
    result[..., occupied] = np.fmax.reduceat(values, first, axis=-1)
    return result


def judge(experiment: Experiment, record: Record, check: EqualCheck, facts: Measured) -> Judged:
    """Compare the largest distance of two solutions with the allowed one."""
    distance, allowed, at_rest = facts["distance"], facts["allowed"], facts["motion"] != 0
    place = record.place("level", int(facts["level"]))
    names = record.words("scheme")
    involved = [names.index(name) for name in check.equal if name in names]
    broken = np.any(record["status"][involved, :, place] != 0, axis=0)
    cases = [
        (np.broadcast_to(broken, distance.shape), "non_finite"),
        (np.isnan(distance) | np.isnan(allowed), "not_applicable"),
        ((distance <= allowed) & at_rest, "not_applicable"),
        (distance <= allowed, "match"),
    ]
    reason = first_reason(cases, "mismatch")
    # relative to the allowed distance, which differs between members
    with np.errstate(divide="ignore", invalid="ignore"):
        away = np.where(distance > 0, distance / allowed, distance)
    return Judged(reason, away)


def other_solution(check: EqualCheck) -> str:
    """Name the solution that a scheme must equal."""
    known = {"exact": "the exact solution", "discrete": "the exact solution of its own steps"}
    return known.get(check.second, f"scheme {check.second}")


def describe(f: MemberFacts, check: EqualCheck) -> Description:
    """Say how far apart two solutions are, and what to change if that is too far."""
    what, other = f.notation.opening(f.notation.quantity(check.quantity)), other_solution(check)
    distance, allowed = f.fact("distance"), f.fact("allowed")
    both = f"{what} of scheme {check.first} and {other}"
    distance_text = f"at most {_size(f, check, distance)} apart"
    brief = f"{distance_text}; {_size(f, check, allowed)} is allowed"
    if distance == 0.0:
        brief = "identical in every digit"
    enough = f"above {round_outward(distance, 2):.2g} if that is close enough"
    match f.reason:
        case "match":
            sentence, advice = (
                f"{what} of scheme {check.first} equals {other}. They are {brief}.",
                "",
            )
        case "non_finite":
            sentence, advice = NOT_FINITE[0].format(what), NOT_FINITE[1]
        case "not_applicable" if distance <= allowed:
            sentence = f"{NOTHING_MOVES.format(what)}. A comparison with {other} shows nothing."
            advice = MOVE
        case "not_applicable" if math.isfinite(distance):
            sentence = (
                f"{both} are {distance_text}, but the round-off to compare with is not known here."
            )
            advice = f"Give `atol:`, {enough}."
        case "not_applicable":
            sentence = f"{what} and {other} cannot be compared here, or were not stored."
            advice = (
                "Name a scheme or a solution that exists here (`equal:`), or another `quantity:`."
            )
        case _:
            sentence = f"{what} of scheme {check.first} differs from {other}. They are {brief}."
            ways = " or the options of one of the `schemes:`,"
            if check.second in SOLUTIONS:
                ways = ", take a finer `level:`,"
            advice = f"Correct `equal:`{ways} or give `atol:` {enough}."
    return Description(sentence, advice, brief)


def _size(f: MemberFacts, check: EqualCheck, distance: float) -> str:
    """Write a distance with its unit."""
    return f"{f.notation.number(distance, 4)} {unit_of_quantity(f.record, check.quantity)}".rstrip()
