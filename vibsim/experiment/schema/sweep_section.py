"""The sweep section as it is written."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    StrictBool,
    Tag,
    WithJsonSchema,
)

from vibsim.experiment.schema.axes import RULES, Interval, Linspace, Logspace, Method, Range, Seed
from vibsim.experiment.schema.fields import Count, Section, number, plain, tag
from vibsim.schemes import SCHEMES, NumberOption, Option
from vibsim.schemes.base import EVENTS

LIST_RULE = "must be a list, or a mapping with one of " + ", ".join(RULES)


def _entry(value: Any) -> Any:
    """Leave text as it is: only the key tells whether it is an option or a formula, and a flag likewise."""
    return value if isinstance(value, str | bool) else number(value)


def _which(value: Any) -> str | None:
    """Tell a list from a mapping with a rule, and which rule it is."""
    if isinstance(value, list | tuple):
        return tag("list")
    names = RULES if isinstance(value, Mapping) else ()
    return next((tag(name) for name in names if name in value), None)


_Entry = Annotated[
    StrictBool | float | str,
    BeforeValidator(_entry),
    WithJsonSchema({"type": ["number", "string", "boolean"]}),
]
_List = Annotated[tuple[_Entry, ...], Field(min_length=1), BeforeValidator(plain)]
Written = tuple[bool | float | str, ...] | Linspace | Logspace | Range
"""Values of one key as written: text is an option word or a formula, a truth value a flag, which its key tells."""
_Values = Annotated[
    Annotated[Linspace, Tag(tag("linspace"))]
    | Annotated[Logspace, Tag(tag("logspace"))]
    | Annotated[Range, Tag(tag("range"))]
    | Annotated[_List, Tag(tag("list"))],
    Discriminator(_which, custom_error_type="values", custom_error_message=LIST_RULE),
]


class Sample(Section):
    """Points scattered over several parameters, all of them one axis of the grid."""

    method: Method
    """Latin hypercube, Sobol sequence (scrambled), or independent random numbers."""
    n: Count
    """Number of points."""
    seed: Seed
    """Whole number from which the points are drawn: the same ones every time."""
    over: Annotated[dict[str, Interval], Field(min_length=1)]
    """Least and largest value of every parameter, by dotted path."""


def _options() -> dict[str, Any]:
    """Describe the options of every scheme that take a list of words or flags, for editors."""
    words: dict[str, list[str | bool]] = {}
    every = (option for scheme in SCHEMES.values() for option in scheme.options)
    for option in (*every, EVENTS):
        if not isinstance(option, NumberOption):
            choices = option.choices if isinstance(option, Option) else (False, True)
            words.setdefault(option.name, []).extend(choices)
    return {
        rf"^schemes\..+\.{name}$": {
            "type": "array",
            "items": {"enum": list(dict.fromkeys(choices))},
            "minItems": 1,
        }
        for name, choices in words.items()
    }


class SweepSection(Section):
    """Parameters that vary, by dotted path; several make a grid in the order written, the last one fastest."""

    model_config = ConfigDict(
        extra="allow",
        json_schema_extra={"minProperties": 1, "patternProperties": _options()},
    )
    __pydantic_extra__: dict[str, _Values]

    zip: Annotated[dict[str, _Values], Field(min_length=1)] | None = None
    """Parameters that move together, each with as many values: one axis of the grid."""
    sample: Sample | None = None
    """Points scattered over several parameters: one axis of the grid."""

    @property
    def single(self) -> Mapping[str, Written]:
        """Values of the parameters that are an axis of their own."""
        return self.__pydantic_extra__ or {}
