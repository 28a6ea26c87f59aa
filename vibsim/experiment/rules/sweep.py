"""The section ``sweep``: what may vary, within which bounds, counted before anything is written out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic_core import PydanticCustomError

from vibsim.core.errors import nearest
from vibsim.experiment.data import SchemeSpec, Sweep
from vibsim.experiment.faults import Report
from vibsim.experiment.schema.fields import TABLE, number, refused
from vibsim.experiment.schema.sweep import (
    FLAGS,
    Axis,
    Draw,
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
_FIXED = {
    f"time.{name}": _STEPS for name in ("base_steps", "base_dt", "steps_per_period", "periods")
}


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

    def entry(self, value: Any) -> float | str:
        """Return an entry of a list of its values; PydanticCustomError where it is none."""
        if self.choices:
            if not isinstance(value, str) or value not in self.choices:
                raise refused("unknown choice", nearest(str(value), self.choices))
            return value
        if self.is_flag:
            if not isinstance(value, bool):
                raise refused("must be true or false")
            return FLAGS[value]
        return number(value)


def targets(model: Model | None, schemes: Sequence[SchemeSpec]) -> dict[str, Target]:
    """Return everything that can be swept, by dotted key."""
    found: dict[str, Target] = {}
    if model is not None:
        for state in model.states if model.start is None else ():
            found[f"initial.{state.name}"] = Target(_or(state.minimum, -math.inf))
        for row in model.parameters:
            least, most = _or(row.minimum, -math.inf), _or(row.maximum, math.inf)
            found[f"model.{row.key}"] = Target(least, most, row.exclusive)
    found["time.end"] = Target(0.0, exclusive=True)
    for scheme in schemes:
        for option in SCHEMES[scheme.kind].options_on(model):
            target = Target(is_flag=True)
            if isinstance(option, Option):
                target = Target(choices=option.choices)
            elif isinstance(option, NumberOption):
                target = Target(option.least, option.most)
            found[f"schemes.{scheme.name}.{option.name}"] = target
    return found


def _or(bound: float | None, default: float) -> float:
    return default if bound is None else bound


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
) -> tuple[Sweep, bool]:
    """Return what is sound of the sweep of a document, whose keys stand in some `order`, and whether that is all.

    Where a scheme is at fault (`lacks_scheme`), nothing is said about options of unknown schemes.
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
            found.append(reader.alone(key, section.single[key]))
    sound = tuple(axis for axis in found if axis is not None)
    return Sweep.model_construct(axes=sound), len(sound) == len(found)


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

    def alone(self, key: str, written: Written) -> Axis | None:
        """Return a key that moves alone."""
        values = self._values(key, written, ("sweep", key))
        return None if values is None else _axis((key,), (values,))

    def zipped(self, section: Mapping[str, Written]) -> Axis | None:
        """Return keys that move together."""
        rows = {key: self._values(key, row, ("sweep", "zip", key)) for key, row in section.items()}
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
        bounds = tuple(section.over.values())
        draw = Draw(method=section.method, n=section.n, seed=section.seed, over=bounds)
        return _axis(tuple(section.over), draw) if all(sound) else None

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

    def _values(self, key: str, written: Written, path: Path_) -> Values | None:
        target = self._target(key, path)
        if target is None:
            return None
        if isinstance(written, tuple):
            found = self._entries(written, target, path)
            is_number = not (target.choices or target.is_flag)
            is_sound = not is_number or found is None or self._is_within(found, target, path)
            return found if is_sound else None
        if target.choices:
            self.report.add(
                path, "must be a list of words", "choose from " + ", ".join(target.choices)
            )
            return None
        if target.is_flag:
            self.report.add(path, "must be a list of true and false")
            return None
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
            rule = _FIXED.get(key, "levels cannot be swept: they are what is compared")
        elif key == "time.end" and time is not None and (time.end is None or time.base_dt):
            rule = "the end can be swept only where time has an end, and base_steps if anything"
        elif target is not None:
            return target
        elif model is not None and key in _table_keys(model):
            rule = "cannot be swept: every member has the same formula, or the same table"
            example = next(key for key in self.targets if key.startswith("model."))
            hint = f"sweep a parameter, such as {example}"
        elif model is not None and not (self.lacks_scheme and key.startswith("schemes.")):
            alike = [name for name in self.targets if name.lower() == key.lower()]
            rule, hint = "cannot be swept", nearest(key, alike or list(self.targets))
        if rule:
            self.report.add(path, rule, hint, at_key=True)
        return None

    def _entries(self, written: tuple[Any, ...], target: Target, path: Path_) -> Any:
        """Return the entries of a list: numbers, some of them written as formulas, or words, or flags (`FLAGS`)."""
        found: list[Any] = []
        for i, value in enumerate(written):
            try:
                found.append(target.entry(value))
            except PydanticCustomError as error:
                hint = (error.context or {}).get("hint", "")
                self.report.add((*path, i), error.message(), hint, value)
        return tuple(found) if len(found) == len(written) else None

    def _gives_values(self, rule: Rule, path: Path_) -> bool:
        low, high, number = rule.numbers
        faults: list[tuple[int, str, str, Any]] = []
        if isinstance(rule, Range):
            if number == 0.0:
                faults.append((2, "the step must not be 0", "", number))
            elif low != high and (low < high) != (number > 0.0):
                text = f"the step must lead from {low:g} to {high:g}"
                faults.append((2, text, f"{-number:g}", number))
            elif math.isfinite(high - low) and not (high - low) / number < MAX_RANGE:
                faults.append((2, f"the step gives more than {MAX_RANGE:g} values", "", number))
        elif number < 2:
            text = f"{path[-1]} needs at least 2 values"
            faults.append((2, text, "give a single value as a list", None))
        for i, end in enumerate((low, high) if isinstance(rule, Logspace) else ()):
            if end <= 0.0:
                hint = "the ends are values, not exponents"
                faults.append((i, "must be greater than 0 for logspace", hint, end))
        for i, text, hint, value in faults:
            self.report.add((*path, i), text, hint, value)
        is_faulty_step = isinstance(rule, Range) and bool(faults)
        return (is_faulty_step or self._has_difference(low, high, path)) and not faults

    def _has_difference(self, low: float, high: float, path: Path_) -> bool:
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
