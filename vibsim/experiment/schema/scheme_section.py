"""The entries of the list of schemes, as written.

A scheme that chooses its own steps may have a list of tolerances; it stands for as many schemes, each named after its
tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, StrictBool, Tag, create_model
from pydantic_core import PydanticCustomError

from vibsim.experiment.schema.fields import FORMULA, Line, MadeSection, Section, number, short, tag
from vibsim.experiment.schema.options import tolerance_name
from vibsim.schemes import AnyOption, Flag, NumberOption, Option, Scheme
from vibsim.schemes.base import EVENTS

TOLERANCE = "tolerance"
"""The option that a scheme with steps of its own choice may have several values of."""
MAX_TOLERANCES = 100


def class_name(kind: str) -> str:
    """Return the name of the class that describes a `kind`."""
    return kind.title().replace("_", "")


def scheme_section(scheme: Scheme) -> type[Section]:
    """Return the class of an entry that is a mapping."""
    label = "Name of the scheme in this experiment, if not its kind."
    fields: dict[str, Any] = {
        "kind": (Literal[scheme.kind], Field(description=scheme.title)),
        "label": (Line | None, Field(default=None, description=label)),
    }
    for option in scheme.options:
        row = Field(default=option.default, description=option.description)
        fields[option.name] = (_type(option, scheme), row)
    if not scheme.adaptive:
        words = f"{EVENTS.description}; on models with events only, {EVENTS.default} when left out"
        fields[EVENTS.name] = (
            Literal[EVENTS.choices] | None,
            Field(default=None, description=words),
        )
    doc = f"{scheme.title} ({scheme.source})."
    return create_model(
        f"{class_name(scheme.kind)}Scheme", __base__=MadeSection, __doc__=doc, **fields
    )


def _type(option: AnyOption, scheme: Scheme) -> Any:
    if isinstance(option, Option):
        return Literal[option.choices]
    if isinstance(option, Flag):
        return StrictBool
    ends = {"ge": option.least, "le": option.most}
    bounds: dict[str, Any] = {name: end for name, end in ends.items() if math.isfinite(end)}
    value: Any = Annotated[float, Field(**bounds), FORMULA]
    if not has_tolerances(scheme, option):
        return value
    several = Annotated[tuple[value, ...], Field(min_length=1), short(MAX_TOLERANCES)]
    return Annotated[
        Annotated[value, Tag(tag("one"))] | Annotated[several, Tag(tag("several"))],
        Discriminator(_one_or_several),
    ]


def _one_or_several(value: Any) -> str:
    return tag("several") if isinstance(value, list | tuple) else tag("one")


def has_tolerances(scheme: Scheme, option: AnyOption) -> bool:
    """Tell whether an option of a scheme may be a list of tolerances."""
    return scheme.adaptive and option.name == TOLERANCE and isinstance(option, NumberOption)


def scheme_names(data: Any) -> Iterator[str]:
    """Yield the names that a list of schemes gives as written, right or wrong."""
    for item in data if isinstance(data, list) else ():
        name = item if not isinstance(item, Mapping) else item.get("label") or item.get("kind")
        if not isinstance(name, str):
            continue
        several = item.get(TOLERANCE) if isinstance(item, Mapping) else None
        if not isinstance(several, list):
            yield name
            continue
        for value in several[:MAX_TOLERANCES]:
            try:
                yield tolerance_name(name, number(value))
            except PydanticCustomError:
                continue
