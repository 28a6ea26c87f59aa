"""What may be swept, by dotted key, each key once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from vibsim.core.errors import nearest
from vibsim.experiment.data import SchemeSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.schema.document import TimeSection
from vibsim.experiment.schema.fields import TABLE
from vibsim.experiment.yaml.parse import Path_
from vibsim.models import Model, Parameter, State
from vibsim.schemes import SCHEMES, AnyOption, NumberOption, Option

_STEPS = "step counts cannot be swept: every member has the same steps"
_LEVELS = "levels cannot be swept: they are what is compared"
_FIXED = {
    f"time.{name}": _STEPS for name in ("base_steps", "base_dt", "steps_per_period", "periods")
}


@dataclass(frozen=True)
class Bound:
    """The least and the largest value that is allowed."""

    least: float = -math.inf
    most: float = math.inf
    exclusive: bool = False
    """Whether the least value itself is refused."""


_END = Bound(least=0.0, exclusive=True)


@dataclass(frozen=True)
class Target:
    """What a key of the sweep stands for."""

    bound: Bound = Bound()
    """What its numbers must keep to."""
    choices: tuple[str, ...] = ()
    """The words of an option; empty where it takes numbers."""
    is_flag: bool = False
    """Whether it takes true and false."""


@dataclass(frozen=True)
class Keys:
    """The keys that can be swept, and those that are."""

    targets: Mapping[str, Target]
    model: Model | None
    time: TimeSection | None
    lacks_scheme: bool
    """Whether a scheme is at fault, so that nothing is said about options of unknown schemes."""
    report: Report
    seen: dict[str, Path_] = field(default_factory=dict)

    @property
    def example(self) -> str:
        """A parameter of the model that can be swept."""
        return next(key for key in self.targets if key.startswith("model."))

    def find(self, key: str, path: Path_) -> Target | None:
        """Return what `key` at `path` stands for; None, and a fault, where it cannot be swept."""
        first = self.seen.setdefault(key, path)
        if first != path:
            where = f"in {first[1]}" if len(first) > 2 else "on its own"
            self.report.add(path, f"is swept twice, first {where}", at_key=True)
            return None
        if key in _FIXED or key.split(".")[0] == "levels":
            self.report.add(path, _FIXED.get(key, _LEVELS), at_key=True)
            return None
        time = self.time
        if key == "time.end" and time is not None and (time.end is None or time.base_dt):
            rule = "the end can be swept only where time has an end, and base_steps if anything"
            self.report.add(path, rule, at_key=True)
            return None
        target = self.targets.get(key)
        if target is None and self.model is not None and key in table_keys(self.model):
            rule = "cannot be swept: every member has the same formula, or the same table"
            self.report.add(path, rule, "sweep a parameter, such as " + self.example, at_key=True)
            return None
        broken = self.model is None or (self.lacks_scheme and key.startswith("schemes."))
        if target is None and not broken:
            alike = [name for name in self.targets if name.lower() == key.lower()]
            hint = nearest(key, alike or list(self.targets))
            self.report.add(path, "cannot be swept", hint, at_key=True)
        return target


def targets(model: Model | None, schemes: Sequence[SchemeSpec]) -> dict[str, Target]:
    """Return everything that can be swept, by dotted key."""
    found: dict[str, Target] = {}
    if model is not None:
        if model.start is None:
            found.update((f"initial.{state.name}", _state(state)) for state in model.states)
        found.update((f"model.{row.key}", _parameter(row)) for row in model.parameters)
    found["time.end"] = Target(_END)
    for scheme in schemes:
        for option in SCHEMES[scheme.kind].options_on(model):
            found[f"schemes.{scheme.name}.{option.name}"] = _option(option)
    return found


def table_keys(model: Model) -> set[str]:
    """Name every formula that may be a table, and the keys of that, by dotted key."""
    tables = ((f"model.{row.name}", row.table) for row in model.formulas if row.table)
    return {key for name, row in tables for key in (name, *(f"{name}.{k}" for k in (TABLE, *row)))}


def _parameter(row: Parameter) -> Target:
    least = -math.inf if row.minimum is None else row.minimum
    most = math.inf if row.maximum is None else row.maximum
    return Target(Bound(least, most, exclusive=row.exclusive))


def _state(row: State) -> Target:
    return Target(Bound(-math.inf if row.minimum is None else row.minimum))


def _option(option: AnyOption) -> Target:
    if isinstance(option, Option):
        return Target(choices=option.choices)
    if isinstance(option, NumberOption):
        return Target(Bound(option.least, option.most))
    return Target(is_flag=True)
