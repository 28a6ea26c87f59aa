"""Comparison of levels: differences, orders, error estimates, and the verdict on whether to believe them.

Pure: arrays in, arrays out.
"""

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
