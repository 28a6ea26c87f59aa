"""The levels of an experiment: from the two ways of writing them to a list that rises."""

from __future__ import annotations

from itertools import pairwise

from vibsim.experiment.faults import Report
from vibsim.experiment.schema.document import LevelRange
from vibsim.experiment.yaml.parse import Path_


def rising_levels(
    section: LevelRange | tuple[int, ...] | None, report: Report, path: Path_ = ("levels",)
) -> tuple[int, ...]:
    """Return the levels of a section, which stands at `path`; none where it is missing or faulty."""
    if isinstance(section, LevelRange):
        if section.from_ > section.to:
            report.add((*path, "to"), f"must be at least 'from', which is {section.from_}")
        return tuple(range(section.from_, section.to + 1))
    levels = section or ()
    falling = [i for i, (low, high) in enumerate(pairwise(levels), 1) if low >= high]
    for i in falling:
        is_same = levels[i] == levels[i - 1]
        word = "must not be repeated" if is_same else "must be in increasing order"
        report.add((*path, i), f"levels {word}", value=levels[i])
    return () if falling else levels
