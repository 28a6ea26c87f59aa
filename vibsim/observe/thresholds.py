"""Thresholds of this package: value, meaning and origin.

The origin is in brackets: *derived* from the motion or the arithmetic; *checked*: chosen, and confirmed on runs of
every scheme (``tests/analysis/checks/test_drift_of_real_runs.py``, ``tests/analysis/observe/test_recurrence.py`` and
``test_shift.py``); *convention* or *chosen*: a matter of choice.
"""

from __future__ import annotations

import math

import numpy as np

# ---- Levels that belong together

# Largest difference of the initial values of levels, relative to the state: above the rounding of an exact solution.
# [convention]
SAME_START = 1e-9
# The same relative to the largest state: rounding of a state that is at rest beside others.
# [convention]
ROUNDED_START = 2.0**-40

# ---- The size of a motion

# Distance of common times, in units of 1/w, above which they may miss the amplitude of a motion by an eighth. [derived]
FEW_RADIANS = 0.5
PIECES_OF_TIME = 8  # number of time scales in the run of a motion without a period [convention]
# Least fraction of the time in which the stiffness must be at least a quarter of that at 0 (half the frequency) for the
# natural frequency to count. [convention]
A_WHILE = 0.1

# ---- Disturbances

# Relative disturbance of a state: above the rounding of an exact solution, with a linear response. [derived]
DISTURBANCE = 1e-12
PLACES = 8  # number of times along the run at which a disturbance is tried [convention]
INSTANT = 1e-6  # a time in units of 1/w over which the motion is linear in time [convention]
# A start counts as next to an equilibrium if its speed, relative to w times the size of the motion, is below this:
# the shift in time (`sensitivity`) is then so large that the rounding of the disturbed solution dominates. [convention]
NEAR_REST = 1e-3

# ---- Energy drift

LEAST_PERIODS = 4.0  # T/8 is then half a period, the period of the energy error [derived]
LEAST_SAMPLES = 32  # samples on [0, T], four of them on the shortest window [derived]
# Samples per period that resolve its extrema to 2 %; with fewer the range is not used. [derived]
LEAST_PER_PERIOD = 16.0
STILL = 0.01  # relative rise of M between windows that counts as no rise [checked]
STILL_CREEPS = 0.2  # largest relative rise of a maximum that is only sampled better [checked]
CREEP = -0.5  # largest k of such a rise [checked]
SMALL_RISE = 0.1  # relative rise of M from which on it need not continue until the end [chosen]
STILL_WIDENS = 0.5  # least rise in the last T/8 relative to that of a steady drift [checked]
BOTH_MOVE = 0.5  # least ratio of the slower to the faster end of the range of a drift [chosen]
NEAR_POWER = 0.25  # tolerance of k at 1 or 2: a quarter of their distance [derived]
# |ln(E/E(0))| above which exponential and linear growth differ in k by more than rounding: by about 0.1 at 0.2.
# [derived]
LARGE_CHANGE = 0.2
SMALLEST_NORMAL = float(np.finfo(np.float64).tiny)  # smaller numbers have fewer digits [derived]
# Largest round-off of a conserved energy, in units of ``N p + N^(1/2) p^2`` unit round-offs: 1.02 was seen. [checked]
STEPPED = 4.0
# Fraction of the energy above which a deviation never counts as rounding, however large the step. [convention]
MOST_ROUNDED = 1e-3

# ---- The recurrence of a linear oscillation

LEAST_STEPS = 8  # fewer steps leave too few after the start [convention]
# Squared relative size of the differences orthogonal to the positions, below which there is a single root. [derived]
SINGULAR = 1e-24
# Root mean square of the weighted residuals that counts as rounding: at most 2^-45 up to w dt = 30. [checked]
RECURRENCE_ROUNDING = 2.0**-44
# The same for larger steps, whose rounding errors are of the size w^2 dt^2: above, there is no recurrence. [checked]
RESIDUAL = 1e-11
# Ratio of early to late residuals in the window above which they are a decaying parasitic root, not rounding. [checked]
FADES = 4.0
LEAST_LEFT = 16  # steps in each half of the window that this ratio requires [convention]

# ---- Phase and amplitude

# Samples of all schemes, members and levels up to which the parts are computed without being requested. [convention]
MOST_UNASKED = 2**14
HALF_WINDOW = 8  # points of a window on each side of its centre [convention]
WINDOW_POINTS = 2 * HALF_WINDOW + 1
LEAST_PER_SHIFT = 6  # fewest points per period for a shift to be measured [checked]
SHORTEST_RUN = 0.6  # shortest run, in periods [checked]
# Pairs (largest shift in radians, iterations of Newton's method); each iteration doubles the correct digits. [checked]
ROUNDS = ((0.02, 4), (0.5, 6), (math.inf, 10))
# Largest correction in the last iteration, in radians and relative to the amplitude. [checked]
LAST_ROUND_MOVES = 1e-6
LARGE_SHIFT = ROUNDS[1][0]  # radians: larger shifts are guessed from the phase plane [checked]
# Fraction of a cell by which a shifted point may lie beyond the ends of the template. [convention]
BEYOND_THE_ENDS = 0.5
