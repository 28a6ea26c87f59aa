"""The JSON Schema of the output of ``vibsim judge --json``, and of ``verdict.json`` next to its report."""

from __future__ import annotations

from typing import Any

from vibsim.convergence.study.verdict import KEYS
from vibsim.core.json_schema import DRAFT, REASON, STATUS, TEXT, list_of, object_of, or_null
from vibsim.core.vocabulary import FORMAT

NUMBERS = {
    "order": "observed order; a number wherever three levels give an estimate, whatever the status",
    "order_low": "lower end of its interval of 95 %",
    "order_high": "upper end of its interval of 95 %",
    "error": "error of the finest level: computed minus exact of a number, root mean square of a series or field",
    "error_bound": "what the size of that error does not exceed, in 95 % of such ladders",
    "best": "number extrapolated over the levels; null of a series or field",
    "best_bound": "what the error of `best` does not exceed",
    "gci": "grid convergence index of the finest level, relative, with safety factor 1.25",
}
"""Numbers of a verdict and their meaning; null if the levels do not determine them."""
TEXTS = {
    "quantity": "name of the column or the variable",
    "sentence": "the result in words",
    "advice": "what to do about it; empty if nothing needs to be done",
}


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12)."""
    fields: dict[str, Any] = {
        name: or_null("number") | {"description": text} for name, text in NUMBERS.items()
    }
    fields |= {name: TEXT | {"description": text} for name, text in TEXTS.items()}
    fields["status"], fields["reason"] = STATUS, REASON
    meaning = "step sizes of the levels that the order rests on, the coarsest first"
    fields["h_used"] = list_of({"type": "number"}) | {"description": meaning}
    verdicts = list_of(object_of({key: fields[key] for key in KEYS}))
    head = DRAFT | {"title": "verdicts of vibsim judge"}
    return head | object_of({"vibsim_format": {"const": FORMAT}, "verdicts": verdicts})
