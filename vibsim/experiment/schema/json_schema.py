"""The JSON Schema of experiment files, for editors (`workflow/schemas.py` writes its file)."""

from __future__ import annotations

from typing import Any

from pydantic.json_schema import GenerateJsonSchema

from vibsim.experiment.schema.document import Document


class _Generator(GenerateJsonSchema):
    """Leaves out the titles that pydantic makes from the names of keys."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of an experiment file."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return head | Document.model_json_schema(schema_generator=_Generator)
