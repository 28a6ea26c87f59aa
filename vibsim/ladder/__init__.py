"""The ladder as a product: the solution to a tolerance, from the cheapest levels that reach it, extrapolated.

One level of a second-order scheme is a poor solver; several of them, extrapolated, are a very good one, which bounds
its own error. `best` gives the extrapolated solution of an experiment in memory, without files. `resolve` chooses the
levels of an experiment that names a tolerance. `solve` is what both stand on.
"""

from vibsim.comparison.extrapolate_members import Extrapolated, Method, Start
from vibsim.ladder.choosing import resolve
from vibsim.ladder.product import best
from vibsim.ladder.solving import climb, solve

__all__ = ["Extrapolated", "Method", "Start", "best", "climb", "resolve", "solve"]
