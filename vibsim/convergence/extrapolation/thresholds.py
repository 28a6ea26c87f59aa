"""The thresholds of error bars: value, meaning and origin.

The origin stands in brackets:

- *derived*: it follows from the expansion of the error;
- *calibrated*: set on seeds 1 and 3 of random ladders with known truth (``tests/analysis/synthetic.py``); the tables in
  ``docs/method.md``, Bounds of numbers, are for other seeds, which set none;
- *pendulums*: set on random ladders of pendulums and springs (``tests/analysis/test_extrapolation.py``);
- *convention*: a usual value of the field, or a chosen one.
"""

from __future__ import annotations

import math

# ---- Series

SERIES_SAFETY = 1.25  # as in grid convergence indices (P. J. Roache, 1994) [convention]

# ---- Numbers

MOST_COLUMNS = 5  # largest number of powers that are eliminated [convention]
# Relative distance of a ratio of changes from theory: of the last ratio, the previous one, a single one. [calibrated]
RATIO_TOLERANCE, PREVIOUS_RATIO_TOLERANCE, SINGLE_RATIO_TOLERANCE = 0.3, 0.6, 0.2
# Factors on a change if two ratios agree with theory, and if one does. [calibrated]
NUMBER_SAFETY, NUMBER_SAFETY_ALONE = 2.0, 4.0
# With one change only, at least this part of the last correction is the error. [calibrated]
LEAST_SHARE = 0.01
# `SINGLE_RATIO_TOLERANCE`, `NUMBER_SAFETY_ALONE` and `LEAST_SHARE` for three levels, whose only ratio may be an
# accident. [calibrated]
RATIO_TOLERANCE_OF_THREE, SAFETY_OF_THREE, LEAST_SHARE_OF_THREE = 0.05, 6.0, 0.03
# Factor on the range of the last three levels (L. Eca and M. Hoekstra, 2014), of the only three levels, and on the
# difference of two levels. [calibrated]
SPREAD, SPREAD_OF_THREE, SPREAD_OF_TWO = 3.0, 3.5, 4.0
# Lowest order at which that range covers the remaining error of changes that fall geometrically. [derived]
SLOWEST_ORDER = 0.5 * math.log2(1.0 + 1.0 / SPREAD)
# From this number of levels on, changes may fall raggedly: the last two to this part of the earlier ones. [calibrated]
RAGGED_LEVELS, RAGGED_DECLINE = 5, 0.5
ORDER_ABOVE_ROUND_OFF = 30.0  # differences this factor above their floor have an order [calibrated]
FALL_ABOVE_ROUND_OFF = 200.0  # differences this factor above their floor must fall [calibrated]
# Levels show another order than the promised one if the two differ by more than the first number, and the orders of two
# triples are within the second of one multiple of 1/2. [calibrated]
OTHER_ORDER_DISTANCE, HALF_ORDER_TOLERANCE = 0.3, 0.15
HIGHEST_ORDER = 12.0  # highest order considered [convention]

# ---- States

STATE_SAFETY = 2.0  # factor on the estimated truncation error [pendulums]
# Factor on the remaining error after one more extrapolation; the same for three levels, which have shown no gain yet.
# [pendulums]
GAIN_SAFETY, FIRST_GAIN_SAFETY = 5.0, 100.0
LARGEST_GAIN = 1e-3  # one more extrapolation leaves at least this part of an error [pendulums]
# A change that falls more slowly counts as falling by this factor: four times the change then remains. [convention]
LEAST_FALL = 1.25
KNOWN_DIGIT = 0.1  # an error above this part of the size is unknown [convention]

# ---- The grid convergence index

GCI_TRUSTED, GCI_CAUTIOUS = 1.25, 3.0  # the factor F (P. J. Roache, 1994) [convention]
# Largest relative deviation of the observed from the promised order (W. L. Oberkampf and C. J. Roy, 2010). [convention]
GCI_AGREES = 0.1
GCI_LEAST_ORDER = 0.5  # lowest order in the formula (the same) [convention]
GCI_FITTED, GCI_EXPONENTS = 5, 16  # fitted levels at most, and exponents tried [convention]
GCI_NEAR_ZERO = 0.05  # a number below this part of its scale has no relative index [convention]
