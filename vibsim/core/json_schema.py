"""Building blocks for the JSON Schemas (draft 2020-12) of files and of the output of commands."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from vibsim.core.vocabulary import REASON_NAMES, STATUSES

DRAFT = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
TEXT = {"type": "string"}
COUNT = {"type": "integer", "minimum": 0}
STATUS = {"enum": list(STATUSES)}
REASON = {"enum": list(REASON_NAMES)}


def object_of(
    properties: Mapping[str, Any], optional: Iterable[str] = (), **more: Any
) -> dict[str, Any]:
    """Return the schema of an object with these keys and no others."""
    return {
        "type": "object",
        "properties": dict(properties),
        "required": [name for name in properties if name not in optional],
        "additionalProperties": False,
        **more,
    }


def list_of(items: Mapping[str, Any], *, or_null: bool = False) -> dict[str, Any]:
    """Return the schema of a list of items, optionally also null."""
    return {"type": ["array", "null"] if or_null else "array", "items": items}


def or_null(kind: str) -> dict[str, Any]:
    """Return the schema of a value of type `kind` or null."""
    return {"type": [kind, "null"]}
