"""Compare the levels of an experiment, decide its checks and summarise them. No file is read or written."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import lazy

if TYPE_CHECKING:
    from vibsim.analysis.blockwise import analyse_parts, join_parts, keep_for_verdicts
    from vibsim.analysis.check_verdicts import Verdict, verdicts
    from vibsim.analysis.compare_levels import analyse, analyse_records
    from vibsim.analysis.summary import summarise
    from vibsim.checks.outcome import Result

__all__ = [
    "Result",
    "Verdict",
    "analyse",
    "analyse_parts",
    "analyse_records",
    "join_parts",
    "keep_for_verdicts",
    "summarise",
    "verdicts",
]

__getattr__, __dir__ = lazy(
    __name__,
    {
        ".blockwise": ("analyse_parts", "join_parts", "keep_for_verdicts"),
        ".check_verdicts": ("Verdict", "verdicts"),
        ".compare_levels": ("analyse", "analyse_records"),
        ".summary": ("summarise",),
        "vibsim.checks.outcome": ("Result",),
    },
)
