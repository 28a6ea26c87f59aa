"""Every number of this room that decides something: its value, its meaning, and where it comes from.

The origin stands in brackets: *derived* from the expansion of the error or the grid; *checked*, which
is chosen and confirmed on real runs (``tests/analysis/test_analysis_real.py``); or a *convention*, a size that was
chosen.
"""

from __future__ import annotations

# Quantities

IRREGULAR = 2.0
"""Factor on an error bound behind events: where they lie in a step makes the second power another at each level.
[checked]"""
FEW_LEVELS = 3
"""With so many levels the directions of the true errors are needed as evidence, too. [derived]"""
VANISHING_POINT = 1e-3
"""A point at which a difference is a smaller part of its largest value does not count. [convention]"""
SHAPELESS_POINTS = 2
"""Series that differ at no more points have no shape. [derived]"""
EXACT_ORDER = 16.0
"""Order with which a quantity that is promised to be exact is extrapolated: the finest level then stands as it is.
[convention]"""
STRAIGHT = 1e-3
"""Second differences of a straight line are at most this part of all that it changes by. [convention]"""
ORDER_WINDOW = 0.5
"""Length of the window of a local order, in periods. [derived]"""

# Causes of an order

VANISHING_RATE = 1e-3
"""A rate of change that is no larger a part of its largest value, at every common time, vanishes there. [convention]"""
THEORY_ROUNDING = 1e-12
"""An error of the theory that is no larger is rounding. [convention]"""

# Numbers

OF_PARABOLA = 3.0
"""Order of a peak that is interpolated by a parabola: its next term vanishes (docs/decisions.md). [derived]"""
OF_GRID = 2.0
"""Order of an extremum over the points of the grid. [derived]"""
MISSED_EXTREMUM = 0.125
"""An extremum lies half a step from the next grid point at most: the part of w^2 dt^2 that is missed. [derived]"""

# Extrapolated members

RESOLVED_STEP = 1.0
"""Largest w dt at which rounding errors are measured: with a longer step, the scheme itself may magnify them.
[convention]"""
RECENT = 16
"""So many of the last times guard an end formula of its own against zero crossings. [convention]"""
LONG_RUN = 2**20
"""Number of steps for which arithmetics are compared. [convention]"""
