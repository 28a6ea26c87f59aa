"""Read the section ``sweep``: which keys may vary, and within which bounds. Values are counted but not expanded."""

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

MAX_HYPERCUBE = 10**6  # largest number of points of a Latin hypercube, which is drawn whole
MAX_RANGE = 2.0**53  # largest number of values of a range: larger indices are not exact as floats
_STEPS = "step counts cannot be swept: every member has the same steps"
_FIXED = {
    f"time.{name}": _STEPS
    for name in ("base_steps", "base_dt", "steps_per_period", "periods", "steps_per_point")
}


def _table_keys(model: Model) -> set[str]:
    """Return the dotted keys of all formulas that may be tables, and of the keys of these tables."""
    tables = ((f"model.{row.name}", row.table) for row in model.formulas if row.table)
    return {key for name, row in tables for key in (name, *(f"{name}.{k}" for k in (TABLE, *row)))}


def read_sweep(
    document: Any,
    model: Model | None,
    schemes: Sequence[SchemeSpec],
    lacks_scheme: bool,
    report: Report,
) -> tuple[Sweep, bool]:
    """Return the valid part of the sweep of a document, and whether that is the whole sweep.

    Malformed values are already left out of the document. If a scheme is faulty (`lacks_scheme`), options of unknown
    schemes are not reported.
    """
    section = document.sweep
    if section is None:
        return Sweep(axes=()), _is_wellformed(report)
    types = sweep_types(model, ((scheme.name, scheme.method) for scheme in schemes))
    reader = SweepReader(types, report, document.time, model, lacks_scheme)
    axes = reader.axes(section)
    valid = tuple(axis for axis in axes if axis is not None)
    is_whole = _is_wellformed(report) and len(valid) == len(axes)
    if is_whole and not valid:
        report.add(("sweep",), "must not be empty")
    follow = section.follow if is_whole and valid else None
    if follow is not None:
        check_follow(follow, valid, report)
    return Sweep.model_construct(axes=valid, follow=follow), is_whole


def _is_wellformed(report: Report) -> bool:
    return not any(path[:1] == ("sweep",) for path in report.faulty)


def _values_of_kind(kind: Any) -> str:
    """Return the name of the values that a key accepts other than numbers; empty if it accepts numbers."""
    if kind is StrictBool:
        return "true and false"
    return "words" if get_origin(kind) is Literal else ""


def _axis(keys: tuple[str, ...], values: tuple[Values, ...] | Draw) -> Axis:
    # skips validation: all numbers are checked already, and there may be many
    return Axis.model_construct(keys=keys, values=values)


@dataclass
class SweepReader:
    """Converts the content of the section to axes with values of the right type; None stands for a faulty axis."""

    types: Mapping[str, Any]
    report: Report
    time: Any = None
    model: Model | None = None
    lacks_scheme: bool = False
    first: dict[str, Path_] = field(default_factory=dict)  # path at which each key is swept first

    def axes(self, section: Any) -> list[Axis | None]:
        """Return the axes of a section, in the order of the file."""
        axes: list[Axis | None] = []
        for key in self.report.source.data["sweep"]:
            if key == "zip" and section.zip is not None:
                axes.append(self.zip_axis(section.zip))
            elif key == "sample" and section.sample is not None:
                axes.append(self.sample_axis(section.sample))
            elif key in section.single:
                values = self._values(key, section.single[key], ("sweep", key))
                axes.append(None if values is None else _axis((key,), (values,)))
        return axes

    def zip_axis(self, section: Mapping[str, Written]) -> Axis | None:
        """Return the axis of keys that vary together."""
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

    def sample_axis(self, section: Sample) -> Axis | None:
        """Return the axis of sample points over several keys."""
        are_valid = [self._is_interval(key, *ends) for key, ends in section.over.items()]
        if section.method == "latin_hypercube" and section.n > MAX_HYPERCUBE:
            most = f"must be at most {MAX_HYPERCUBE}"
            rule = f"{most} for a latin hypercube, which is drawn as a whole"
            hint = "sobol and random have no such limit"
            self.report.add(("sweep", "sample", "n"), rule, hint, section.n)
            return None
        bounds = tuple(section.over.values())
        draw = Draw(method=section.method, n=section.n, seed=section.seed, over=bounds)
        return _axis(tuple(section.over), draw) if all(are_valid) else None

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
            entries = self._entries(written, kind, path)
            is_flags = entries is not None and kind is StrictBool
            return tuple(FLAGS[flag] for flag in entries) if is_flags else entries
        if what := _values_of_kind(kind):
            hint = "" if kind is StrictBool else "choose from " + ", ".join(get_args(kind))
            self.report.add(path, f"must be a list of {what}", hint)
            return None
        path = (*path, next(iter(type(written).model_fields)))
        is_sound = self._gives_values(written, path)  # all values of a rule lie between its ends
        return written if is_sound and self._entries(written.ends, kind, path) else None

    def _type(self, key: str, path: Path_) -> Any:
        """Return the type of the values of `key` at `path`; report a fault and return None if it cannot be swept."""
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
            close = [name for name in self.types if name.lower() == key.lower()]
            close = close or [name for name in self.types if name.lower().split(".")[-1] == last]
            rule, hint = "cannot be swept", nearest(key, close or list(self.types))
            if len(close) == 1:
                hint = f"did you mean '{close[0]}'?"
        if rule:
            self.report.add(path, rule, hint, at_key=True)
        return None

    def _entries(self, written: tuple[Any, ...], kind: Any, path: Path_) -> Any:
        """Return the entries of a list converted to type `kind`: numbers (also written as formulas), words or flags."""
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
        if math.isfinite(high - low):
            return True
        rule = f"is too far from {low:g}: the difference has no finite value"
        self.report.add((*path, 1), rule)
        return False
