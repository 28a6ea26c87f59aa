"""The JSON Schema of experiment files, for editors: ``python -m vibsim.experiment.schema.json_schema [--check]``."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from pydantic.json_schema import GenerateJsonSchema

from vibsim.experiment.schema.document import Document

FILE = Path("workflow") / "schemas" / "experiment.schema.json"
"""Where the schema is kept, in the checkout."""


class _Generator(GenerateJsonSchema):
    """Leaves out the titles that pydantic makes from the names of keys."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of an experiment file."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return head | Document.model_json_schema(schema_generator=_Generator)


def text() -> str:
    """Return the schema as it is kept."""
    return json.dumps(schema(), indent=2, ensure_ascii=False) + "\n"


def main(arguments: list[str], root: Path) -> int:
    """Write the schema, or with ``--check`` tell whether the one kept is current (0) or not (1)."""
    path = root / FILE
    if "--check" in arguments:
        is_current = path.is_file() and path.read_text(encoding="utf-8") == text()
        print(f"{FILE} is {'current' if is_current else 'not current'}")
        return 0 if is_current else 1
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], Path(__file__).resolve().parents[3]))
