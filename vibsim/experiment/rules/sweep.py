"""The section ``sweep``: what may vary, within which bounds, counted before anything is written out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic_core import PydanticCustomError

from vibsim.core.errors import nearest
from vibsim.experiment.data import SchemeSpec, TimeSpec, end_varies
from vibsim.experiment.faults import Report
from vibsim.experiment.schema.fields import TABLE, number
from vibsim.experiment.schema.sweep import (
    FLAGS,
    Axis,
    Draw,
    Linspace,
    Logspace,
    Range,
    Rule,
    Sample,
    Values,
    Written,
    count_of,
)
from vibsim.experiment.yaml.parse import Path_
from vibsim.models import Model
from vibsim.schemes import SCHEMES, NumberOption, Option

MAX_HYPERCUBE = 10**6
"""Points of a latin hypercube: none of them is known before all are drawn."""
MAX_RANGE = 2.0**53
"""Values of a range, at most: beyond it, their numbers are no floats."""
_STEPS = "step counts cannot be swept: every member has the same steps"
_LEVELS = "levels cannot be swept: they are what is compared"
_FIXED = {
    f"time.{name}": _STEPS for name in ("base_steps", "base_dt", "steps_per_period", "periods")
}


@dataclass(frozen=True)
class SweepAxes:
    """The sweep of an experiment, or what of it is sound."""

    axes: tuple[Axis, ...] = ()
    is_whole: bool = True
    """Whether nothing is left out because of a fault."""

    @property
    def members(self) -> int | None:
        """Number of members, 1 without a sweep; None where it cannot be told."""
        return math.prod(axis.count for axis in self.axes) if self.is_whole else None

    def least_end(self, time: TimeSpec) -> float:
        """Return the earliest end of a member, as far as the sweep gives it."""
        return min(
            (float(low) for key, low, _ in self._spans() if key == "time.end"), default=time.end
        )

    def fixed_end(self, time: TimeSpec) -> float | None:
        """Return the end that every member has, None where the end varies."""
        swept = ((key, low != high) for key, low, high in self._spans())
        return None if end_varies(swept, time.periods is not None) else self.least_end(time)

    def _spans(self) -> Iterator[tuple[str, float | str, float | str]]:
        for axis in self.axes:
            yield from ((key, *span) for key, span in zip(axis.keys, axis.spans, strict=True))


@dataclass(frozen=True)
class Target:
    """What a key of the sweep stands for, and which values it takes."""

    least: float = -math.inf
    most: float = math.inf
    exclusive: bool = False
    """Whether the least value itself is refused."""
    choices: tuple[str, ...] = ()
    """The words of an option; empty where it takes numbers."""
    is_flag: bool = False
    """Whether it takes true and false."""


def targets(model: Model | None, schemes: Sequence[SchemeSpec]) -> dict[str, Target]:
    """Return everything that can be swept, by dotted key."""
    found: dict[str, Target] = {}
    if model is not None:
        for state in model.states if model.start is None else ():
            least = -math.inf if state.minimum is None else state.minimum
            found[f"initial.{state.name}"] = Target(least)
        for row in model.parameters:
            least = -math.inf if row.minimum is None else row.minimum
            most = math.inf if row.maximum is None else row.maximum
            found[f"model.{row.key}"] = Target(least, most, exclusive=row.exclusive)
    found["time.end"] = Target(least=0.0, exclusive=True)
    for scheme in schemes:
        for option in SCHEMES[scheme.kind].options_on(model):
            target = Target(is_flag=True)
            if isinstance(option, Option):
                target = Target(choices=option.choices)
            elif isinstance(option, NumberOption):
                target = Target(option.least, option.most)
            found[f"schemes.{scheme.name}.{option.name}"] = target
    return found


def _table_keys(model: Model) -> set[str]:
    """Name every formula that may be a table, and the keys of that, by dotted key."""
    tables = ((f"model.{row.name}", row.table) for row in model.formulas if row.table)
    return {key for name, row in tables for key in (name, *(f"{name}.{k}" for k in (TABLE, *row)))}


def read_sweep(
    document: Any,
    order: Sequence[str],
    model: Model | None,
    schemes: Sequence[SchemeSpec],
    lacks_scheme: bool,
    report: Report,
) -> SweepAxes:
    """Check the sweep of a document.

    Parameters
    ----------
    order
        Its keys as the file has them.
    lacks_scheme
        Whether a scheme is at fault, so that nothing is said about options of unknown schemes.
    """
    reader = _SweepReader(document.time, model, targets(model, schemes), lacks_scheme, report)
    section = document.sweep
    found: list[Axis | None] = []
    for key in order:
        if key == "zip" and section.zip is not None:
            found.append(reader.zipped(section.zip))
        elif key == "sample" and section.sample is not None:
            found.append(reader.scattered(section.sample))
        elif key in section.single:
            values = reader.values(key, section.single[key], ("sweep", key))
            found.append(None if values is None else _axis((key,), (values,)))
    sound = tuple(axis for axis in found if axis is not None)
    return SweepAxes(sound, len(sound) == len(found))


def _axis(keys: tuple[str, ...], values: tuple[Values, ...] | Draw) -> Axis:
    # every number is checked already, and there may be many
    return Axis.model_construct(keys=keys, values=values)


class _SweepReader:
    """Turns what is written of each key into values that its target takes; None stands for those with a fault."""

    def __init__(
        self,
        time: Any,
        model: Model | None,
        targets: Mapping[str, Target],
        lacks_scheme: bool,
        report: Report,
    ) -> None:
        self.time, self.model, self.targets = time, model, targets
        self.lacks_scheme, self.report = lacks_scheme, report
        self.first: dict[str, Path_] = {}
        """Where each key is swept first."""

    def zipped(self, section: Mapping[str, Written]) -> Axis | None:
        """Return keys that move together."""
        rows = {key: self.values(key, row, ("sweep", "zip", key)) for key, row in section.items()}
        values = {key: row for key, row in rows.items() if row is not None}
        counts = {key: count_of(row) for key, row in values.items()}
        first = next(iter(counts), "")
        for key, count in counts.items():
            if count != counts[first]:
                rule = f"must have as many values as {first}, {counts[first]}, has {count}"
                self.report.add(("sweep", "zip", key), rule, at_key=True)
        is_sound = len(values) == len(rows) and len(set(counts.values())) == 1
        return _axis(tuple(values), tuple(values.values())) if is_sound else None

    def scattered(self, section: Sample) -> Axis | None:
        """Return points over several keys."""
        sound = [self._is_interval(key, *ends) for key, ends in section.over.items()]
        if section.method == "latin_hypercube" and section.n > MAX_HYPERCUBE:
            rule = (
                f"must be at most {MAX_HYPERCUBE} for a latin hypercube, which is drawn as a whole"
            )
            hint = "sobol and random have no such limit"
            self.report.add(("sweep", "sample", "n"), rule, hint, section.n)
            return None
        if not all(sound):
            return None
        bounds = tuple(section.over.values())
        draw = Draw(method=section.method, n=section.n, seed=section.seed, over=bounds)
        return _axis(tuple(section.over), draw)

    def _is_interval(self, key: str, low: float, high: float) -> bool:
        path: Path_ = ("sweep", "sample", "over", key)
        target = self._target(key, path)
        if target is None:
            return False
        if target.choices or target.is_flag:
            what = "words" if target.choices else "true and false"
            rule = f"takes {what}, which cannot be drawn"
            self.report.add(path, rule, "sweep it by a list outside sample", at_key=True)
            return False
        if low >= high:
            rule = f"must be greater than the least value, {low:g}"
            self.report.add((*path, 1), rule, value=high)
            return False
        return self._has_difference(low, high, path) and self._is_within((low, high), target, path)

    def values(self, key: str, written: Written, path: Path_) -> Values | None:
        """Return the values of one key."""
        target = self._target(key, path)
        if target is None:
            return None
        if target.choices:
            return self._words(written, target.choices, path)
        if target.is_flag:
            return self._flags(written, path)
        if isinstance(written, tuple):
            numbers = self._numbers(written, path)
            is_sound = numbers is not None and self._is_within(numbers, target, path)
            return numbers if is_sound else None
        path = (*path, next(iter(type(written).model_fields)))
        is_sound = self._gives_values(written, path) and self._is_within(written.ends, target, path)
        return written if is_sound else None

    def _target(self, key: str, path: Path_) -> Target | None:
        """Return what `key` at `path` stands for; None, and a fault, where it cannot be swept."""
        first = self.first.setdefault(key, path)
        model, time, target = self.model, self.time, self.targets.get(key)
        rule = hint = ""
        if first != path:
            rule = f"is swept twice, first {f'in {first[1]}' if len(first) > 2 else 'on its own'}"
        elif key in _FIXED or key.split(".")[0] == "levels":
            rule = _FIXED.get(key, _LEVELS)
        elif key == "time.end" and time is not None and (time.end is None or time.base_dt):
            rule = "the end can be swept only where time has an end, and base_steps if anything"
        elif target is None and model is not None and key in _table_keys(model):
            rule = "cannot be swept: every member has the same formula, or the same table"
            example = next(key for key in self.targets if key.startswith("model."))
            hint = f"sweep a parameter, such as {example}"
        elif target is None:
            if model is not None and not (self.lacks_scheme and key.startswith("schemes.")):
                alike = [name for name in self.targets if name.lower() == key.lower()]
                rule, hint = "cannot be swept", nearest(key, alike or list(self.targets))
        else:
            return target
        if rule:
            self.report.add(path, rule, hint, at_key=True)
        return None

    def _words(
        self, written: Written, choices: tuple[str, ...], path: Path_
    ) -> tuple[str, ...] | None:
        """Return the words of an option."""
        if not isinstance(written, tuple):
            self.report.add(path, "must be a list of words", "choose from " + ", ".join(choices))
            return None
        words = [word for word in written if isinstance(word, str) and word in choices]
        for i, word in enumerate(written):
            if not isinstance(word, str) or word not in choices:
                hint = nearest(str(word), choices)
                self.report.add((*path, i), "unknown choice", hint, word)
        return tuple(words) if len(words) == len(written) else None

    def _flags(self, written: Written, path: Path_) -> tuple[str, ...] | None:
        """Return flags as words (`FLAGS`)."""
        if not isinstance(written, tuple):
            self.report.add(path, "must be a list of true and false")
            return None
        for i, value in enumerate(written):
            if not isinstance(value, bool):
                self.report.add((*path, i), "must be true or false", value=value)
        found = tuple(FLAGS[value] for value in written if isinstance(value, bool))
        return found if len(found) == len(written) else None

    def _numbers(
        self, written: tuple[bool | float | str, ...], path: Path_
    ) -> tuple[float, ...] | None:
        """Return a list of numbers, some of them written as formulas."""
        found: list[float] = []
        for i, value in enumerate(written):
            try:
                found.append(value if isinstance(value, float) else number(value))
            except PydanticCustomError as error:
                hint = (error.context or {}).get("hint", "")
                self.report.add((*path, i), error.message(), hint, value)
        return tuple(found) if len(found) == len(written) else None

    def _gives_values(self, rule: Rule, path: Path_) -> bool:
        """Check that a rule gives values."""
        if isinstance(rule, Range):
            return self._leads(*rule.range, path)
        low, high, count = rule.linspace if isinstance(rule, Linspace) else rule.logspace
        is_sound = self._has_difference(low, high, path)
        if count < 2:
            text = f"{path[-1]} needs at least 2 values"
            self.report.add((*path, 2), text, "give a single value as a list")
            is_sound = False
        for i, end in enumerate((low, high) if isinstance(rule, Logspace) else ()):
            if end <= 0.0:
                hint = "the ends are values, not exponents"
                self.report.add((*path, i), "must be greater than 0 for logspace", hint, end)
                is_sound = False
        return is_sound

    def _leads(self, first: float, last: float, step: float, path: Path_) -> bool:
        """Check that the step of a range leads from its first value to its end."""
        rule = hint = ""
        if step == 0.0:
            rule = "the step must not be 0"
        elif (last > first and step < 0.0) or (last < first and step > 0.0):
            rule, hint = f"the step must lead from {first:g} to {last:g}", f"{-step:g}"
        elif not self._has_difference(first, last, path):
            return False
        elif not (last - first) / step < MAX_RANGE:
            rule = f"the step gives more than {MAX_RANGE:g} values"
        if rule:
            self.report.add((*path, 2), rule, hint, step)
        return not rule

    def _has_difference(self, low: float, high: float, path: Path_) -> bool:
        """Check that two ends have a finite difference."""
        is_finite = math.isfinite(high - low)
        if not is_finite:
            rule = f"is too far from {low:g}: the difference has no finite value"
            self.report.add((*path, 1), rule)
        return is_finite

    def _is_within(self, ends: Iterable[float], target: Target, path: Path_) -> bool:
        """Check values against the bounds of what they are for; a rule goes nowhere beyond its ends."""
        is_sound = True
        word = "greater than" if target.exclusive else "at least"
        for i, value in enumerate(ends):
            rule = ""
            if value < target.least or (target.exclusive and value == target.least):
                rule = f"must be {word} {target.least:g}"
            elif value > target.most:
                rule = f"must be at most {target.most:g}"
            if rule:
                self.report.add((*path, i), rule, value=value)
                is_sound = False
        return is_sound
