"""The JSON Schema of ``summary.json`` (`workflow/schemas.py` writes its file).

What a result may state follows from the fields of each kind of check.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from vibsim.checks import reductions
from vibsim.checks.fields import Field, result_fields
from vibsim.checks.kinds import KINDS
from vibsim.checks.order import BESIDE
from vibsim.checks.solver_facts import LEVELS, SOLVER_FACTS
from vibsim.checks.tolerance import BOUND
from vibsim.core.vocabulary import BY_TOLERANCE, FORMAT, MEMBER, REASON_NAMES, STATUSES
from vibsim.experiment.citation import FIELDS

TEXT = {"type": "string"}
NUMBER = {"type": ["number", "null"]}
COUNT = {"type": "integer", "minimum": 0}
STATUS = {"enum": list(STATUSES)}
REASON = {"enum": list(REASON_NAMES)}


def _object(
    properties: Mapping[str, Any], optional: Iterable[str] = (), **more: Any
) -> dict[str, Any]:
    """Return the schema of an object that has these keys and no others."""
    return {
        "type": "object",
        "properties": dict(properties),
        "required": [name for name in properties if name not in optional],
        "additionalProperties": False,
        **more,
    }


SOURCE = {
    "anyOf": [
        {"type": "null"},
        _object(
            {name: TEXT if name == "text" else {"type": ["string", "null"]} for name in FIELDS}
        ),
    ],
    "description": "the text where it stands, and the numbers of what is meant there",
}


def _fact(field: Field) -> dict[str, Any]:
    """Return the schema of a fact."""
    if field.words:
        return {"enum": list(field.words), "description": field.meaning}
    kind = "integer" if np.issubdtype(field.type, np.integer) else "number"
    several = {"type": ["array", "null"], "items": {"type": kind}}
    one = {"type": [kind, "null"]}
    return (several if len(field.dims) > len(MEMBER) else one) | {"description": field.meaning}


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a summary."""
    facts = []
    for kind, row in KINDS.items():
        of_kind = {name: _fact(field) for name, field in result_fields(row.fields).items()}
        if kind == "converges":
            of_kind |= {name: _fact(field) for name, field in BESIDE.items()}
        facts.append(_object(of_kind, title=f"facts of a check `{kind}`"))
        if kind == "value":
            of_all = of_kind | {name: _fact(field) for name, field in reductions.FACTS.items()}
            facts.append(_object(of_all, title="facts of a check `value` with `take`"))
    reached = {"error_bound": _fact(BOUND), "state": TEXT}
    facts.append(_object(reached, title=f"facts of the check `{BY_TOLERANCE}`"))
    for kind, meanings in SOLVER_FACTS.items():
        of_kind = {name: NUMBER | {"description": text} for name, text in meanings.items()}
        if kind == "converges":
            several = {"type": ["array", "null"], "items": {"type": "number"}}
            of_kind |= {name: several | {"description": text} for name, text in LEVELS.items()}
        facts.append(_object(of_kind, title=f"facts of a check `{kind}` on a solver of the user"))
    member = {"values": {"type": "object"}, "command": TEXT}
    result = {
        "scheme": TEXT,
        "case": COUNT,
        "status": STATUS,
        "reason": REASON,
        "facts": {"anyOf": facts},
        "sentence": TEXT,
        **member,
    }
    check = {
        "id": TEXT,
        "kind": {"enum": [*KINDS, "claim", BY_TOLERANCE]},
        "text": TEXT,
        "quantity": {"type": ["string", "null"]},
        "expected": TEXT,
        "status": STATUS,
        "reason": REASON,
        "advice": TEXT,
        "results": {"type": "array", "items": _object(result, member)},
        "counts": _object(dict.fromkeys(STATUSES, COUNT)),
        "where": {"type": "object"},
        "note": {"type": ["string", "null"]},
        "source": SOURCE,
    }
    failure = {
        "scheme": TEXT,
        "level": COUNT,
        "case": COUNT,
        "t": NUMBER,
        "step": COUNT,
        "error": TEXT,
        **member,
    }
    whole = {
        "vibsim_format": {"const": FORMAT},
        "collection": TEXT,
        "experiment": TEXT,
        "title": TEXT,
        "source": SOURCE,
        "status": STATUS,
        "checks": {"type": "array", "items": _object(check)},
        "failures": {"type": "array", "items": _object(failure, member)},
        "failure_count": COUNT,
        "settings": {
            "type": "array",
            "items": TEXT,
            "description": "what the command line gave in place of values of the file, as KEY=VALUE",
        },
        "digest": TEXT,
        "integrity": TEXT,
    }
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "summary.json"}
    return head | _object(whole, ("settings", "digest", "integrity"))
