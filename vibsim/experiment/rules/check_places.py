"""Validate the schemes, members, levels and times that a check refers to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vibsim.core.errors import nearest
from vibsim.experiment.data import TimeSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.rules.setting import Setting
from vibsim.experiment.schema.checks import At, Members
from vibsim.experiment.sweep_columns import Column, grid_columns, matching, members_with
from vibsim.experiment.value_names import Value
from vibsim.experiment.yaml.parse import Path_

FEWEST_IN_A_PERIOD = 8  # fewest samples per period of a force for its harmonic


@dataclass(frozen=True)
class Scope:
    """A path in the file, the setting that a check there is validated against, and the report for its faults."""

    path: Path_
    setting: Setting
    report: Report

    def at(self, *keys: str | int) -> Scope:
        """Return the scope of a path inside this one.

        The keys of a row of a printed table that are under ``at`` get that prefix; callers use the names of checks.
        """
        inner = self.path[0] == "published" and keys[0] in ("t", "step", "event", "case")
        return replace(self, path=(*self.path, *(("at",) if inner else ()), *keys))

    @property
    def is_faulty(self) -> bool:
        """Whether the value at this path is malformed and was left out."""
        return self.path in self.report.faulty

    def refuse(
        self, rule: str, hint: str = "", value: object = None, *, at_key: bool = False
    ) -> None:
        """Report a fault at this path; see `vibsim.experiment.faults.Report.add`."""
        self.report.add(self.path, rule, hint, value, at_key)

    def check_scheme(self, name: str, more: tuple[str, ...] = ()) -> None:
        """Check that `name` is a scheme of the experiment; `more`: other valid words, for the hint."""
        known = self.setting.names
        if not known or name in known:
            return
        # if the list of schemes has an unknown kind, `name` may be its correct spelling
        kinds = self.report.kinds.names("schemes")
        if name not in kinds or all(other in kinds for other in known):
            self.refuse("not a scheme of this experiment", nearest(name, (*known, *more)), name)

    def check_schemes(self, names: Sequence[str] | None) -> None:
        """Check that a list names schemes of the experiment, each once."""
        for i, name in enumerate(names or ()):
            self.at(i).check_scheme(name)
            if name in (names or ())[:i]:
                self.at(i).refuse("a scheme must not be repeated", value=name)

    def check_scheme_and_case(self, at: At) -> None:
        """Check the keys that every value accepts."""
        if at.scheme is not None:
            self.at("scheme").check_scheme(at.scheme)
        self.at("case").check_case(at.case)
        self.check_members(at, at.case)

    def check_members(self, at: Members, case: int | None) -> None:
        """Check that some member has the given swept values (under `at`, or in a row of a printed table)."""
        setting, scope = self.setting, self.at("at") if self.path[0] == "published" else self
        if not at.swept or not setting.knows_sweep:
            return
        known = [*type(at).model_fields, *setting.sweep.keys]
        unknown = [key for key in at.swept if key not in setting.sweep.keys]
        for key in unknown:
            hint = nearest(key, known)
            if not known or ("." in key and not setting.sweep.keys):
                hint = "`at` names values of a sweep, and there is none"
            scope.at(key).refuse("unknown key", hint, _written(at.swept[key]), at_key=True)
        if case is not None and not unknown:
            first = scope.at(next(iter(at.swept)))
            first.refuse("must not be given together with case", at_key=True)
        for axis in setting.sweep.axes:
            wanted = {key: at.swept[key] for key in axis.keys if key in at.swept}
            columns = grid_columns([axis], 0, axis.count) if wanted else {}
            for key, value in wanted.items():
                if not matching(columns[key], value).any():
                    hint = _nearest_values(columns[key], value)
                    scope.at(key).refuse("not a value of the sweep", hint, _written(value))
                    break
            else:
                if wanted and not members_with(columns, wanted, axis.count).any():
                    last = list(wanted)[-1]
                    scope.at(last).refuse(f"no member has this together with {next(iter(wanted))}")

    def check_case(self, case: int | None) -> None:
        """Check that member `case` exists."""
        members = self.setting.members
        if case is not None and members is not None and case >= members:
            there = "there is 1 case" if members == 1 else f"there are {members} cases"
            self.refuse(f"must be at most {members - 1}", there)

    def check_level(self, level: int | None, instead: str = "leave it out") -> bool:
        """Tell whether `level` is None or a level of the experiment; `instead`: hint if levels follow a tolerance."""
        levels = self.setting.levels
        if level is None or (not self.setting.by_tolerance and (not levels or level in levels)):
            return True
        if self.setting.by_tolerance:
            self.refuse(f"a level {_NOT_YET}", instead, level)
            return False
        closest = min(levels, key=lambda known: abs(known - level))
        hint = f"nearest is {closest}; levels are {', '.join(map(str, levels))}"
        self.refuse("not a level of this experiment", hint, level)
        return False

    def check_place(self, at: At, row: Value) -> None:
        """Check that the value `row` exists at `at`."""
        setting = self.setting
        names = At.model_fields
        keys = [key for key in names if getattr(at, key) is not None or self.at(key).is_faulty]
        for name in keys:
            if name not in row.at:
                hint = "it takes " + ", ".join(row.at)
                self.at(name).refuse(f"{row.name} takes no {name}", hint, at_key=True)
        if row.needs_time and "t" not in keys and "step" not in keys:
            self.refuse(f"{row.name} needs t or step")
        if row.needs_force:
            self._check_force(row)
        if "event" in row.at and "event" not in keys:
            self.refuse(f"{row.name} needs the number of an event", "e.g. event: 1")
        if "t" in keys and "step" in keys:
            self.at("step").refuse("must not be given together with t", at_key=True)
        self.check_scheme_and_case(at)
        if at.scheme in setting.adaptive and (row.fixed_step or at.level == "best"):
            rule = f"{row.name} does not exist for a scheme that chooses its own steps"
            self.at("scheme").refuse(rule, value=at.scheme)
        level = self._level(at, row)
        if setting.by_tolerance and at.step is not None and "step" in row.at:
            self.at("step").refuse(f"a step {_NOT_YET}", "t can")
        if setting.time is None or not setting.knows_sweep:
            return
        level = level if "t" in row.at else None
        if at.step is not None and level is not None:
            self.at("step")._check_step(at.step, level)
        if at.t is not None and (level is not None or setting.by_tolerance):
            self.at("t")._check_time(at.t, setting.time, level)

    def _check_force(self, row: Value) -> None:
        """Check that the period of the force is known, and that enough samples per period are stored."""
        setting, time = self.setting, self.setting.time
        if time is None:
            return
        if time.frequency is None or time.periods is None:
            rule = "refers to the last period of a force, but time names no frequency"
            hint = "give time as periods, steps_per_period and frequency, e.g. model.omega"
            # `at` may be absent, so the fault is reported at `value`
            parent = self.path[:2] if self.path[0] == "published" else self.path[:-1]
            self.report.add((*parent, "value"), rule, hint, row.name)
        elif setting.levels and setting.knows_sweep:
            coarsest = setting.levels[0]
            kept = setting.steps(coarsest) // setting.stride(coarsest) / time.periods
            if kept < FEWEST_IN_A_PERIOD or kept % 1.0:
                wanted = f"at least {FEWEST_IN_A_PERIOD} stored samples in every period"
                hint = "give `samples: common`, and steps_per_period enough for the coarsest level"
                self.refuse(f"{row.name} needs {wanted}", f"there are {kept:.4g}: {hint}")

    def _level(self, at: At, row: Value) -> int | None:
        """Check the level, and return the one whose stored times apply: the finest by default, None if unknown."""
        by_tolerance, place = self.setting.by_tolerance, self.at("level")
        levels = () if by_tolerance else self.setting.levels
        if place.is_faulty or self.is_faulty:
            return None
        if at.level is None or "level" not in row.at:
            return levels[-1] if levels else None
        if at.level == "best":
            if not row.best and (levels or by_tolerance):
                place.refuse(f"{row.name} does not exist for the extrapolated solution")
            # the extrapolated solution has the times of the coarsest level
            return levels[0] if levels else None
        if not place.check_level(at.level, "level: best can") or not levels:
            return None
        finer = len(levels) - 1 - levels.index(at.level)
        if finer < row.finer_levels:
            word = "level" if row.finer_levels == 1 else "levels"
            there = "there is 1" if finer == 1 else f"there are {finer or 'none'}"
            rule = f"{row.name} needs {row.finer_levels} finer {word} beside it, {there}"
            place.refuse(rule, value=at.level)
        return at.level

    def _check_step(self, step: int, level: int) -> None:
        steps, every = self.setting.steps(level), self.setting.stride(level)
        if step > steps:
            self.refuse(f"must be at most {steps}, the steps of level {level}")
        elif step % every:
            low = step - step % every
            rule = f"not a stored step of level {level}, where every {every}th is stored"
            self.refuse(rule, f"nearest are {low} and {low + every}")

    def _check_time(self, t: float, time: TimeSpec, level: int | None) -> None:
        """Check that a time is within the run and, if `level` is known, that it is a stored sample time."""
        setting = self.setting
        fixed = setting.sweep.fixed_end(time)
        end = 1.0 if fixed is None else fixed
        if not 0.0 <= t <= end:
            word = "the fraction 1 of the end" if fixed is None else f"the end {end:g}"
            self.refuse(f"must be between 0 and {word}", value=t)
        elif level is not None:
            samples = setting.steps(level) // setting.stride(level)
            dt = end / samples
            if abs(t - min(round(t / dt), samples) * dt) > 1e-9 * dt:
                low = min(int(t / dt), samples - 1)
                hint = f"nearest are {low * dt:.12g} and {(low + 1) * dt:.12g}"
                self.refuse("not a stored sample time", hint, t)


def _written(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.12g}"


def _nearest_values(column: Column, value: float | str) -> str:
    """Name the values of a column next to a missing number, or the words most similar to a missing word."""
    known = np.unique(column)
    if isinstance(value, str) or known.dtype.kind == "U":
        return nearest(value, [str(word) for word in known])
    place = int(np.searchsorted(known, value))
    near = [f"{x:.12g}" for x in known[max(place - 1, 0) : place + 1]]
    return f"nearest {'is' if len(near) == 1 else 'are'} {' and '.join(near)}"


_NOT_YET = "cannot be named where tolerance chooses the levels"
