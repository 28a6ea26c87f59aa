"""Comparison of levels: differences, orders, error estimates, and the verdict on whether to believe them.

Pure: arrays in, arrays out.
"""

from vibsim.analysis.assemble import analyse, analyse_records
from vibsim.analysis.checks import Verdict, verdicts
from vibsim.analysis.parts import analyse_parts, joined, kept
from vibsim.analysis.results import Result
from vibsim.analysis.summary import summarise

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
