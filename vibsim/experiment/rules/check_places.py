"""Where a check looks: the schemes, the member, the level and the time that it names are those of the experiment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from vibsim.core.errors import nearest
from vibsim.experiment.data import SchemeSpec, TimeSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.rules.size_limits import Shape
from vibsim.experiment.schema.checks import At
from vibsim.experiment.value_names import Value
from vibsim.experiment.yaml.parse import Path_
from vibsim.models import Model
from vibsim.schemes import SCHEMES


@dataclass(frozen=True)
class Ladder:
    """What checks may name; None or empty where a section is faulty, and then nothing is said about it."""

    model: Model | None
    schemes: tuple[str, ...]
    """The names of the schemes as written, right or wrong."""
    shape: Shape
    time: TimeSpec | None
    end: float | None
    """The last time of every member, None where it varies; then `t` is a fraction."""
    by_tolerance: bool = False
    """Whether the levels are still to be chosen, so that none of them can be named."""
    sound: tuple[SchemeSpec, ...] = ()
    """The schemes without a fault."""
    is_whole: bool = True
    """Whether every scheme is known; where one is not, it may be of any kind."""

    @cached_property
    def adaptive(self) -> tuple[str, ...]:
        """Names of the schemes that choose their own steps."""
        return tuple(scheme.name for scheme in self.sound if scheme.adaptive)

    @cached_property
    def own(self) -> tuple[str, ...]:
        """Names of the schemes with another velocity than the centred difference."""
        return tuple(scheme.name for scheme in self.sound if scheme.own_velocity)

    @property
    def own_velocity(self) -> bool:
        """Whether some scheme has, or may have, another velocity than the centred difference."""
        return bool(self.own) or not self.is_whole


@dataclass(frozen=True)
class Scope:
    """A place in the file, what a check there may name, and where its faults are noted."""

    path: Path_
    ladder: Ladder
    report: Report

    def at(self, *keys: str | int) -> Scope:
        """Return the scope of a place inside of this one.

        In a row of a printed table some keys stand under ``at``, which checks do not have there.
        """
        inner = self.path[0] == "published" and keys[0] in ("t", "step", "case")
        path = (*self.path, *(("at",) if inner else ()), *keys)
        return Scope(path, self.ladder, self.report)

    @property
    def is_faulty(self) -> bool:
        """Whether the value here is malformed and was left out."""
        return self.path in self.report.faulty

    def refuse(
        self, rule: str, hint: str = "", value: object = None, *, at_key: bool = False
    ) -> None:
        """Note a fault here; see `vibsim.experiment.faults.Report.add`."""
        self.report.add(self.path, rule, hint, value, at_key)


def known_scheme(name: str, scope: Scope, more: tuple[str, ...] = ()) -> None:
    """Check that a scheme of the experiment is named; `more`: other words that were right there."""
    known = scope.ladder.schemes
    # where a scheme of the list is itself unknown, its right name may be meant
    broken = any(other not in SCHEMES for other in known) and name in SCHEMES
    if known and name not in known and not broken:
        scope.refuse("not a scheme of this experiment", nearest(name, (*known, *more)), name)


def known_schemes(names: Sequence[str] | None, scope: Scope) -> None:
    """Check a list of schemes, each of the experiment and named once."""
    for i, name in enumerate(names or ()):
        known_scheme(name, scope.at(i))
        if name in (names or ())[:i]:
            scope.at(i).refuse("a scheme must not be repeated", value=name)


def check_place(at: At, row: Value, scope: Scope) -> None:
    """Check that `row` is taken where it exists."""
    given = [
        name
        for name in At.model_fields
        if getattr(at, name) is not None or scope.at(name).is_faulty
    ]
    for name in given:
        if name not in row.at:
            hint = "it takes " + ", ".join(row.at)
            scope.at(name).refuse(f"{row.name} takes no {name}", hint, at_key=True)
    if row.needs_time and "t" not in given and "step" not in given:
        scope.refuse(f"{row.name} needs t or step")
    if "t" in given and "step" in given:
        scope.at("step").refuse("must not be given together with t", at_key=True)
    check_scheme_and_case(at, scope)
    if at.scheme in scope.ladder.adaptive and (row.fixed_step or at.level == "best"):
        rule = f"{row.name} does not exist of a scheme that chooses its own steps"
        scope.at("scheme").refuse(rule, value=at.scheme)
    if scope.ladder.by_tolerance:
        _before_levels(at, row, scope)
        return
    level = _level(at, row, scope)
    if level is not None and "t" in row.at:
        _sample(at, level, scope)


def check_scheme_and_case(at: At, scope: Scope) -> None:
    """Check what is the same for every value."""
    if at.scheme is not None:
        known_scheme(at.scheme, scope.at("scheme"))
    check_case(at.case, scope.at("case"))


def check_case(case: int | None, scope: Scope) -> None:
    """Check that there is a member."""
    members = scope.ladder.shape.members
    if case is not None and members is not None and case >= members:
        there = "there is 1 case" if members == 1 else f"there are {members} cases"
        scope.refuse(f"must be at most {members - 1}", there)


def check_level(level: int | None, scope: Scope) -> None:
    """Check the level of a check that has one beside its other keys."""
    levels = scope.ladder.shape.levels
    if level is None:
        return
    if scope.ladder.by_tolerance:
        scope.refuse(f"a level {_NOT_YET}", "leave it out", level)
    elif levels and level not in levels:
        _unknown_level(level, scope)


def _unknown_level(level: int, scope: Scope) -> None:
    levels = scope.ladder.shape.levels
    closest = min(levels, key=lambda known: abs(known - level))
    hint = f"nearest is {closest}; levels are {', '.join(map(str, levels))}"
    scope.refuse("not a level of this experiment", hint, level)


_NOT_YET = "cannot be named where tolerance chooses the levels"


def _before_levels(at: At, row: Value, scope: Scope) -> None:
    """Refuse what belongs to one level where a tolerance is to choose the levels."""
    if at.level == "best":
        _best(row, scope)
    elif at.level is not None and "level" in row.at:
        scope.at("level").refuse(f"a level {_NOT_YET}", "level: best can", at.level)
    if at.step is not None and "step" in row.at:
        scope.at("step").refuse(f"a step {_NOT_YET}", "t can")
    if at.t is not None and scope.ladder.time is not None:
        _in_interval(at.t, scope.at("t"))


def _best(row: Value, scope: Scope) -> None:
    if not row.best and "level" in row.at:
        scope.at("level").refuse(f"{row.name} does not exist of the extrapolated solution")


def _level(at: At, row: Value, scope: Scope) -> int | None:
    """Check the level; return it where it is one of the ladder, the finest by default."""
    levels = scope.ladder.shape.levels
    if scope.at("level").is_faulty or scope.is_faulty:
        return None
    if at.level is None or not levels or "level" not in row.at:
        return levels[-1] if levels else None
    if at.level == "best":
        _best(row, scope)
        # that solution has the times of the coarsest level
        return levels[0]
    if at.level not in levels:
        _unknown_level(int(at.level), scope.at("level"))
        return None
    finer = len(levels) - 1 - levels.index(at.level)
    if finer < row.finer_levels:
        word = "level" if row.finer_levels == 1 else "levels"
        there = "there is 1" if finer == 1 else f"there are {finer or 'none'}"
        rule = f"{row.name} needs {row.finer_levels} finer {word} beside it, {there}"
        scope.at("level").refuse(rule, value=at.level)
    return at.level


def _sample(at: At, level: int, scope: Scope) -> None:
    """Check that a time or a step is among the samples of `level`."""
    shape = scope.ladder.shape
    steps = shape.steps(level)
    if steps is None or scope.ladder.time is None:
        return
    every = shape.stride(level)
    if at.step is not None and at.step > steps:
        scope.at("step").refuse(f"must be at most {steps}, the steps of level {level}")
    elif at.step is not None and at.step % every:
        low = at.step - at.step % every
        rule = f"not a stored step of level {level}, where every {every}th is stored"
        scope.at("step").refuse(rule, f"nearest are {low} and {low + every}")
    if at.t is not None and _in_interval(at.t, scope.at("t")):
        _stored_time(at.t, steps // every, scope.at("t"))


def _stored_time(t: float, samples: int, scope: Scope) -> None:
    """Check that a time is one of so many equal parts of the interval."""
    end = 1.0 if scope.ladder.end is None else scope.ladder.end
    dt = end / samples
    index = min(round(t / dt), samples)
    if abs(t - index * dt) > 1e-9 * dt:
        low = min(int(t / dt), samples - 1)
        hint = f"nearest are {low * dt:.12g} and {(low + 1) * dt:.12g}"
        scope.refuse("not a stored sample time", hint, t)


def _in_interval(t: float, scope: Scope) -> bool:
    end = 1.0 if scope.ladder.end is None else scope.ladder.end
    if 0.0 <= t <= end:
        return True
    word = "the fraction 1 of the end" if scope.ladder.end is None else f"the end {end:g}"
    scope.refuse(f"must be between 0 and {word}", value=t)
    return False
