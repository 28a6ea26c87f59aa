"""The thresholds of this room: value, meaning and origin.

The origin stands in brackets: *derived* from the expansion of the error or the grid; *checked*: chosen, and confirmed
on real runs (``tests/analysis/test_real_ladders.py``); or a *convention*: a chosen size.
"""

from __future__ import annotations

# ---- Quantities

# Factor on an error bound after events: their position within a step changes the second power at each level. [checked]
IRREGULAR = 2.0
VANISHING_POINT = 1e-3  # smaller parts of the largest difference count as 0 [convention]
SHAPELESS_POINTS = 2  # series that differ at no more points have no shape [derived]
# Order that extrapolates a quantity promised to be exact: the finest level then stays as it is. [convention]
EXACT_ORDER = 16.0
# An extrapolation further from the exact solution than this multiple of its bound has another limit. [convention]
WRONG_LIMIT = 3.0
STRAIGHT = 1e-3  # largest second difference of a straight line, over its total change [convention]

# ---- Series over time

ORDER_WINDOW = 0.5  # length of the window of a local order, in periods [derived]
ZERO_CROSSING = 0.1  # a denominator below this part of its local scale crosses zero [convention]
LEAST_WINDOW = 3  # points of the shortest window of a local order [convention]
# The last point is compared alone if its differences are at least this part of those in the last window. [convention]
LAST_POINT_ALONE = 0.5

# ---- Causes of an order

VANISHING_RATE = 1e-3  # a rate of change vanishes below this part of its largest value [convention]
THEORY_ROUNDING = 1e-12  # smaller errors in theory are rounding [convention]

# ---- Numbers

# Order of a peak interpolated by a parabola: its next term vanishes (docs/decisions.md). [derived]
ORDER_OF_PARABOLA = 3.0
ORDER_OF_GRID = 2.0  # order of an extremum over grid points [derived]
# Largest error of linear interpolation, over dt^2 times the second derivative. [derived]
ERROR_OF_LINE = 0.125

# ---- Extrapolated members

# Largest w dt at which rounding errors are measured: with longer steps the scheme itself may amplify them. [convention]
RESOLVED_STEP = 1.0
RECENT = 16  # last times that protect a special end formula against zero crossings [convention]
LONG_RUN = 2**20  # number of steps for which arithmetics are compared [convention]
