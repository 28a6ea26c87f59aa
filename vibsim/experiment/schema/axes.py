"""The axes of a sweep, as written and as used: a rule for the values of each key, never the values themselves.

An axis is one key whose values a rule gives, several keys that move together (``zip``), or points scattered over
several keys (``sample``). The numbers come from `vibsim.experiment.sweep.columns`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from vibsim.experiment.schema.fields import Count, Number, Section, Text, whole

HIT = 1e-9
"""How far the last value of a range may be from its end, in steps, to count as reached."""
MAX_SEED = 2**63 - 1
Seed = Annotated[int, Field(ge=0, le=MAX_SEED), BeforeValidator(whole)]
Method = Literal["latin_hypercube", "sobol", "random"]
Interval = tuple[Number, Number]


class Linspace(Section):
    """Equally spaced values."""

    linspace: tuple[Number, Number, Count]
    """First value a, last value b (both included), and how many: a + (b - a)*i/(n - 1)."""

    @property
    def count(self) -> int:
        """Number of values."""
        return self.linspace[2]

    @property
    def ends(self) -> tuple[float, ...]:
        """The first and the last value; every other one lies between them."""
        return self.linspace[:2]


class Logspace(Section):
    """Geometrically spaced values."""

    logspace: tuple[Number, Number, Count]
    """First value a, last value b (both included, not their exponents), and how many: a*(b/a)**(i/(n - 1))."""

    @property
    def count(self) -> int:
        """Number of values."""
        return self.logspace[2]

    @property
    def ends(self) -> tuple[float, ...]:
        """The first and the last value; every other one lies between them."""
        return self.logspace[:2]


class Range(Section):
    """Values at a fixed distance."""

    range: tuple[Number, Number, Number]
    """First value a, end b, and step: a + i*step up to b, which is among them when it is hit to 1e-9 of a step."""

    @property
    def count(self) -> int:
        """Number of values; the step must lead to the end."""
        first, last, step = self.range
        return math.floor((last - first) / step + HIT) + 1

    @property
    def ends(self) -> tuple[float, ...]:
        """The first and the last value; every other one lies between them."""
        first, _, step = self.range
        return (first, first + (self.count - 1) * step)


RULES: Mapping[str, type[Section]] = {
    "linspace": Linspace,
    "logspace": Logspace,
    "range": Range,
}
"""Every rule by the key that it is written with."""
Rule = Linspace | Logspace | Range
Entry = float | str
Values = tuple[float, ...] | tuple[Text, ...] | Rule
"""Numbers, option words, or a rule that gives numbers."""


class Draw(Section):
    """Points scattered over a box."""

    method: Method
    n: Count
    seed: Seed
    over: tuple[Interval, ...]
    """Least and largest value of every key."""


class Axis(Section):
    """Keys that vary together."""

    keys: tuple[str, ...]
    """Dotted keys."""
    values: tuple[Values, ...] | Draw
    """The values of every key, or points over all of them."""

    @property
    def count(self) -> int:
        """Number of members along the axis."""
        return self.values.n if isinstance(self.values, Draw) else count_of(self.values[0])

    @property
    def varies(self) -> tuple[bool, ...]:
        """Whether the values of every key differ; scattered ones do, whatever is drawn."""
        return tuple(low != high for low, high in self.spans)

    @property
    def spans(self) -> tuple[tuple[Entry, Entry], ...]:
        """Least and largest value of every key."""
        if isinstance(self.values, Draw):
            return self.values.over
        return tuple(map(span_of, self.values))


def count_of(values: Values) -> int:
    """Return the number of values."""
    return len(values) if isinstance(values, tuple) else values.count


def span_of(values: Values) -> tuple[Entry, Entry]:
    """Return the least and the largest value."""
    ends: Any = values if isinstance(values, tuple) else values.ends
    return (min(ends), max(ends))
