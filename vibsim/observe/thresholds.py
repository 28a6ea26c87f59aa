"""Every number of this room that decides something: its value, its meaning, and where it comes from.

The origin stands in brackets: *derived* from the motion or the arithmetic; *checked*, which is chosen and confirmed on
runs of every scheme (``tests/analysis/checks/test_drift_of_real_runs.py``, ``test_recurrence.py``,
``test_shift.py``); or a *convention*, a size that was chosen.
"""

from __future__ import annotations

import math

import numpy as np

# ---- Levels that belong together

# Levels start from the same values, to this part of the state's size: above the rounding of an exact solution.
# [convention]
SAME_START = 1e-9

# ---- The size of a motion

# Common times further apart, in units of 1/w, may miss the turns of a motion: the largest by an eighth. [derived]
FEW_RADIANS = 0.5
PIECES_OF_TIME = 8  # a motion without a period is looked at in so many parts [convention]
# Part of the time for which the motion is at least a quarter as stiff as at 0, half the frequency, where 0 counts.
# [convention]
A_WHILE = 0.1

# ---- Disturbances

# Relative disturbance of a state: above the rounding of an exact solution, below what bends most responses. [derived]
DISTURBANCE = 1e-12
PLACES = 8  # at so many times along the run a disturbance is tried [convention]
INSTANT = 1e-6  # a time in units of 1/w over which the motion is straight [convention]
# A start whose motion is so much slower than w times its size is next to an equilibrium: there C is so large that what
# is left of a difference between two of its values is the rounding of the disturbed solution. [convention]
NEAR_REST = 1e-3

# ---- Pulses

# Gaps between points that are looked at; of larger runs wider ones, and then those around a pulse. [convention]
MOST_GAPS = 2**21

# ---- Energy drift

LEAST_PERIODS = 4.0  # T/8 is then half a period, by which the energy error repeats [derived]
LEAST_SAMPLES = 32  # samples on [0, T], four of them on the shortest window [derived]
# Samples in a period that see its extrema to 2 %: the range of fewer says nothing. [derived]
LEAST_PER_PERIOD = 16.0
STILL = 0.01  # rise of M from one window to the next, as a part of itself, that is none [checked]
STILL_CREEPS = 0.2  # largest rise of a maximum that is found more exactly with time only [checked]
CREEP = -0.5  # largest k of such a rise [checked]
SMALL_RISE = (
    0.1  # rise of M as a part of itself from which on it need not go on until the end [chosen]
)
STILL_WIDENS = 0.5  # least part of a drift's rise by which the range of a drift widens in the last T/8 [checked]
BOTH_MOVE = 0.5  # a drift moves both ends of its range alike: the slower by this part of the faster [chosen]
NEAR_POWER = 0.25  # distance of k from 1 or 2: a quarter of what separates them [derived]
# ln(E/E(0)) beyond which exponential and linear growth differ in k by more than rounding: by about 0.1 at 0.2.
# [derived]
LARGE_CHANGE = 0.2
SMALLEST_NORMAL = float(np.finfo(np.float64).tiny)  # what is below has lost digits [derived]
# How often ``N p + N^(1/2) p^2`` round-offs may be in the energy of a scheme that keeps it: 1.02 was seen. [checked]
STEPPED = 4.0
# Part of the energy above which a deviation is never called rounding, however large the step. [convention]
MOST_ROUNDED = 1e-3

# ---- The recurrence of a linear oscillation

LEAST_STEPS = 8  # fewer steps leave too little behind the start [convention]
# Of the part of the differences that is no multiple of the positions, squared: below, there is one root. [derived]
SINGULAR = 1e-24
# Root mean square of what is left of the weighted steps when only rounding is: at most 2^-45 up to w dt = 30. [checked]
RECURRENCE_ROUNDING = 2.0**-44
# The same for larger steps, whose rounding errors are some w^2 dt^2 large: above, there is no recurrence. [checked]
RESIDUAL = 1e-11
# What is left of a parasitic root is so many times larger early in the window than late; rounding is not. [checked]
FADES = 4.0
LEAST_LEFT = 16  # steps in each half of the window of which that can be told [convention]

# ---- Phase and amplitude

# Samples of all schemes, members and levels up to which the parts are looked at without being asked for. [convention]
MOST_UNASKED = 2**14
HALF_WINDOW = 8  # points of a window on each side of its centre [convention]
WINDOW_POINTS = 2 * HALF_WINDOW + 1
LEAST_PER_SHIFT = 6  # points in a period, at least, for a shift to be seen [checked]
SHORTEST_RUN = 0.6  # part of a period that a run must last [checked]
# Rounds of Newton's method by the largest shift that is met, in radians: each doubles the right digits. [checked]
ROUNDS = ((0.02, 4), (0.5, 6), (math.inf, 10))
# Part of a radian, and of the amplitude, by which the last round may still have moved anything. [checked]
LAST_ROUND_MOVES = 1e-6
LARGE_SHIFT = ROUNDS[1][0]  # shifts beyond it, in radians, are read from the phase plane [checked]
# Part of a cell by which a shifted point may lie beyond the ends of the template. [convention]
BEYOND_THE_ENDS = 0.5
