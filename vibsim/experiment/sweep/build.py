"""The sweep section: counted and compared with its bounds before anything is written out."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from vibsim.experiment.data import TimeSpec, end_varies
from vibsim.experiment.schema.axes import Axis, Draw, Values, count_of
from vibsim.experiment.schema.sweep_section import Sample, SweepSection, Written
from vibsim.experiment.sweep.keys import Keys
from vibsim.experiment.sweep.values import bounded, flags, numbers, ruled, spans, words
from vibsim.experiment.yaml.parse import Path_

MAX_HYPERCUBE = 10**6
"""Points of a latin hypercube: none of them is known before all are drawn."""


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


def read(section: SweepSection, order: Sequence[str], keys: Keys) -> SweepAxes:
    """Check a sweep; `order` names its keys as the file has them."""
    found: list[Axis | None] = []
    for key in order:
        if key == "zip" and section.zip is not None:
            found.append(_zip(section.zip, keys))
        elif key == "sample" and section.sample is not None:
            found.append(_sample(section.sample, keys))
        elif key in section.single:
            values = _values(key, section.single[key], ("sweep", key), keys)
            found.append(None if values is None else _axis((key,), (values,)))
    sound = tuple(axis for axis in found if axis is not None)
    return SweepAxes(sound, len(sound) == len(found))


def _axis(keys: tuple[str, ...], values: tuple[Values, ...] | Draw) -> Axis:
    # every number is checked already, and there may be many
    return Axis.model_construct(keys=keys, values=values)


def _zip(section: Mapping[str, Written], keys: Keys) -> Axis | None:
    rows = {key: _values(key, value, ("sweep", "zip", key), keys) for key, value in section.items()}
    values = {key: value for key, value in rows.items() if value is not None}
    if not values:
        return None
    counts = {key: count_of(value) for key, value in values.items()}
    first = next(iter(counts))
    for key, count in counts.items():
        if count != counts[first]:
            rule = f"must have as many values as {first}, {counts[first]}, has {count}"
            keys.report.add(("sweep", "zip", key), rule, at_key=True)
    if len(values) < len(rows) or len(set(counts.values())) > 1:
        return None
    return _axis(tuple(values), tuple(values.values()))


def _sample(section: Sample, keys: Keys) -> Axis | None:
    sound = [_interval(key, interval, keys) for key, interval in section.over.items()]
    if section.method == "latin_hypercube" and section.n > MAX_HYPERCUBE:
        rule = f"must be at most {MAX_HYPERCUBE} for a latin hypercube, which is drawn as a whole"
        hint = "sobol and random have no such limit"
        keys.report.add(("sweep", "sample", "n"), rule, hint, section.n)
        return None
    if not all(sound):
        return None
    bounds = tuple(section.over.values())
    draw = Draw(method=section.method, n=section.n, seed=section.seed, over=bounds)
    return _axis(tuple(section.over), draw)


def _interval(key: str, interval: tuple[float, float], keys: Keys) -> bool:
    path: Path_ = ("sweep", "sample", "over", key)
    target = keys.find(key, path)
    if target is None:
        return False
    if target.choices or target.is_flag:
        rule = f"takes {'words' if target.choices else 'true and false'}, which cannot be drawn"
        keys.report.add(path, rule, "sweep it by a list outside sample", at_key=True)
        return False
    low, high = interval
    if low >= high:
        keys.report.add((*path, 1), f"must be greater than the least value, {low:g}", value=high)
        return False
    return spans(low, high, path, keys.report) and bounded(
        interval, target.bound, path, keys.report
    )


def _values(key: str, written: Written, path: Path_, keys: Keys) -> Values | None:
    """Return the values of one key; None where something is wrong with them or the key."""
    target = keys.find(key, path)
    if target is None:
        return None
    if target.choices:
        return words(written, target.choices, path, keys.report)
    if target.is_flag:
        return flags(written, path, keys.report)
    if isinstance(written, tuple):
        listed = numbers(written, path, keys.report)
        sound = listed is not None and bounded(listed, target.bound, path, keys.report)
        return listed if sound else None
    place = (*path, next(iter(type(written).model_fields)))
    rule = ruled(written, place, keys.report)
    sound = rule is not None and bounded(rule.ends, target.bound, place, keys.report)
    return rule if sound else None
