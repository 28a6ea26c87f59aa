"""Claims with another number: what each of them must no longer say.

A claim whose verdict no change of its number can turn says nothing. The numbers are judged anew from one simulation and
one analysis of its experiment, so that a mutant costs no run.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest

from vibsim import Verdict
from vibsim.analysis import analyse_records, verdicts
from vibsim.core.record import Record
from vibsim.experiment import Experiment
from vibsim.experiment.cost import PLAIN_WORK
from vibsim.simulation import simulate_record

PART = 0.25
"""By so much of itself a number is changed that a claim says must be met."""
FACTOR = 10.0
"""By so much a bound is made stricter."""
ROUND_OFF = 1e-9
"""Bounds below it are those of rounding errors, which nobody predicts to a factor of 10."""
BEYOND = 1e-6
"""By so much of itself a bound is moved to the other side of what was measured."""


def numbers_of(claim: Any) -> dict[str, float]:
    """Return the numbers that a claim is about, by the key of its check; none where it is about words alone."""
    keys = {"converges": ("order",), "value": ("equals", "below", "above"), "equal": ("atol",)}
    found = {key: getattr(claim.that, key) for key in keys.get(claim.that.kind, ())}
    return {key: number for key, number in found.items() if isinstance(number, float | int)}


def mutants(claim: Any, verdict: Verdict) -> Iterator[tuple[str, float]]:
    """Yield the key and another number, with each of which the claim must turn.

    A number to be met is changed by a part of itself, an order by 1, a bound by a factor; bounds that are 0 or of the
    size of rounding errors are moved beyond the worst number measured. A claim that is false because of its number
    turns with the one that was measured.
    """
    facts = [result.facts for result in verdict.results]
    measured = [row.get("value", row.get("distance")) for row in facts]
    known = [value for value in measured if value is not None and math.isfinite(value)]
    for key, number in numbers_of(claim).items():
        if key == "order":
            yield from _orders(claim, verdict, number)
        elif not claim.holds:
            yield key, _met(key, known)
        elif key == "equals":
            step = PART * abs(number) if number else 10.0 * claim.that.allowed or BEYOND
            yield from ((key, number - step), (key, number + step))
        elif key == "above":
            lowest = min(known)
            yield key, number * FACTOR if number > ROUND_OFF else lowest + BEYOND * abs(lowest)
        else:
            highest = max(known)
            if key == "atol" and highest == 0.0:
                continue  # equal to the last bit, which meets every tolerance
            yield key, number / FACTOR if number > ROUND_OFF else highest - BEYOND * abs(highest)


def _met(key: str, known: list[float]) -> float:
    """Return a number with which what was measured is as a claim says."""
    if key == "above":
        return min(known) - BEYOND * abs(min(known)) - BEYOND
    if key == "equals":
        return known[0]
    return max(known) + BEYOND * abs(max(known)) + BEYOND


def _orders(claim: Any, verdict: Verdict, order: float) -> Iterator[tuple[str, float]]:
    if claim.holds:
        yield from (("order", other) for other in (order - 1.0, order + 1.0) if other > 0)
        return
    found = {round(r.facts["order"]) for r in verdict.results if r.facts.get("order") is not None}
    if len(found) == 1:
        yield "order", float(found.pop())


def simulated(experiment: Experiment) -> dict[int, Record]:
    """Return all levels, which share their kernels here: what a level alone must pay back, all of them may."""
    work = experiment.members * sum(map(experiment.steps, experiment.levels))
    with pytest.MonkeyPatch.context() as patch:
        if work > PLAIN_WORK:
            patch.setattr("vibsim.engine.trajectories.PLAIN_WORK", 0)
        return {level: simulate_record(experiment, level) for level in experiment.levels}


def survivors(experiment: Experiment, levels: dict[int, Record]) -> list[str]:
    """Return the claims of an experiment that say the same with another number, and which number it is."""
    claims = tuple(c for c in experiment.checks if c.kind == "claim" and numbers_of(c))
    if not claims:
        return []
    before = {v.id: v for v in judged(experiment, claims, levels)}
    added, of = [], {}
    for check in claims:
        for key, number in mutants(check, before[check.id]):
            name = f"mutant_{len(added)}"
            that = check.that.model_copy(update={key: number})
            added.append(check.model_copy(update={"id": name, "that": that}))
            of[name] = f"{check.id} with {key}: {number:.6g}"
    after = judged(experiment, tuple(added), levels) if added else []
    return [of[v.id] for v in after if v.status == before[of[v.id].split()[0]].status]


def judged(
    experiment: Experiment, checks: tuple[Any, ...], levels: dict[int, Record]
) -> list[Verdict]:
    """Judge an experiment by these checks in place of its own, and without its printed tables."""
    other = experiment.model_copy(update={"checks": checks, "published": (), "tolerance": None})
    return verdicts(other, analyse_records(other, levels))
