"""The section ``sweep``, in the file and in an experiment: rules for the values of each key, not the values.

An axis is a single key, several keys that vary together (``zip``), or sample points over several keys (``sample``).
`vibsim.experiment.sweep_columns` computes the values.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field, StrictBool, WithJsonSchema

from vibsim.experiment.schema.fields import (
    Count,
    Number,
    Section,
    Text,
    by_form,
    number,
    plain,
    refused,
    whole,
)
from vibsim.experiment.yaml.parse import Path_
from vibsim.schemes import NumberOption, Option, Scheme
from vibsim.schemes.base import EVENTS

FLAGS: Mapping[bool, str] = {False: "false", True: "true"}
"""Text of a flag among the values of a sweep."""


def as_option(known: str | float | bool, value: Any) -> str | float | bool:
    """Return `value`, an entry of a column of a sweep, converted to the type of the option value `known`."""
    if isinstance(known, bool):
        return str(value) == FLAGS[True]
    return str(value) if isinstance(known, str) else float(value)


def tolerance_name(name: str, tolerance: float) -> str:
    """Return the name of a scheme with one of several tolerances: ``dop853_1e-04``."""
    texts = (f"{tolerance:.{digits}e}" for digits in range(17))
    return f"{name}_{next((text for text in texts if float(text) == tolerance), repr(tolerance))}"


HIT = 1e-9  # tolerance within which the last value of a range reaches the end, in steps
MAX_SEED = 2**63 - 1
Seed = Annotated[int, Field(ge=0, le=MAX_SEED), BeforeValidator(whole)]
Method = Literal["latin_hypercube", "sobol", "random"]
Interval = tuple[Number, Number]


class _Spaced(Section):
    """A rule that gives spaced values between two ends."""

    @property
    def numbers(self) -> tuple[Any, ...]:
        """The three numbers of the rule."""
        numbers: tuple[Any, ...] = next(iter(self.__dict__.values()))
        return numbers

    @property
    def count(self) -> int:
        """Number of values."""
        return int(self.numbers[2])

    @property
    def ends(self) -> tuple[float, ...]:
        """The first and the last value; every other one lies between them."""
        return self.numbers[:2]


class Linspace(_Spaced):
    """Equally spaced values."""

    linspace: tuple[Number, Number, Count]
    """First value a, last value b (both included), and how many: a + (b - a)*i/(n - 1)."""


class Logspace(_Spaced):
    """Geometrically spaced values."""

    logspace: tuple[Number, Number, Count]
    """First value a, last value b (both included, not their exponents), and how many: a*(b/a)**(i/(n - 1))."""


class Range(_Spaced):
    """Values with a fixed spacing."""

    range: tuple[Number, Number, Number]
    """First value a, end b, and step: a + i*step up to b, which is included if it is reached to 1e-9 of a step."""

    @property
    def count(self) -> int:
        """Number of values; the step must have the sign of last minus first."""
        first, last, step = self.range
        return math.floor((last - first) / step + HIT) + 1

    @property
    def ends(self) -> tuple[float, ...]:
        """The first and the last value; every other one lies between them."""
        first, _, step = self.range
        return (first, first + (self.count - 1) * step)


RULES: Mapping[str, type[Section]] = {"linspace": Linspace, "logspace": Logspace, "range": Range}
"""All rules by key."""
Rule = Linspace | Logspace | Range
Entry = float | str
Values = tuple[float, ...] | tuple[Text, ...] | Rule  # numbers, option words, or a rule for numbers


class _Sampled(Section):
    """How points of a box are sampled."""

    method: Method
    """Latin hypercube, Sobol sequence (scrambled), or independent random numbers."""
    n: Count
    """Number of points."""
    seed: Seed
    """Seed of the random numbers; the same seed gives the same points."""


class Draw(_Sampled):
    """Sample points over several keys, in an experiment."""

    over: tuple[Interval, ...]
    """Least and largest value of every key."""


class Axis(Section):
    """Keys that vary together."""

    keys: tuple[str, ...]
    """Dotted keys."""
    values: tuple[Values, ...] | Draw
    """The values of every key, or sample points over all keys."""

    @property
    def count(self) -> int:
        """Number of members along the axis."""
        return self.values.n if isinstance(self.values, Draw) else count_of(self.values[0])

    @property
    def spans(self) -> tuple[tuple[Entry, Entry], ...]:
        """Least and largest value of every key."""
        if isinstance(self.values, Draw):
            return self.values.over
        ends: list[Any] = [v if isinstance(v, tuple) else v.ends for v in self.values]
        return tuple((min(values), max(values)) for values in ends)


def count_of(values: Values) -> int:
    """Return the number of values."""
    return len(values) if isinstance(values, tuple) else values.count


LIST_RULE = "must be a list, or a mapping with one of " + ", ".join(RULES)


def _as_entry(value: Any) -> Any:
    """Leave text and flags unchanged: the key decides whether they are options or formulas."""
    return value if isinstance(value, str | bool) else number(value)


_Entry = Annotated[
    StrictBool | float | str,
    BeforeValidator(_as_entry),
    WithJsonSchema({"type": ["number", "string", "boolean"]}),
]
_List = Annotated[tuple[_Entry, ...], Field(min_length=1), BeforeValidator(plain)]
Written = tuple[bool | float | str, ...] | Linspace | Logspace | Range
"""Values of one key in the file. The key decides whether text is an option word or a formula."""
if TYPE_CHECKING:
    Spread = Written
else:
    Spread = by_form({**RULES, "list": _List}, LIST_RULE, "values")


class Sample(_Sampled):
    """Sample points over several parameters, which form one axis of the grid."""

    stand_ins = MappingProxyType({"method": "random", "n": 1, "seed": 0})

    over: Annotated[dict[str, Interval], Field(min_length=1)]
    """Least and largest value of every parameter, by dotted path."""


def swept_options(schemes: Iterable[Scheme]) -> dict[str, Any]:
    """Return the schema of swept scheme options that are words or flags."""
    words: dict[str, list[str | bool]] = {}
    options = (option for scheme in schemes for option in scheme.options)
    for option in (*options, EVENTS):
        if not isinstance(option, NumberOption):
            choices = option.choices if isinstance(option, Option) else (False, True)
            words.setdefault(option.name, []).extend(choices)
    return {
        rf"^schemes\..+\.{name}$": {
            "items": {"enum": list(dict.fromkeys(choices))},
            "minItems": 1,
            "type": "array",
        }
        for name, choices in sorted(words.items())
    }


class ParameterSweep(Section):
    """Further placeholders of the command, or parameters of the function, that vary; several make a grid."""

    model_config = ConfigDict(extra="allow", json_schema_extra={"minProperties": 1})
    __pydantic_extra__: dict[str, Spread]
    stand_ins = MappingProxyType({})
    other_values = Spread

    zip: Annotated[dict[str, Spread], Field(min_length=1)] | None = None
    """Parameters that vary together, with equally many values: one axis of the grid."""
    sample: Sample | None = None
    """Sample points over several parameters: one axis of the grid."""

    @property
    def single(self) -> Mapping[str, Written]:
        """Values of the parameters that form an axis each."""
        return self.__pydantic_extra__ or {}


def swept_values(section: Any) -> Iterator[tuple[Path_, Any]]:
    """Yield the path of each key that a section ``sweep`` varies, and what is written there, valid or not."""
    for key, value in section.items() if isinstance(section, Mapping) else ():
        path = {"zip": ("zip",), "sample": ("sample", "over")}.get(key, ())
        inner = value.get("over") if key == "sample" and isinstance(value, Mapping) else value
        rows = inner if isinstance(inner, Mapping) else {}
        yield from (
            (("sweep", *path, name), x) for name, x in (rows if path else {key: value}).items()
        )


def _key(value: Any) -> Any:
    """Return a key of the sweep unchanged; refuse other types than text."""
    if not isinstance(value, str):
        raise refused("must name a swept key, such as model.omega")
    return value


class SweepSection(ParameterSweep):
    """Parameters that vary, by dotted path; several make a grid in the order of the file, the last one fastest."""

    # `vibsim.experiment.schema.document` adds `swept_options`
    model_config = ConfigDict(json_schema_extra={"minProperties": 1, "patternProperties": {}})

    follow: Annotated[Text, BeforeValidator(_key)] | None = None
    """A swept key along which each member starts from the final state of the previous one; it must vary fastest."""
