"""Comparison of levels: differences, orders, error estimates, and the verdict on whether to believe them.

Pure: arrays in, arrays out.
"""

from vibsim.analysis.assemble import analyse, analyse_records
from vibsim.analysis.checks import Result, Verdict, verdicts
from vibsim.analysis.summary import summarise

__all__ = ["Result", "Verdict", "analyse", "analyse_records", "summarise", "verdicts"]
