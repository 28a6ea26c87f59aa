"""Verdicts on random ladders with known truth, each judged by nine orders: of the pipeline and of the error model.

The pipeline knows the scheme: what it promises, and facts from outside the ladder. The bare error model reads the same
differences and the same predicted noise. ``python tests/analysis/counts.py SEED ...`` prints a line of both for every
seed; a seed takes some minutes.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from judged import ORDERS, findings
from synthetic import TOLERANCE, Group, groups
from synthetic import Ladder as Truth

from vibsim.comparison import order_verdict
from vibsim.convergence.assessment import assess
from vibsim.convergence.error_model.ladder import Ladder
from vibsim.convergence.question import Question
from vibsim.core.vocabulary import REASON_NAMES, REASONS

HEAD = """\
| seed | decided by | right PASS | false PASS | mixed PASS | false FAIL | decidable left open |
|---|---|---|---|---|---|---|"""


@dataclass
class Counts:
    """Verdicts by what is true of their ladders; what is exact is not counted."""

    judged: int = 0
    right: int = 0
    false_pass: int = 0
    mixed: int = 0
    false_fail: int = 0
    left_open: int = 0
    decidable: int = 0

    def add(self, truth: Truth, asked: float, status: str, reason: str) -> None:
        mine, mixed = abs(truth.order - asked) <= TOLERANCE, math.isnan(truth.order)
        self.judged += 1
        if status == "PASS" and reason != "exact":
            self.right += mine
            self.mixed += mixed
            self.false_pass += not mine and not mixed
        self.false_fail += mine and status == "FAIL"
        self.decidable += mine and truth.decidable
        self.left_open += mine and truth.decidable and status == "INCONCLUSIVE"

    def row(self) -> str:
        return (
            " | ".join(map(str, (self.right, self.false_pass, self.mixed, self.false_fail)))
            + f" | {self.left_open} of {self.decidable}"
        )


@dataclass
class Read:
    """What the pipeline reads of the quantity u: its series, and the noise that is predicted."""

    found: list[Any] = field(default_factory=list)


@contextmanager
def reading() -> Iterator[Read]:
    """Keep what the pipeline reads of u."""
    read, collect = Read(), order_verdict.facts_of

    def kept(q: Any, norm: str, order: Any, tolerance: float) -> Any:
        found = collect(q, norm, order, tolerance)
        if q.name == "u" and norm == "l2":
            read.found.append((q, found))
        return found

    with patch.object(order_verdict, "facts_of", kept):
        yield read


def ladder_of(group: Group, read: Read) -> Ladder:
    """Return the ladders of a group as the error model reads them, with the noise that the rules know of."""
    q, facts = read.found[0]
    rows = [d[0] for d in q.differences]
    if group.known:
        rows.append(-q.errors[-1][0])
    x = np.stack(rows, axis=1)
    gram = x @ np.swapaxes(x, 1, 2) * q.block.grid.spacing[0]
    h = 2.0 ** -np.array(group.levels)
    return Ladder(h, gram, facts.floor[0], facts.numbers[0], group.known)


def tally(seed: int, folder: Path, number: int = 42, size: int = 55) -> tuple[Counts, Counts]:
    """Return the counts of the pipeline and of the error model on the ladders of a seed."""
    by_pipeline, by_model = Counts(), Counts()
    for group in groups(seed, number, size):
        if len(group.levels) < 3:
            continue
        with reading() as read:
            judged = findings(group, folder)
        for one in judged:
            by_pipeline.add(one.ladder, one.formal, one.status, one.reason)
        ladder = ladder_of(group, read)
        for order in ORDERS:
            a = assess(ladder, Question(order))
            for truth, place in zip(group.ladders, a.reason, strict=True):
                reason = REASON_NAMES[place]
                by_model.add(truth, order, REASONS[reason], reason)
    return by_pipeline, by_model


def main() -> None:
    print(HEAD)
    for seed in map(int, sys.argv[1:]):
        with tempfile.TemporaryDirectory() as folder:
            pipeline, model = tally(seed, Path(folder))
        print(f"| {seed} | pipeline | {pipeline.row()} |")
        print(f"| | error model | {model.row()} |", flush=True)


if __name__ == "__main__":
    main()
