"""The JSON Schemas of the output of ``vibsim run --json`` and ``vibsim plan --json`` (see `workflow/schemas.py`)."""

from __future__ import annotations

from typing import Any

from pydantic import TypeAdapter

from vibsim.analysis import summary_schema
from vibsim.core.json_schema import COUNT, DRAFT, STATUS, TEXT, list_of, object_of
from vibsim.core.vocabulary import FORMAT
from vibsim.plan import Plan


def run() -> dict[str, Any]:
    """Return the schema of the outcome of a run, or of a dry run."""
    summary = {
        key: value
        for key, value in summary_schema.schema().items()
        if key not in ("$schema", "title")
    }
    lost = object_of(
        {
            "collection": TEXT,
            "experiment": TEXT,
            "title": TEXT,
            "status": {"const": "FAIL"},
            "checks": {"type": "array", "maxItems": 0},
            "failures": {"type": "array", "maxItems": 0},
            "error": TEXT | {"description": "why it has no summary"},
        }
    )
    failed = object_of(
        {
            "job": TEXT,
            "log": TEXT | {"description": "path of the log"},
            "tail": list_of(TEXT) | {"description": "the last lines of the log"},
        }
    )
    outcome = object_of(
        {
            "vibsim_format": {"const": FORMAT},
            "status": STATUS,
            "results": TEXT | {"description": "path of the results folder"},
            "experiments": list_of(
                {"anyOf": [{"$ref": "#/$defs/summary"}, {"$ref": "#/$defs/lost"}]}
            ),
            "failed_jobs": list_of(failed),
        }
    ) | {"title": "vibsim run --json"}
    job = object_of(
        {"job": TEXT, "rule": TEXT, "reason": TEXT | {"description": "as Snakemake states it"}}
    )
    dry = object_of({"jobs": list_of(job)}) | {"title": "vibsim run --dry-run --json"}
    definitions = {"summary": summary, "lost": lost}
    return DRAFT | {"title": "outcome of a run", "anyOf": [outcome, dry], "$defs": definitions}


def plan() -> dict[str, Any]:
    """Return the schema of the plans of experiments."""
    schema = TypeAdapter(Plan).json_schema(ref_template="#/$defs/{model}")
    definitions = schema.pop("$defs")
    total = object_of(
        {
            "jobs": COUNT,
            "member_steps": COUNT,
            "bytes": COUNT | {"description": "estimated size of all files, with the page"},
            "memory": COUNT | {"description": "estimated memory of the largest job, in bytes"},
            "seconds": {
                "type": "number",
                "description": "estimated time of the steps and files of all levels on one core",
            },
            "cpu_seconds": {"type": "number", "description": "estimated CPU time of a whole run"},
            "wall_seconds": {
                "type": "object",
                "description": "estimated time of a whole run, by number of cores: 1, and all of this machine",
                "additionalProperties": {"type": "number"},
            },
        }
    )
    schema["properties"]["total"] = total
    # every field is printed, even if it has its default value
    for row in (schema, *definitions.values()):
        row["required"] = list(row["properties"])
    return DRAFT | {"title": "vibsim plan --json"} | list_of(schema) | {"$defs": definitions}
