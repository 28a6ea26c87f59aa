"""The JSON Schema of ``summary.json``, which `workflow/schemas.py` writes to a file.

The facts that a result may contain follow from the fields of each kind of check.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.checks import reductions
from vibsim.checks.experiment_tolerance import BOUND
from vibsim.checks.fields import Field, result_fields
from vibsim.checks.kinds import KINDS
from vibsim.checks.order import OTHER_FACTS
from vibsim.checks.solver_facts import LEVELS, SOLVER_FACTS
from vibsim.core.json_schema import (
    COUNT,
    DRAFT,
    REASON,
    STATUS,
    TEXT,
    list_of,
    object_of,
    or_null,
)
from vibsim.core.vocabulary import BY_TOLERANCE, FORMAT, MEMBER, STATUSES
from vibsim.experiment.citation import FIELDS

SOURCE = {
    "anyOf": [
        {"type": "null"},
        object_of({name: TEXT if name == "text" else or_null("string") for name in FIELDS}),
    ],
    "description": "the cited text, and the numbers of its section, equation, figure and exercise",
}


def _fact(field: Field) -> dict[str, Any]:
    """Return the schema of a fact."""
    if field.words:
        return {"enum": list(field.words), "description": field.meaning}
    kind = "integer" if np.issubdtype(field.type, np.integer) else "number"
    is_list = len(field.dims) > len(MEMBER)
    value = list_of({"type": kind}, or_null=True) if is_list else or_null(kind)
    return value | {"description": field.meaning}


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a summary."""
    facts = []
    for kind, row in KINDS.items():
        of_kind = {name: _fact(field) for name, field in result_fields(row.fields).items()}
        if kind == "converges":
            of_kind |= {name: _fact(field) for name, field in OTHER_FACTS.items()}
        facts.append(object_of(of_kind, title=f"facts of a check `{kind}`"))
        if kind == "value":
            of_all = of_kind | {name: _fact(field) for name, field in reductions.FACTS.items()}
            facts.append(object_of(of_all, title="facts of a check `value` with `take`"))
    reached = {"error_bound": _fact(BOUND), "state": TEXT}
    facts.append(object_of(reached, title=f"facts of the check `{BY_TOLERANCE}`"))
    for kind, meanings in SOLVER_FACTS.items():
        of_kind = {
            name: or_null("number") | {"description": text} for name, text in meanings.items()
        }
        if kind == "converges":
            several = list_of({"type": "number"}, or_null=True)
            of_kind |= {name: several | {"description": text} for name, text in LEVELS.items()}
        facts.append(object_of(of_kind, title=f"facts of a check `{kind}` on a solver of the user"))
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
        "quantity": or_null("string"),
        "expected": TEXT,
        "status": STATUS,
        "reason": REASON,
        "advice": TEXT,
        "results": list_of(object_of(result, member)),
        "counts": object_of(dict.fromkeys(STATUSES, COUNT)),
        "where": {"type": "object"},
        "note": or_null("string"),
        "source": SOURCE,
    }
    failure = {
        "scheme": TEXT,
        "level": COUNT,
        "case": COUNT,
        "t": or_null("number"),
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
        "checks": list_of(object_of(check)),
        "failures": list_of(object_of(failure, member)),
        "failure_count": COUNT,
        "settings": list_of(TEXT)
        | {
            "description": "values of the command line that replace those of the file, as KEY=VALUE"
        },
        "digest": TEXT,
        "integrity": TEXT,
    }
    head = DRAFT | {"title": "summary.json"}
    return head | object_of(whole, ("settings", "digest", "integrity"))
