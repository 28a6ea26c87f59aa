"""Random real ladders over every scheme and model: verdicts are not against what the scheme promises."""

from __future__ import annotations

import json
import time
from collections import Counter
from datetime import UTC, datetime

import numpy as np
import pytest
from random_ladders import contradictions, drawn_experiment

SECONDS = 37.5
"""CPU time of the slow test; the last experiment may take ten more."""
DECIDED = 0.3
"""Least part of verdicts that pass: ladders of which nothing is known test nothing."""


ACCIDENTS = 1
"""On so many of 50 experiments three levels may look like another order by accident: one ladder in 10 000 does."""


def judged(
    seed: int, numbers: range, seconds: float, accidents: int = 0
) -> tuple[Counter[str], list[str]]:
    """Judge random experiments until the time is over; return how often each status was given, and what was wrong."""
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    start = time.process_time()
    for number in numbers:
        found, outcomes = contradictions(drawn_experiment(np.random.default_rng([seed, number])))
        told = [
            f"seed {seed}, number {number}: {one.status} {one.reason} {one.order}, promised {one.promised}: "
            f"{json.dumps(one.content)}"
            for one in found
        ]
        wrong += ["\n".join(told)] * bool(told)
        assert len(wrong) <= accidents, "\n".join(wrong)
        for (status, _), count in outcomes.items():
            counts[status] += count
        if time.process_time() - start > seconds:
            break
    return counts, wrong


def test_some_random_ladders() -> None:
    """Of one experiment: 16 ladders, or 8 where one scheme alone can treat the model."""
    counts, _ = judged(7, range(1), 60.0)
    assert counts["PASS"] >= DECIDED * counts.total()


@pytest.mark.slow
def test_random_ladders_of_the_day() -> None:
    seed = datetime.now(UTC).date().toordinal()
    counts, wrong = judged(seed, range(1000), SECONDS, ACCIDENTS)
    print(seed, *wrong, sep="\n")
    assert counts["PASS"] >= DECIDED * counts.total(), seed
