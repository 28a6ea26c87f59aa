"""Every number of this room that decides something: its value, its meaning, and where it comes from.

The origin stands in brackets: *derived* from the expansion of the error or the grid; *checked*, which
is chosen and confirmed on real runs (``tests/analysis/test_real_ladders.py``); or a *convention*, a size that was
chosen.
"""

from __future__ import annotations

# ---- Quantities

# Factor on an error bound behind events: where they lie in a step makes the second power another at each level.
# [checked]
IRREGULAR = 2.0
VANISHING_POINT = 1e-3  # a smaller part of the largest difference does not count [convention]
SHAPELESS_POINTS = 2  # series that differ at no more points have no shape [derived]
# Order with which a quantity that is promised to be exact is extrapolated: the finest level then stands as it is.
# [convention]
EXACT_ORDER = 16.0
STRAIGHT = (
    1e-3  # largest second differences of a straight line, over all that it changes [convention]
)
ORDER_WINDOW = 0.5  # length of the window of a local order, in periods [derived]

# ---- Causes of an order

# A rate of change that is no larger a part of its largest value, at every common time, vanishes there. [convention]
VANISHING_RATE = 1e-3
THEORY_ROUNDING = 1e-12  # an error of the theory that is no larger is rounding [convention]

# ---- Numbers

# Order of a peak that is interpolated by a parabola: its next term vanishes (docs/decisions.md). [derived]
OF_PARABOLA = 3.0
OF_GRID = 2.0  # order of an extremum over the points of the grid [derived]
# A straight line between two points is off by this part of dt^2 times the second derivative, at most. [derived]
OF_A_LINE = 0.125

# ---- Extrapolated members

# Largest w dt at which rounding errors are measured: with a longer step, the scheme itself may magnify them.
# [convention]
RESOLVED_STEP = 1.0
RECENT = (
    16  # so many last times guard an end formula of its own against zero crossings [convention]
)
LONG_RUN = 2**20  # number of steps for which arithmetics are compared [convention]
