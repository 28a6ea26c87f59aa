"""Comparison of levels: differences, orders, error estimates, and the verdict on whether to believe them.

Pure: arrays in, arrays out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import loader

if TYPE_CHECKING:
    from vibsim.analysis.blockwise import analyse_parts, joined, kept
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
    "joined",
    "kept",
    "summarise",
    "verdicts",
]

__getattr__ = loader(
    __name__,
    {
        "Result": "vibsim.checks.outcome",
        "Verdict": "vibsim.analysis.check_verdicts",
        "analyse": "vibsim.analysis.compare_levels",
        "analyse_parts": "vibsim.analysis.blockwise",
        "analyse_records": "vibsim.analysis.compare_levels",
        "joined": "vibsim.analysis.blockwise",
        "kept": "vibsim.analysis.blockwise",
        "summarise": "vibsim.analysis.summary",
        "verdicts": "vibsim.analysis.check_verdicts",
    },
)


def __dir__() -> list[str]:
    return __all__
