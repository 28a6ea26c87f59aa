"""Where the value of a check is taken: the scheme, the member, the level and the time are those of the experiment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from vibsim.errors import nearest
from vibsim.models import Model
from vibsim.schemes import SCHEMES
from vibsim.spec.checks import At
from vibsim.spec.experiment import SchemeSpec, TimeSpec
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
    adaptive: tuple[str, ...] = ()
    """Of the schemes, those that choose their own steps."""
    own: tuple[str, ...] = ()
    """Of the schemes, those with another velocity than the centred difference."""
    is_whole: bool = True
    """Whether every scheme is known; where one is not, it may be of any kind."""

    @property
    def own_velocity(self) -> bool:
        """Whether some scheme has, or may have, another velocity than the centred difference."""
        return bool(self.own) or not self.is_whole


def kinds_of(schemes: Sequence[SchemeSpec]) -> dict[str, Any]:
    """Return what a `Ladder` holds of the schemes."""
    return {
        "schemes": tuple(scheme.name for scheme in schemes),
        "adaptive": tuple(scheme.name for scheme in schemes if scheme.adaptive),
        "own": tuple(scheme.name for scheme in schemes if scheme.own_velocity),
    }


def is_faulty(path: Path_, report: Report) -> bool:
    """Tell whether the value at `path` is malformed and was left out."""
    return path in report.faulty


def part(path: Path_, name: str) -> Path_:
    """Return where the part `name` of a place stands; in a row of a printed table some stand under ``at``."""
    inner = path[0] == "published" and name in ("t", "step", "case")
    return (*path, "at", name) if inner else (*path, name)


def known_scheme(
    name: str, path: Path_, ladder: Ladder, report: Report, more: tuple[str, ...] = ()
) -> None:
    """Check that a scheme of the experiment is named; `more`: other words that were right there."""
    # where a scheme of the list is itself unknown, its right name may be meant
    broken = any(known not in SCHEMES for known in ladder.schemes) and name in SCHEMES
    if ladder.schemes and name not in ladder.schemes and not broken:
        hint = nearest(name, (*ladder.schemes, *more))
        report.add(path, "not a scheme of this experiment", hint, name)


def known_schemes(names: Sequence[str] | None, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check a list of schemes, each of the experiment and named once."""
    for i, name in enumerate(names or ()):
        known_scheme(name, (*path, "schemes", i), ladder, report)
        if name in (names or ())[:i]:
            report.add((*path, "schemes", i), "a scheme must not be repeated", value=name)


def check_place(at: At, row: Value, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check that `row` is taken where it exists."""
    given = [
        name
        for name in At.model_fields
        if getattr(at, name) is not None or is_faulty(part(path, name), report)
    ]
    for name in given:
        if name not in row.at:
            rule = f"{row.name} takes no {name}"
            report.add(part(path, name), rule, "it takes " + ", ".join(row.at), at_key=True)
    if row.needs_time and "t" not in given and "step" not in given:
        report.add(path, f"{row.name} needs t or step")
    if "t" in given and "step" in given:
        report.add(part(path, "step"), "must not be given together with t", at_key=True)
    check_anywhere(at, path, ladder, report)
    if at.scheme in ladder.adaptive and (row.fixed_step or at.level == "best"):
        rule = f"{row.name} does not exist of a scheme that chooses its own steps"
        report.add((*path, "scheme"), rule, value=at.scheme)
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
    check_case(at.case, part(path, "case"), ladder, report)


def check_case(case: int | None, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check that there is a member."""
    members = ladder.shape.members
    if case is not None and members is not None and case >= members:
        there = "there is 1 case" if members == 1 else f"there are {members} cases"
        report.add(path, f"must be at most {members - 1}", there)


def check_level(level: int | None, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check the level of a check that has one beside its other keys."""
    levels = ladder.shape.levels
    if level is None:
        return
    if ladder.by_tolerance:
        report.add((*path, "level"), f"a level {_NOT_YET}", "leave it out", level)
    elif levels and level not in levels:
        _unknown_level(level, levels, (*path, "level"), report)


def _unknown_level(level: int, levels: tuple[int, ...], place: Path_, report: Report) -> None:
    closest = min(levels, key=lambda known: abs(known - level))
    hint = f"nearest is {closest}; levels are {', '.join(map(str, levels))}"
    report.add(place, "not a level of this experiment", hint, level)


_NOT_YET = "cannot be named where tolerance chooses the levels"


def _before_levels(at: At, row: Value, path: Path_, ladder: Ladder, report: Report) -> None:
    """Refuse what belongs to one level where a tolerance is to choose the levels."""
    if at.level == "best":
        _best(row, path, report)
    elif at.level is not None and "level" in row.at:
        report.add((*path, "level"), f"a level {_NOT_YET}", "level: best can", at.level)
    if at.step is not None and "step" in row.at:
        report.add(part(path, "step"), f"a step {_NOT_YET}", "t can")
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
        _unknown_level(int(at.level), levels, place, report)
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
            rule = f"must be at most {steps}, the steps of level {level}"
            report.add(part(path, "step"), rule)
        elif at.step % every:
            low = at.step - at.step % every
            rule = f"not a stored step of level {level}, where every {every}th is stored"
            report.add(part(path, "step"), rule, f"nearest are {low} and {low + every}")
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
        hint = f"nearest are {low * dt:.12g} and {(low + 1) * dt:.12g}"
        report.add(part(path, "t"), rule, hint, t)


def _range(t: float, path: Path_, ladder: Ladder, report: Report) -> bool:
    """Check that a time lies in the interval."""
    end = 1.0 if ladder.end is None else ladder.end
    if 0.0 <= t <= end:
        return True
    word = "the fraction 1 of the end" if ladder.end is None else f"the end {end:g}"
    report.add(part(path, "t"), f"must be between 0 and {word}", value=t)
    return False
