"""The facts of a result on the levels of a user's solver, by the kind of check."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from vibsim.convergence.study.verdict_schema import NUMBERS

_ERROR = {
    "error": NUMBERS["error"],
    "error_bound": NUMBERS["error_bound"],
    "relative_error": "size of the error of the finest level over that of the solution",
    "best": NUMBERS["best"],
    "best_bound": NUMBERS["best_bound"],
    "gci": NUMBERS["gci"],
}
SOLVER_FACTS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "converges": {
            "order": NUMBERS["order"],
            "order_low": NUMBERS["order_low"],
            "order_high": NUMBERS["order_high"],
            "promised": "order that is expected",
            **_ERROR,
        },
        "accurate": {
            **_ERROR,
            "size": "size of the solution: a number, or the root mean square of a series or field",
            "accuracy": "error that is allowed, relative or absolute as the check asks",
        },
    }
)
"""Numbers and their meanings; None if the levels do not determine them."""
LEVELS = MappingProxyType(
    {
        "levels": "first and last level that the order rests on",
        "h_used": "step sizes of the levels that the order rests on",
    }
)
"""Additional lists of numbers of `converges`."""
