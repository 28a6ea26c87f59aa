"""The JSON Schemas of what ``--json`` of a run and of a plan prints (`workflow/schemas.py` writes their files)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter

from vibsim.analysis import summary_schema
from vibsim.analysis.summary_schema import COUNT, STATUS, TEXT
from vibsim.core.vocabulary import FORMAT
from vibsim.plan import Plan

_HEAD = {"$schema": "https://json-schema.org/draft/2020-12/schema"}


def _object(**properties: Any) -> dict[str, Any]:
    """Return the schema of an object that has these keys and no others."""
    return {
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }


def _list(items: Mapping[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": items}


def run() -> dict[str, Any]:
    """Return the schema of the outcome of a run, or of a dry run."""
    summary = {
        key: value
        for key, value in summary_schema.schema().items()
        if key not in ("$schema", "title")
    }
    lost = _object(
        collection=TEXT,
        experiment=TEXT,
        title=TEXT,
        status={"const": "FAIL"},
        checks={"type": "array", "maxItems": 0},
        failures={"type": "array", "maxItems": 0},
        error=TEXT | {"description": "why it has no summary"},
    )
    failed = _object(
        job=TEXT,
        log=TEXT | {"description": "path of the log"},
        tail=_list(TEXT) | {"description": "the last lines of the log"},
    )
    outcome = _object(
        vibsim_format={"const": FORMAT},
        status=STATUS,
        results=TEXT | {"description": "path of the results folder"},
        experiments=_list({"anyOf": [{"$ref": "#/$defs/summary"}, {"$ref": "#/$defs/lost"}]}),
        failed_jobs=_list(failed),
    ) | {"title": "vibsim run --json"}
    job = _object(job=TEXT, rule=TEXT, reason=TEXT | {"description": "in words of Snakemake"})
    dry = _object(jobs=_list(job)) | {"title": "vibsim run --dry-run --json"}
    definitions = {"summary": summary, "lost": lost}
    return _HEAD | {"title": "outcome of a run", "anyOf": [outcome, dry], "$defs": definitions}


def plan() -> dict[str, Any]:
    """Return the schema of the plans of experiments."""
    found = TypeAdapter(Plan).json_schema(ref_template="#/$defs/{model}")
    definitions = found.pop("$defs")
    total = _object(
        jobs=COUNT,
        member_steps=COUNT,
        bytes=COUNT | {"description": "of all files"},
        memory=COUNT | {"description": "bytes of the largest job"},
        seconds={
            "type": "number",
            "description": "of one core, of the steps and files of all levels",
        },
        cpu_seconds={"type": "number", "description": "CPU time of a whole run"},
        wall_seconds={
            "type": "object",
            "description": "time of a whole run, by the number of cores: 1, and those at hand",
            "additionalProperties": {"type": "number"},
        },
    )
    found["properties"]["total"] = total
    # every field is printed, also one with a default
    found["required"] = list(found["properties"])
    for row in (found, *definitions.values()):
        row["required"] = list(row["properties"])
    return _HEAD | {"title": "vibsim plan --json"} | _list(found) | {"$defs": definitions}
