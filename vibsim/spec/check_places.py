"""Where the value of a check is taken: the scheme, the member, the level and the time are those of the experiment."""

from __future__ import annotations

from dataclasses import dataclass

from vibsim.errors import nearest
from vibsim.models import Model
from vibsim.schemes import SCHEMES
from vibsim.spec.checks import At
from vibsim.spec.experiment import TimeSpec
from vibsim.spec.faults import Report
from vibsim.spec.limits import Shape
from vibsim.spec.source import Path_
from vibsim.spec.values import Value


@dataclass(frozen=True)
class Ladder:
    """What checks may name; None or empty where a section is faulty, and then nothing is said about it."""

    model: Model | None
    schemes: tuple[str, ...]
    shape: Shape
    time: TimeSpec | None
    end: float | None
    """The last time of every member, None where it varies; then `t` is a fraction."""
    by_tolerance: bool = False
    """Whether the levels are still to be chosen, so that none of them can be named."""


def is_faulty(path: Path_, report: Report) -> bool:
    """Tell whether the value at `path` is malformed and was left out."""
    return path in report.faulty


def known_scheme(name: str, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check that a scheme of the experiment is named."""
    # where a scheme of the list is itself unknown, its right name may be meant
    broken = any(known not in SCHEMES for known in ladder.schemes) and name in SCHEMES
    if ladder.schemes and name not in ladder.schemes and not broken:
        report.add(path, "not a scheme of this experiment", nearest(name, ladder.schemes), name)


def check_place(at: At, row: Value, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check that `row` is taken where it exists."""
    given = [
        name
        for name in At.model_fields
        if getattr(at, name) is not None or is_faulty((*path, name), report)
    ]
    for name in given:
        if name not in row.at:
            rule = f"{row.name} takes no {name}"
            report.add((*path, name), rule, "it takes " + ", ".join(row.at), at_key=True)
    if row.needs_time and "t" not in given and "step" not in given:
        report.add(path, f"{row.name} needs t or step")
    if "t" in given and "step" in given:
        report.add((*path, "step"), "must not be given together with t", at_key=True)
    check_anywhere(at, path, ladder, report)
    if ladder.by_tolerance:
        _before_levels(at, row, path, ladder, report)
        return
    level = _level(at, row, path, ladder, report)
    if level is not None and "t" in row.at:
        _sample(at, level, path, ladder, report)


def check_anywhere(at: At, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check what is the same for every value: the scheme and the case."""
    if at.scheme is not None:
        known_scheme(at.scheme, (*path, "scheme"), ladder, report)
    members = ladder.shape.members
    if at.case is not None and members is not None and at.case >= members:
        there = "there is 1 case" if members == 1 else f"there are {members} cases"
        report.add((*path, "case"), f"must be at most {members - 1}", there)


def _before_levels(at: At, row: Value, path: Path_, ladder: Ladder, report: Report) -> None:
    """Refuse what belongs to one level where a tolerance is to choose the levels."""
    rule = "cannot be named where tolerance chooses the levels"
    if at.level == "best":
        _best(row, path, report)
    elif at.level is not None and "level" in row.at:
        report.add((*path, "level"), f"a level {rule}", "level: best can", at.level)
    if at.step is not None and "step" in row.at:
        report.add((*path, "step"), f"a step {rule}", "t can")
    if at.t is not None and ladder.time is not None:
        _range(at.t, path, ladder, report)


def _best(row: Value, path: Path_, report: Report) -> None:
    if not row.best and "level" in row.at:
        rule = f"{row.name} does not exist of the extrapolated solution"
        report.add((*path, "level"), rule)


def _level(at: At, row: Value, path: Path_, ladder: Ladder, report: Report) -> int | None:
    """Check the level; return it where it is one of the ladder, the finest by default."""
    levels = ladder.shape.levels
    if is_faulty((*path, "level"), report) or is_faulty(path, report):
        return None
    if at.level is None or not levels or "level" not in row.at:
        return levels[-1] if levels else None
    place = (*path, "level")
    if at.level == "best":
        _best(row, path, report)
        # that solution has the times of the coarsest level
        return levels[0]
    if at.level not in levels:
        closest = min(levels, key=lambda level: abs(level - int(at.level or 0)))
        hint = f"nearest is {closest}; levels are {', '.join(map(str, levels))}"
        report.add(place, "not a level of this experiment", hint, at.level)
        return None
    finer = len(levels) - 1 - levels.index(at.level)
    if finer < row.finer_levels:
        word = "level" if row.finer_levels == 1 else "levels"
        there = "there is 1" if finer == 1 else f"there are {finer or 'none'}"
        rule = f"{row.name} needs {row.finer_levels} finer {word} beside it, {there}"
        report.add(place, rule, value=at.level)
    return at.level


def _sample(at: At, level: int, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check that a time or a step is among the samples of `level`."""
    steps = ladder.shape.steps(level)
    if steps is None or ladder.time is None:
        return
    every = ladder.shape.stride(level)
    if at.step is not None:
        if at.step > steps:
            report.add((*path, "step"), f"must be at most {steps}, the steps of level {level}")
        elif at.step % every:
            low = at.step - at.step % every
            rule = f"not a stored step of level {level}, where every {every}th is stored"
            report.add((*path, "step"), rule, f"nearest are {low} and {low + every}")
    if at.t is not None:
        _time(at.t, steps, every, path, ladder, report)


def _time(t: float, steps: int, every: int, path: Path_, ladder: Ladder, report: Report) -> None:
    if not _range(t, path, ladder, report):
        return
    end = 1.0 if ladder.end is None else ladder.end
    dt = end / (steps // every)
    index = min(round(t / dt), steps // every)
    if abs(t - index * dt) > 1e-9 * dt:
        low = min(int(t / dt), steps // every - 1)
        rule = "not a stored sample time"
        report.add((*path, "t"), rule, f"nearest are {low * dt:.12g} and {(low + 1) * dt:.12g}", t)


def _range(t: float, path: Path_, ladder: Ladder, report: Report) -> bool:
    """Check that a time lies in the interval."""
    end = 1.0 if ladder.end is None else ladder.end
    if 0.0 <= t <= end:
        return True
    word = "the fraction 1 of the end" if ladder.end is None else f"the end {end:g}"
    report.add((*path, "t"), f"must be between 0 and {word}", value=t)
    return False
