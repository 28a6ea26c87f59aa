"""The section ``sweep``, as written and as used: a rule for the values of each key, never the values themselves.

An axis is one key whose values a rule gives, several keys that move together (``zip``), or points scattered over
several keys (``sample``). The numbers come from `vibsim.experiment.sweep_columns`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
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
from vibsim.schemes import SCHEMES, NumberOption, Option, Scheme
from vibsim.schemes.base import EVENTS

FLAGS: Mapping[bool, str] = {False: "false", True: "true"}
"""How a flag that is swept is written among the values of a sweep."""


def as_option(known: str | float | bool, value: Any) -> str | float | bool:
    """Return `value`, an entry of a column of a sweep, as the option of which `known` is a value."""
    if isinstance(known, bool):
        return str(value) == FLAGS[True]
    return str(value) if isinstance(known, str) else float(value)


def tolerance_name(name: str, tolerance: float) -> str:
    """Return the name of one of several schemes that differ in their tolerance alone: ``dop853_1e-04``."""
    texts = (f"{tolerance:.{digits}e}" for digits in range(17))
    return f"{name}_{next((text for text in texts if float(text) == tolerance), repr(tolerance))}"


HIT = 1e-9
"""How far the last value of a range may be from its end, in steps, to count as reached."""
MAX_SEED = 2**63 - 1
Seed = Annotated[int, Field(ge=0, le=MAX_SEED), BeforeValidator(whole)]
Method = Literal["latin_hypercube", "sobol", "random"]
Interval = tuple[Number, Number]


class _Spaced(Section):
    """A first value, a last one, and how many there are."""

    @property
    def numbers(self) -> tuple[Any, ...]:
        """The list of three numbers that the rule consists of."""
        found: tuple[Any, ...] = next(iter(self.__dict__.values()))
        return found

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


RULES: Mapping[str, type[Section]] = {"linspace": Linspace, "logspace": Logspace, "range": Range}
"""Every rule by the key that it is written with."""
Rule = Linspace | Logspace | Range
Entry = float | str
Values = tuple[float, ...] | tuple[Text, ...] | Rule
"""Numbers, option words, or a rule that gives numbers."""


class _Scattered(Section):
    """How points are scattered over a box."""

    method: Method
    """Latin hypercube, Sobol sequence (scrambled), or independent random numbers."""
    n: Count
    """Number of points."""
    seed: Seed
    """Whole number from which the points are drawn: the same ones every time."""


class Draw(_Scattered):
    """Points scattered over several keys, as used."""

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
    """Leave text as it is: only the key tells whether it is an option or a formula, and a flag likewise."""
    return value if isinstance(value, str | bool) else number(value)


_Entry = Annotated[
    StrictBool | float | str,
    BeforeValidator(_as_entry),
    WithJsonSchema({"type": ["number", "string", "boolean"]}),
]
_List = Annotated[tuple[_Entry, ...], Field(min_length=1), BeforeValidator(plain)]
Written = tuple[bool | float | str, ...] | Linspace | Logspace | Range
"""Values of one key as written: text is an option word or a formula, a truth value a flag, which its key tells."""
if TYPE_CHECKING:
    Spread = Written
else:
    Spread = by_form(
        {**RULES, "list": _List}, custom_error_type="values", custom_error_message=LIST_RULE
    )


class Sample(_Scattered):
    """Points scattered over several parameters, all of them one axis of the grid."""

    stand_ins = MappingProxyType({"method": "random", "n": 1, "seed": 0})

    over: Annotated[dict[str, Interval], Field(min_length=1)]
    """Least and largest value of every parameter, by dotted path."""


def swept_options(schemes: Iterable[Scheme]) -> dict[str, Any]:
    """Describe the options of schemes that take a list of words or flags, for editors."""
    words: dict[str, list[str | bool]] = {}
    every = (option for scheme in schemes for option in scheme.options)
    for option in (*every, EVENTS):
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
    """Parameters that move together, each with as many values: one axis of the grid."""
    sample: Sample | None = None
    """Points scattered over several parameters: one axis of the grid."""

    @property
    def single(self) -> Mapping[str, Written]:
        """Values of the parameters that are an axis of their own."""
        return self.__pydantic_extra__ or {}


def _key(value: Any) -> Any:
    """Return a key of the sweep as written; what is no text can name none."""
    if not isinstance(value, str):
        raise refused("must name a swept key, such as model.omega")
    return value


class SweepSection(ParameterSweep):
    """Parameters that vary, by dotted path; several make a grid in the order written, the last one fastest."""

    model_config = ConfigDict(
        extra="allow",
        json_schema_extra={
            "minProperties": 1,
            "patternProperties": swept_options(SCHEMES.built_in.values()),
        },
    )

    follow: Annotated[Text, BeforeValidator(_key)] | None = None
    """A swept key along which each member starts from the last state of the member before; it must vary fastest."""
