"""The section ``sweep``: what may vary, within which bounds, counted before anything is written out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args, get_origin

from pydantic import StrictBool, TypeAdapter, ValidationError

from vibsim.core.errors import nearest
from vibsim.experiment.data import SchemeSpec, Sweep
from vibsim.experiment.faults import Report
from vibsim.experiment.rules.continuation import check_follow
from vibsim.experiment.schema.fields import TABLE
from vibsim.experiment.schema.model_and_schemes import sweep_types
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

MAX_HYPERCUBE = 10**6
"""Points of a latin hypercube: none of them is known before all are drawn."""
MAX_RANGE = 2.0**53
"""Values of a range, at most: beyond it, their numbers are no floats."""
_STEPS = "step counts cannot be swept: every member has the same steps"
_FIXED = {
    f"time.{name}": _STEPS
    for name in ("base_steps", "base_dt", "steps_per_period", "periods", "steps_per_point")
}


def _table_keys(model: Model) -> set[str]:
    """Name every formula that may be a table, and the keys of that, by dotted key."""
    tables = ((f"model.{row.name}", row.table) for row in model.formulas if row.table)
    return {key for name, row in tables for key in (name, *(f"{name}.{k}" for k in (TABLE, *row)))}


def read_sweep(
    document: Any,
    model: Model | None,
    schemes: Sequence[SchemeSpec],
    lacks_scheme: bool,
    report: Report,
) -> tuple[Sweep, bool]:
    """Return what is sound of the sweep of a document, and whether that is all.

    What is malformed was left out of the document. Where a scheme is at fault (`lacks_scheme`), nothing is said about
    options of unknown schemes.
    """
    section = document.sweep
    if section is None:
        return Sweep(axes=()), _is_wellformed(report)
    types = sweep_types(model, ((scheme.name, scheme.method) for scheme in schemes))
    reader = SweepReader(types, report, document.time, model, lacks_scheme)
    found = reader.axes(section)
    sound = tuple(axis for axis in found if axis is not None)
    is_whole = _is_wellformed(report) and len(sound) == len(found)
    if is_whole and not sound:
        report.add(("sweep",), "must not be empty")
    follow = section.follow if is_whole and sound else None
    if follow is not None:
        check_follow(follow, sound, report)
    return Sweep.model_construct(axes=sound, follow=follow), is_whole


def _is_wellformed(report: Report) -> bool:
    return not any(path[:1] == ("sweep",) for path in report.faulty)


def _values_of_kind(kind: Any) -> str:
    """Name what a key takes that is no number; empty where it takes numbers."""
    if kind is StrictBool:
        return "true and false"
    return "words" if get_origin(kind) is Literal else ""


def _axis(keys: tuple[str, ...], values: tuple[Values, ...] | Draw) -> Axis:
    # every number is checked already, and there may be many
    return Axis.model_construct(keys=keys, values=values)


@dataclass
class SweepReader:
    """Turns what is written of each key into values of its type; None stands for those with a fault."""

    types: Mapping[str, Any]
    report: Report
    time: Any = None
    model: Model | None = None
    lacks_scheme: bool = False
    first: dict[str, Path_] = field(default_factory=dict)
    """Where each key is swept first."""

    def axes(self, section: Any) -> list[Axis | None]:
        """Return the axes of a section, in the order of the file."""
        found: list[Axis | None] = []
        for key in self.report.source.data["sweep"]:
            if key == "zip" and section.zip is not None:
                found.append(self.zipped(section.zip))
            elif key == "sample" and section.sample is not None:
                found.append(self.scattered(section.sample))
            elif key in section.single:
                found.append(self.alone(key, section.single[key]))
        return found

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
            most = f"must be at most {MAX_HYPERCUBE}"
            rule = f"{most} for a latin hypercube, which is drawn as a whole"
            hint = "sobol and random have no such limit"
            self.report.add(("sweep", "sample", "n"), rule, hint, section.n)
            return None
        bounds = tuple(section.over.values())
        draw = Draw(method=section.method, n=section.n, seed=section.seed, over=bounds)
        return _axis(tuple(section.over), draw) if all(sound) else None

    def _is_interval(self, key: str, low: float, high: float) -> bool:
        path: Path_ = ("sweep", "sample", "over", key)
        kind = self._type(key, path)
        if kind is None:
            return False
        if what := _values_of_kind(kind):
            rule = f"takes {what}, which cannot be drawn"
            self.report.add(path, rule, "sweep it by a list outside sample", at_key=True)
            return False
        if low >= high:
            rule = f"must be greater than the least value, {low:g}"
            self.report.add((*path, 1), rule, value=high)
            return False
        is_sound = self._has_difference(low, high, path)
        return is_sound and self._entries((low, high), kind, path) is not None

    def _values(self, key: str, written: Written, path: Path_) -> Values | None:
        kind = self._type(key, path)
        if kind is None:
            return None
        if isinstance(written, tuple):
            found = self._entries(written, kind, path)
            is_flags = found is not None and kind is StrictBool
            return tuple(FLAGS[flag] for flag in found) if is_flags else found
        if what := _values_of_kind(kind):
            hint = "" if kind is StrictBool else "choose from " + ", ".join(get_args(kind))
            self.report.add(path, f"must be a list of {what}", hint)
            return None
        path = (*path, next(iter(type(written).model_fields)))
        # a rule goes nowhere beyond its ends
        is_sound = self._gives_values(written, path)
        return written if is_sound and self._entries(written.ends, kind, path) else None

    def _type(self, key: str, path: Path_) -> Any:
        """Return the type of what `key` at `path` stands for; None, and a fault, where it cannot be swept."""
        first = self.first.setdefault(key, path)
        model, time, kind = self.model, self.time, self.types.get(key)
        rule = hint = ""
        if first != path:
            rule = f"is swept twice, first {f'in {first[1]}' if len(first) > 2 else 'on its own'}"
        elif key in _FIXED or key.split(".")[0] == "levels":
            rule = _FIXED.get(key, "levels cannot be swept: they are what is compared")
        elif key == "time.end" and time is not None and (time.end is None or time.base_dt):
            rule = "the end can be swept only where time has an end, and base_steps if anything"
        elif kind is not None:
            return kind
        elif model is not None and key in _table_keys(model):
            rule = "cannot be swept: every member has the same formula, or the same table"
            example = next(key for key in self.types if key.startswith("model."))
            hint = f"sweep a parameter, such as {example}"
        elif model is not None and not (self.lacks_scheme and key.startswith("schemes.")):
            last = key.lower().split(".")[-1]
            alike = [name for name in self.types if name.lower() == key.lower()]
            alike = alike or [name for name in self.types if name.lower().split(".")[-1] == last]
            rule, hint = "cannot be swept", nearest(key, alike or list(self.types))
            if len(alike) == 1:
                hint = f"did you mean '{alike[0]}'?"
        if rule:
            self.report.add(path, rule, hint, at_key=True)
        return None

    def _entries(self, written: tuple[Any, ...], kind: Any, path: Path_) -> Any:
        """Return the entries of a list as what they are: numbers, some of them written as formulas, words or flags."""
        try:
            return TypeAdapter(tuple[kind, ...]).validate_python(written)
        except ValidationError as error:
            self.report.add_invalid(error, path)
            return None

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
