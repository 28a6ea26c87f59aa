"""The source of a statement in an experiment file: one line, or a mapping (`vibsim.experiment.citation`)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, WithJsonSchema

from vibsim.experiment.citation import FIELDS, LIST, line
from vibsim.experiment.schema.fields import Text, refused


def _as_line(raw: Any) -> Any:
    """Return the line for a mapping with some of the `FIELDS`, and any other value unchanged."""
    if not isinstance(raw, Mapping):
        return raw
    for name, value in raw.items():
        if name not in FIELDS:
            raise refused(f"must have the keys {', '.join(FIELDS)} and no others, has {name}")
        if not isinstance(value, str):
            # the number 10.10 would be section 10.1
            raise refused(f'has a {name} that is no text: write "..." around it')
        if name != "text" and not LIST.fullmatch(value):
            raise refused(f"has a {name} that is no number such as 10.2, or several: {value}")
    if not raw.get("text"):
        raise refused("must name a text")
    return line({name: re.sub("[()]", "", value) for name, value in raw.items()})


Citation = Annotated[
    Text,
    BeforeValidator(_as_line),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string", "minLength": 1},
                {
                    "type": "object",
                    "properties": {
                        name: {"type": "string", "description": meaning}
                        for name, meaning in FIELDS.items()
                    },
                    "required": ["text"],
                    "additionalProperties": False,
                },
            ]
        }
    ),
]
"""A source: a line, or a mapping from `FIELDS` to text, which is converted to a line."""
