"""``summary.json`` against the JSON Schema that is kept for it."""

from __future__ import annotations

import json
from copy import deepcopy
from pathlib import Path

import jsonschema
import pytest

from .conftest import Runs
from .door import ROOT

SCHEMA = json.loads((ROOT / "workflow/schemas/summary.schema.json").read_text())


def summaries(runs: Runs) -> list[Path]:
    return sorted(runs.folder.rglob("summary.json"))


def test_every_summary_is_as_its_schema_says(runs: Runs) -> None:
    found = summaries(runs)
    assert len(found) > 3
    for path in found:
        jsonschema.validate(json.loads(path.read_text()), SCHEMA)


def test_the_schema_refuses_what_no_result_states(runs: Runs) -> None:
    content = json.loads(summaries(runs)[0].read_text())
    for spoil in ("unknown_fact", "reason", "sentence"):
        changed = deepcopy(content)
        result = changed["checks"][0]["results"][0]
        if spoil == "unknown_fact":
            result["facts"][spoil] = 1.0
        elif spoil == "reason":
            result[spoil] = "because"
        else:
            del result[spoil]
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(changed, SCHEMA)
