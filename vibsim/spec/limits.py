"""What no experiment may exceed, found from counts alone: nothing is written out or allocated to find it."""

from __future__ import annotations

from dataclasses import dataclass

from vibsim.spec.faults import Report
from vibsim.spec.sampling import stride

MAX_MEMBERS = 10**7
MAX_MEMBER_STEPS = 2**40
"""Steps of every scheme, member and level together: about a day of one core."""
MAX_BYTES = 8 * 2**30
"""Samples of one level in memory."""


MIN_DT = 1e-100
"""Smallest time step: its square and what is divided by that must not leave the range of floats."""


@dataclass(frozen=True)
class Shape:
    """The counts of an experiment; None or empty where a section is faulty."""

    base_steps: int | None
    levels: tuple[int, ...]
    schemes: int
    members: int | None
    samples: int | str
    variables: int
    end: float | None

    def steps(self, level: int) -> int | None:
        """Return the number of steps at `level`."""
        return None if self.base_steps is None else self.base_steps * 2**level

    def stride(self, level: int) -> int:
        """Return n where every n-th step of `level` is stored; levels and steps must be known."""
        steps = self.steps(level) or 1
        coarsest = self.steps(self.levels[0]) or 1
        return stride(self.samples, coarsest, steps, self.schemes * (self.members or 1))


def check(shape: Shape, report: Report) -> None:
    """Note every limit that `shape` exceeds."""
    members = shape.members or 1
    if members > MAX_MEMBERS:
        rule = f"must not have more than {MAX_MEMBERS} members, has {members}"
        report.add(("sweep",), rule, at_key=True)
    if shape.base_steps is None or not shape.levels:
        return
    coarsest = shape.base_steps * 2 ** shape.levels[0]
    if coarsest < 2:
        rule = f"the coarsest level must have at least 2 steps, has {coarsest}"
        report.add(("levels",), rule, "begin at a higher level, or give more base_steps")
    if isinstance(shape.samples, int) and coarsest % shape.samples:
        rule = f"must divide the {coarsest} steps of the coarsest level"
        report.add(("samples", "every"), rule, value=shape.samples)
    finest = shape.base_steps << shape.levels[-1]
    if shape.end is not None and shape.end / min(finest, MAX_MEMBER_STEPS) < MIN_DT:
        report.add(("time",), f"the time step must not be less than {MIN_DT:g}", at_key=True)
    _check_steps(shape, shape.base_steps, members, report)
    _check_memory(shape, coarsest, members, report)


def _check_steps(shape: Shape, base_steps: int, members: int, report: Report) -> None:
    steps = base_steps * sum(2**level for level in shape.levels)
    total = steps * members * max(shape.schemes, 1)
    if total > MAX_MEMBER_STEPS:
        rule = f"the experiment must not take more than {MAX_MEMBER_STEPS} steps, it takes {total}"
        report.add(("levels",), rule, "steps of every level, scheme and member together")


def _check_memory(shape: Shape, coarsest: int, members: int, report: Report) -> None:
    """Refuse samples that cannot be held; a scheme and member counts as at least 8 series."""
    trajectories = max(shape.schemes, 1) * members
    finest = coarsest * 2 ** (shape.levels[-1] - shape.levels[0])
    every = stride(shape.samples, coarsest, finest, trajectories)
    size = 8 * trajectories * (finest // every + 1) * max(shape.variables, 8)
    if size > MAX_BYTES:
        rule = f"the samples of a level must not take more than {MAX_BYTES} bytes, they take {size}"
        report.add(("levels",), rule, "store fewer samples, or begin at a lower level", at_key=True)
