"""Solve to a tolerance: choose the cheapest ladder of levels that reaches it, and extrapolate the solution over it.

One level of a second-order scheme is a poor solver; several levels, extrapolated, are a very good one that also bounds
its error. `best` returns the extrapolated solution of an experiment, without files. `resolve` chooses the levels of an
experiment that names a tolerance. Both use `climb`, of which `solve` is a version with as little overhead as possible.
"""

from vibsim.comparison.extrapolate_members import Extrapolated, Method, Start
from vibsim.ladder.choosing import resolve
from vibsim.ladder.product import best
from vibsim.ladder.solving import climb, solve

__all__ = ["Extrapolated", "Method", "Start", "best", "climb", "resolve", "solve"]
